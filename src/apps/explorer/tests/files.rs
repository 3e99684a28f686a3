//! Files that are opened and written, and what happens when they cannot be.

use std::fs;

use deepshadow::io::encode_array;
use deepshadow_explorer::output::command;

use super::support::Window;

/// A volume's file in a folder.
fn volume(folder: &std::path::Path, name: &str) -> String {
    let values = (0..12 * 10 * 8).map(|i| ((i * 7) % 13) as f32 / 13.0);
    let path = folder.join(name);
    fs::write(&path, encode_array(&[8, 10, 12], values).unwrap()).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn what_cannot_be_opened_is_said_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let good = volume(folder.path(), "good.npy");
    let mut window = Window::open(&good, [900.0, 600.0]);
    let cut = folder.path().join("cut.npy");
    fs::write(&cut, &fs::read(&good).unwrap()[..200]).unwrap();
    let broken = folder.path().join("broken.toml");
    fs::write(&broken, "[volume]\npath = 3\n").unwrap();
    let empty = folder.path().join("empty.vdb");
    fs::write(&empty, "").unwrap();
    for bad in [folder.path().join("none.vdb"), broken, cut, empty] {
        window.explorer().open(bad.to_str().unwrap());
        window.until(|explorer| {
            let said = explorer.messages.iter().any(|message| message.is_error);
            said && explorer.is_at_rest()
        });
        let errors = window.errors();
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(!errors[0].contains('\n'), "{errors:?}");
        // What was open is still there, and can be turned.
        assert_eq!(window.explorer().document.as_ref().unwrap().input, good, "{errors:?}");
        window.slide("density scale", 2.0);
        window.wait();
        window.explorer().messages.clear();
        window.press("reset density scale");
        window.wait();
    }
}

#[test]
fn pictures_and_scenes_are_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let input = volume(folder.path(), "cloud.npy");
    let mut window = Window::open(&input, [700.0, 500.0]);
    let before = fs::read(&input).unwrap();
    // The input itself, a name without an ending, a folder that is not there.
    for bad in [
        std::path::PathBuf::from(&input),
        folder.path().join("picture"),
        folder.path().join("none/picture.png"),
    ] {
        window.explorer().save_picture(bad);
        window.wait();
        assert_eq!(window.errors().len(), 1, "{:?}", window.errors());
        window.explorer().messages.clear();
    }
    window.explorer().save_scene(folder.path().join("scene.txt"));
    window.wait();
    assert_eq!(window.errors().len(), 1);
    assert_eq!(fs::read(&input).unwrap(), before);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_round_of_pictures_is_numbered_and_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::open("box", [500.0, 400.0]);
    let before = window.file();
    for (of_light, name) in [(false, "turn.##.png"), (true, "sun.##.png")] {
        (window.explorer().output.count, window.explorer().output.of_light) = (3, of_light);
        window.explorer().begin_round(&folder.path().join(name));
        window.wait();
        assert_eq!(window.errors(), [""; 0]);
        let name = name.replace("##", "01");
        let first = fs::read(folder.path().join(&name)).unwrap();
        let second = fs::read(folder.path().join(name.replace("01", "02"))).unwrap();
        assert_ne!(first, second);
        assert!(folder.path().join(name.replace("01", "03")).exists());
        assert_eq!(window.file(), before);
    }
    window.explorer().begin_round(&folder.path().join("no-number.png"));
    assert_eq!(window.errors().len(), 1);
}

#[test]
fn a_sequence_is_played() {
    let folder = tempfile::tempdir().unwrap();
    for frame in 3..6 {
        volume(folder.path(), &format!("smoke.{frame:04}.npy"));
    }
    let pattern = folder.path().join("smoke.####.npy");
    let mut window = Window::open(pattern.to_str().unwrap(), [800.0, 900.0]);
    assert_eq!(window.explorer().document.as_ref().unwrap().frames, Some(3..=5));
    window.slide("frame", 5.0);
    window.wait();
    assert_eq!(window.explorer().document.as_ref().unwrap().frame, 5);
    window.press("play");
    window.until(|explorer| explorer.document.as_ref().unwrap().frame == 4);
    window.press("pause");
    window.wait();
    assert!(!window.explorer().playing);
    let frame = window.explorer().document.as_ref().unwrap().frame;
    // What was chosen is the same in all frames.
    assert!(window.file().volume[0].density_scale.is_some());
    let document = window.explorer().document.clone().unwrap();
    let command = command(&document, Some([64, 64])).unwrap();
    assert!(command.contains(&format!("smoke.{frame:04}.npy")), "{command}");
}

