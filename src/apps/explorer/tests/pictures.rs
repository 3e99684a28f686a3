//! The picture at rest is what the program `render` writes: by the command that the explorer shows,
//! and by the scene that it saves.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use deepshadow::cli::{Outcome, run};
use deepshadow_explorer::output::command;

use super::support::Window;

/// Words of a command, as a shell takes them apart.
fn words(command: &str) -> Vec<OsString> {
    let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
    for c in command.chars() {
        match c {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(std::mem::take(&mut word).into()),
            c => word.push(c),
        }
    }
    words.push(word.into());
    words
}

/// Runs a command with another output.
fn rendered(command: &str, out: &Path) -> Vec<u8> {
    let mut words = words(command);
    let at = words.iter().position(|word| word == "-o").unwrap();
    words[at + 1] = out.into();
    words.extend(["--quiet", "--backend", "cpu"].map(OsString::from));
    let hook = std::panic::take_hook();
    let outcome = run(words);
    // The program has its own words for what goes wrong.
    std::panic::set_hook(hook);
    assert_eq!(outcome, Outcome::Done, "{command}");
    fs::read(out).unwrap()
}

/// What the explorer writes, and what `render` writes by its command and by its scene, in `format`.
fn assert_same(window: &mut Window, folder: &Path, has_command: bool, format: &str) {
    let own = folder.join(format!("own.{format}"));
    window.explorer().save_picture(own.clone());
    window.wait();
    let scene = folder.join("scene.toml");
    window.explorer().save_scene(scene.clone());
    window.wait();
    assert_eq!(window.errors(), [""; 0]);
    let own = fs::read(own).unwrap();
    let by_scene = format!("deepshadow render {} -o x", scene.display());
    assert!(own == rendered(&by_scene, &folder.join(format!("scene.{format}"))), "by the scene");
    let document = window.explorer().document.clone().unwrap();
    let size = window.explorer().settings().unwrap().image.size;
    let command = command(&document, Some(size));
    assert_eq!(command.is_some(), has_command, "{command:?}");
    if let Some(command) = command {
        let own_name = folder.join(format!("command.{format}"));
        assert!(own == rendered(&command, &own_name), "{command}");
    }
    // The scene can be opened here again, and looks the same.
    let picture = window.explorer().pictures[0].as_ref().unwrap().picture.image.clone();
    let mut again = Window::open(scene.to_str().unwrap(), [640.0, 480.0]);
    let shown = again.explorer().pictures[0].as_ref().unwrap().picture.image.clone();
    assert!(shown == picture, "opened again");
}

#[test]
fn as_it_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    for (input, format) in [("bucky", "exr"), ("rods", "png")] {
        let mut window = Window::open(input, [640.0, 480.0]);
        assert_same(&mut window, folder.path(), true, format);
    }
}

#[test]
fn after_hands_and_panels_have_changed_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::tall("bucky");
    window.slide("density scale", 7.0);
    window.choose("filter", "pcf3");
    window.choose("map", "nested");
    window.choose("transfer function", "viridis");
    window.slide("exposure", 0.5);
    window.slide("ground height", -0.7);
    window.wait();
    let camera = window.explorer().scene().unwrap().camera;
    let mut turned = camera;
    deepshadow_explorer::hands::orbit(&mut turned, [0.2, 0.1]);
    window.explorer().document.as_mut().unwrap().place_camera(&turned);
    window.wait();
    assert_same(&mut window, folder.path(), true, "exr");
    // Not everything has an option.
    window.tick("emission");
    window.wait();
    assert_same(&mut window, folder.path(), false, "png");
}

#[test]
fn while_something_moves_it_is_smaller_and_says_so() {
    let mut window = Window::open("bucky", [1100.0, 800.0]);
    window.explorer().budget = std::time::Duration::from_millis(4);
    let mut camera = window.explorer().scene().unwrap().camera;
    deepshadow_explorer::hands::orbit(&mut camera, [0.1, 0.0]);
    let whole = window.explorer().settings().unwrap().image.size;
    window.explorer().document.as_mut().unwrap().place_camera(&camera);
    window.until(|explorer| !explorer.pictures[0].as_ref().unwrap().picture.whole);
    let moving = window.explorer().pictures[0].as_ref().unwrap().picture.clone();
    assert!(moving.size[0] < whole[0], "{:?} {whole:?}", moving.size);
    // A camera that moves keeps the map.
    assert_eq!(moving.times.map, 0.0);
    window.wait();
    let still = window.explorer().pictures[0].as_ref().unwrap().picture.clone();
    assert_eq!((still.size, still.whole), (whole, true));
}
