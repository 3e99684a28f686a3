//! Scripts, in a window that nobody sees.

use std::fs;
use std::path::Path;

use deepshadow::scene::SceneFile;
use deepshadow_explorer::Explorer;
use deepshadow_explorer::host::Screen;
use deepshadow_explorer::host::offscreen::{OffScreen, save_screenshot};
use deepshadow_explorer::script::{Measured, Script, Step, changed};

/// Runs a script; returns the explorer and what was measured.
fn run(text: &str) -> Option<deepshadow::Result<(Explorer, Measured)>> {
    if std::env::var("DEEPSHADOW_TEST_GPU").is_ok_and(|value| value == "skip") {
        eprintln!("SKIPPED: DEEPSHADOW_TEST_GPU=skip, nothing is drawn off screen");
        return None;
    }
    let mut script = Script::parse(text, Path::new("script")).unwrap();
    let mut host = OffScreen::new([700.0, 500.0], 1.0).unwrap();
    let mut explorer = Explorer::new(&host.context, Some(&Screen(host.screen.clone()))).unwrap();
    loop {
        let step = match script.step(&mut explorer) {
            Ok(step) => step,
            Err(error) => return Some(Err(error)),
        };
        let output = host.frame(Vec::new(), |ui| explorer.show(ui));
        match step {
            Step::End => return Some(Ok((explorer, script.measured))),
            Step::Screenshot(path) => {
                let inputs = explorer.inputs(script.inputs());
                save_screenshot(&host.seen(output).unwrap(), &path, &inputs).unwrap();
            }
            Step::Window(size) => host.resize(size),
            Step::Go => {}
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

#[test]
fn a_script_does_what_hands_do() {
    let folder = tempfile::tempdir().unwrap();
    let name = |name: &str| folder.path().join(name).display().to_string();
    let text = format!(
        "open box   # a preset\nwait\ndrag camera 0.2 0.1 3\ndrag light 0.2 0 3\nzoom 1.1\npan 0.1 0\n\
         set shadow.map \"threshold\"\nset volume.albedo [0.5, 0.6, 0.7]\ncompare on\n\
         set shadow.map \"nested\"\nwiper 0.3\nwait\nscreenshot {}\npicture {}\nscene {}\n\
         compare off\ncurves 0.5 0.5\nwait\nheat on\nwait\nunset shadow.map\ntheme light\nwait\n\
         screenshot {}\n",
        name("a.png"),
        name("picture.png"),
        name("scene.toml"),
        name("b.png"),
    );
    let Some(ran) = run(&text) else { return };
    let (explorer, measured) = ran.unwrap();
    assert_eq!(measured.answers.len(), 6);
    assert!(measured.answers.iter().all(|answer| answer.seconds > 0.0));
    assert!(measured.first_picture.is_some() && measured.waits.len() == 5, "{measured:?}");
    let file = explorer.document.as_ref().unwrap().file.clone();
    assert_eq!(file.shadow.map, None);
    assert_eq!(file.volume[0].albedo, Some([0.5, 0.6, 0.7]));
    let (difference, _) = explorer.looking.difference.as_ref().unwrap();
    // The nested map of a small box is good to some percent.
    let found = (difference.share, difference.rms, difference.largest);
    assert!(found.0 >= 1.0 && found.1 < 0.05 && found.2 > 0.0, "{found:?}");
    let (curves, _) = explorer.looking.drawn.as_ref().unwrap();
    assert!(curves.kinds[0].3 < 0.1 && curves.truth.len() > 100);
    for file in ["a.png", "b.png", "picture.png", "scene.toml"] {
        assert!(fs::metadata(name(file)).unwrap().len() > 500, "{file}");
    }
}

#[test]
fn wrong_lines_are_named() {
    for (text, named) in [
        ("open", "line 1: 'open' needs an input"),
        ("wait\nturn 3", "line 2: 'turn 3' is no command"),
        ("drag sun 1 2", "drags neither camera nor light"),
        ("drag light 1", "needs two shares and a number of steps"),
        ("zoom x", "needs numbers"),
        ("window 3 4", "needs a width and a height"),
        ("device fpga", "is not one of auto, gpu, cpu"),
        ("panels maybe", "needs on or off"),
        ("section Bogus", "names none of Volume, Surfaces"),
        ("screenshot a.jpg", "needs a file that ends in .png"),
    ] {
        let error = Script::parse(text, Path::new("s.txt")).err().unwrap().to_string();
        assert!(error.starts_with("s.txt: ") && error.contains(named), "{error}");
    }
}

/// Whatever a script asks for, it ends, with the line that was wrong.
#[test]
fn scripts_end_with_what_went_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("own.toml");
    fs::write(&input, "[volume]\npreset = 'box'\n").unwrap();
    let input = input.display();
    for (text, named) in [
        ("open box\nset shadow.size 0\nwait".to_owned(), "line 3: "),
        ("open box\nwait\nset camera.fov_y_degrees 500\nwait\n".to_owned(), "fov_y_degrees"),
        ("open box\nset volume.density_scale nan\nwait".to_owned(), "nan is not a number"),
        ("open box\nset image.width 0\nset image.height 9\nwait".to_owned(), "image.width"),
        (format!("open {input}.none\nwait"), "no such file"),
        (format!("open {input}\nwait\npicture {input}\nwait"), "ends in none of"),
        ("open box\nframe 3".to_owned(), "there is no frame 3"),
    ] {
        let Some(ran) = run(&text) else { return };
        let error = ran.err().unwrap_or_else(|| panic!("{text} ended well")).to_string();
        assert!(error.contains(named) && !error.contains('\n'), "{text}: {error}");
        assert!(error.starts_with("script: line "), "{error}");
    }
    assert_eq!(fs::read_to_string(input.to_string()).unwrap(), "[volume]\npreset = 'box'\n");
    // Those that follow each other count together.
    let text = "open box\nwait\nset light.kind \"point\"\nset light.position [0, 2, 0]\nwait";
    let Some(ran) = run(text) else { return };
    assert!(ran.is_ok(), "{:?}", ran.err());
}

#[test]
fn keys_of_scenes_are_set_as_they_are_written() {
    let file = SceneFile::default();
    let file = changed(&file, "shadow.map", Some("\"nested\"")).unwrap();
    let file = changed(&file, "volume.transfer.name", Some("\"fire\"")).unwrap();
    assert_eq!(file.shadow.map.as_deref(), Some("nested"));
    assert_eq!(file.volume[0].transfer.as_ref().unwrap().name.as_deref(), Some("fire"));
    let file = changed(&file, "shadow.map", None).unwrap();
    assert_eq!(file.shadow.map, None);
    for (key, value) in [("shadow.mapp", "1"), ("shadow.map", "1"), ("shadow.map", "nested")] {
        let error = changed(&file, key, Some(value)).unwrap_err().to_string();
        assert!(error.starts_with(key) && !error.contains('\n'), "{error}");
    }
}

/// A device that is lost is said, and the processor goes on.
#[test]
fn a_lost_device_is_not_the_end() {
    if std::env::var("DEEPSHADOW_TEST_GPU").is_ok_and(|value| value == "skip") {
        eprintln!("SKIPPED: DEEPSHADOW_TEST_GPU=skip, nothing is drawn off screen");
        return;
    }
    let mut host = OffScreen::new([500.0, 400.0], 1.0).unwrap();
    let mut explorer = Explorer::new(&host.context, Some(&Screen(host.screen.clone()))).unwrap();
    explorer.device = deepshadow_explorer::engine::Device::Gpu;
    explorer.open("box");
    let mut wait = |explorer: &mut Explorer| {
        let since = std::time::Instant::now();
        for _ in 0.. {
            host.frame(Vec::new(), |ui| explorer.show(ui));
            std::thread::sleep(std::time::Duration::from_millis(2));
            if explorer.is_at_rest() {
                break;
            }
            assert!(since.elapsed().as_secs() < 120, "nothing happens");
        }
        host.frame(Vec::new(), |ui| explorer.show(ui));
        host.screen.device.clone()
    };
    let device = wait(&mut explorer);
    let by = explorer.shown().unwrap().picture.device.clone();
    assert!(by.starts_with("gpu"), "{by}");
    device.destroy();
    explorer.document.as_mut().unwrap().file.shadow.map = Some("threshold".to_owned());
    wait(&mut explorer);
    let shown = explorer.shown().unwrap();
    assert!(shown.picture.whole && shown.picture.device.starts_with("cpu"));
    let said = explorer.messages.iter().find(|message| message.is_error).unwrap();
    assert!(said.text.contains("the processor draws from now on"), "{}", said.text);
}