/// Nothing that comes late takes the place of what was opened after it, and nothing that cannot be
/// loaded stays.
#[test]
fn the_latest_that_was_opened_counts() {
    let folder = tempfile::tempdir().unwrap();
    let first = volume(folder.path(), "first.npy");
    let second = volume(folder.path(), "second.npy");
    let bad = folder.path().join("bad.toml");
    fs::write(&bad, format!("[volume]\npath = '{first}.none'\n")).unwrap();
    let bad = bad.to_str().unwrap().to_owned();
    let mut window = Window::open(&first, [700.0, 500.0]);
    for order in [[&bad, &second], [&second, &bad], [&second, &first]] {
        for input in order {
            window.explorer().open(input);
            window.steps(2);
        }
        window.wait();
        let explorer = window.explorer();
        let found = explorer.document.as_ref().unwrap().input.clone();
        if *order[1] == bad {
            // What was opened before it may not have been drawn yet.
            assert!(found == first || found == second, "{order:?}: {found}");
        } else {
            assert_eq!(found, *order[1], "{order:?}");
        }
        assert!(explorer.shown().unwrap().picture.whole);
        explorer.messages.clear();
        window.explorer().open(&first);
        window.wait();
    }
    // A file that has changed is read again.
    let before = window.explorer().shown().unwrap().picture.image.clone().unwrap();
    let values = (0..12 * 10 * 8).map(|i| ((i * 3) % 7) as f32 / 7.0);
    fs::write(&first, encode_array(&[8, 10, 12], values).unwrap()).unwrap();
    window.explorer().open(&first);
    window.wait();
    assert!(window.explorer().shown().unwrap().picture.image.clone().unwrap() != before);
}

/// What was exported can be imported again, also into scenes.
#[test]
fn transfer_functions_go_out_and_come_in() {
    use deepshadow::scene::file::TransferTable;
    use deepshadow_explorer::explorer::Dialog;

    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::open(&volume(folder.path(), "a.npy"), [700.0, 900.0]);
    let points = vec![[0.0, 1.0, 0.5, 0.25, 0.0], [0.7, 0.1, 0.2, 0.3, 0.9]];
    let table = TransferTable { points: Some(points), ..TransferTable::default() };
    window.explorer().document.as_mut().unwrap().file.volume[0].transfer = Some(table.clone());
    window.wait();
    let out = folder.path().join("function.toml");
    window.explorer().chosen(Dialog::ExportTransfer, out.clone());
    window.wait();
    window.choose("transfer function", "none");
    window.wait();
    window.explorer().chosen(Dialog::ImportTransfer, out);
    window.wait();
    assert_eq!(window.file().volume[0].transfer, Some(table));
    let list = folder.path().join("list.txt");
    fs::write(&list, "0 0\n1 1\n").unwrap();
    window.explorer().chosen(Dialog::ImportTransfer, list.clone());
    window.wait();
    assert_eq!(window.file().volume[0].transfer.as_ref().unwrap().file, Some(list));
    assert_eq!(window.errors(), [""; 0]);
    window.explorer().chosen(Dialog::ImportTransfer, folder.path().join("none.toml"));
    window.steps(2);
    assert_eq!(window.errors().len(), 1);
}

/// What is given up stays given up until something changes.
#[test]
fn work_is_given_up() {
    let mut window = Window::open("clouds", [900.0, 700.0]);
    window.slide("density scale", 60.0);
    window.until(|explorer| !explorer.shown().unwrap().picture.whole);
    window.explorer().cancel();
    window.wait();
    window.steps(20);
    assert!(!window.explorer().shown().unwrap().picture.whole && !window.explorer().is_drawn());
    window.slide("density scale", 61.0);
    window.wait();
    assert!(window.explorer().is_drawn());
    // What nobody has seen yet is not opened at all.
    window.explorer().open("bucky");
    window.steps(1);
    window.explorer().cancel();
    window.wait();
    assert_eq!(window.explorer().document.as_ref().unwrap().input, "clouds");
}
