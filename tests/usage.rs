//! Mistakes of users: the exit code tells where the mistake is, and the line tells what it is.

use std::fs;
use std::process::{Command, Output, Stdio};

use super::cli::{Folder, must_succeed, program, stderr};
use super::formats::vdb_fixture;
use super::support::Picture;

const SMALL: &str = "--backend cpu --size 8x8 --map-size 8";

/// Runs the program; it must fail with this code and one line that names everything in `named`.
pub fn must_fail(folder: &Folder, arguments: &str, code: i32, named: &[&str]) -> String {
    let output = folder.run(arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "'{arguments}': {said}");
    assert_eq!(said.lines().filter(|line| !line.contains("(chosen")).count(), 1, "{said}");
    for name in named {
        assert!(said.contains(name), "'{arguments}' does not name '{name}': {said}");
    }
    said
}

fn piped(folder: &Folder, arguments: &[&str]) -> Output {
    let mut child = Command::new(program())
        .args(arguments)
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdin.take());
    child.wait_with_output().unwrap()
}

/// A value that an option cannot take is wrong usage; the same value in a scene file is bad input.
#[test]
fn the_same_mistake_has_the_same_exit_code_wherever_it_is_found() {
    let folder = Folder::new();
    fs::write(folder.path().join("v.raw"), [1_u8; 27]).unwrap();
    let before = folder.names();
    for (options, named) in [
        ("v.raw --dims 0,3,3 --type u8", "0,3,3"),
        ("v.raw --dims 4000000000,4000000000,4000000000 --type f64", "4000000000"),
        ("v.raw --dims 3,3,3 --type u8 --window 5,5", "window"),
        ("v.raw --dims 3,3,3 --type u8 --spacing 1,0,1", "spacing"),
        ("box --dims 3,3,3", "dims"),
        ("box --type u16", "type"),
        ("box --light 0,0,0", "direction"),
        ("box --thresholds 0.1,0.5,0.99999999", "thresholds"),
        ("box --thresholds 0.5,0.1,0.9", "thresholds"),
        ("box --map threshold --tolerance 0.1", "tolerance"),
        ("box --albedo 2,2,2", "albedo"),
        ("box --phase 3", "phase"),
        ("box --camera 1,1,1 --target 1,1,1", "camera"),
        ("box --quality 1000", "quality"),
        ("box --transfer nothing", "nothing"),
        ("box -o picture.bmp", "picture.bmp"),
        ("box --shading paper -o x.deep.exr", "shading"),
        ("box --map threshold --time 1", "map"),
    ] {
        must_fail(&folder, &format!("render {options} --backend cpu"), 2, &[named]);
    }
    must_fail(&folder, "map box -o map.png", 2, &["map.png"]);
    must_fail(
        &folder,
        "convert v.raw v.npy --dims 3,3,3 --type u8 --crop 2,0,0,1,2,2",
        2,
        &["crop"],
    );
    assert_eq!(folder.names(), before, "nothing was written");
    for (text, named) in [
        ("[volume]\npreset = \"box\"\nalbedo = [2, 2, 2]\n", "albedo"),
        ("[volume]\npreset = \"box\"\n[shadow]\nquality = 1000\n", "quality"),
        ("[volume]\npreset = \"box\"\n[light]\ndirection = [0, 0, 0]\n", "direction"),
        ("[volume]\npath = \"v.raw\"\ndims = [0, 3, 3]\ntype = \"u8\"\n", "0,3,3"),
    ] {
        fs::write(folder.path().join("s.toml"), text).unwrap();
        must_fail(&folder, "render s.toml --backend cpu --density-scale 3", 1, &[named]);
    }
    // Here the option is wrong, not the scene.
    fs::write(folder.path().join("s.toml"), "[volume]\npreset = \"box\"\n").unwrap();
    must_fail(&folder, "render s.toml --backend cpu --quality 1000", 2, &["quality"]);
    // A goal that is not reached is no mistake of the command line.
    let goal = "render box --backend cpu --map threshold --map-size 4 --max-error 1e-9";
    must_fail(&folder, goal, 1, &["max-error"]);
}

#[test]
fn options_that_contradict_each_other_are_refused_before_the_work() {
    let folder = Folder::new();
    // The file does not exist, which would be found first otherwise.
    for goal in ["--max-picture-error 0.01", "--time 1"] {
        for other in [
            "--steps 9",
            "--view-steps 9",
            "--tolerance 0.1",
            "--max-error 0.1",
            "--max-map-bytes 4MiB",
        ] {
            let option = other.split(' ').next().unwrap();
            must_fail(&folder, &format!("render no.vdb {goal} {other}"), 2, &[option]);
        }
    }
    must_fail(&folder, "render no.vdb --time 1 --max-picture-error 0.1", 2, &["--time"]);
}

#[test]
fn misspelled_words_get_the_similar_one() {
    let folder = Folder::new();
    must_fail(&folder, "render box --smaples 4", 2, &["--smaples", "'--samples'"]);
    must_fail(&folder, "rendr box", 2, &["rendr", "'render'"]);
    must_fail(&folder, "convert a b --compression zipp", 2, &["zipp", "'zip'"]);
}

#[test]
fn usual_spellings_of_types_and_sizes_are_understood() {
    let folder = Folder::new();
    fs::write(folder.path().join("v.raw"), [7_u8; 48]).unwrap();
    let picture = |options: &str| {
        must_succeed(&folder.run(&format!("render v.raw {options} {SMALL} --quiet -o v.png")));
        fs::read(folder.path().join("v.png")).unwrap()
    };
    let expected = picture("--dims 2,3,4 --type u16");
    for spelling in
        ["--dims 2x3x4 --type uint16", "--dims 2X3X4 --type U16", "--dims 2,3,4 --type ushort"]
    {
        assert!(picture(spelling) == expected, "{spelling}");
    }
    let expected = picture("--dims 1,3,4 --type f32");
    for name in ["float", "float32", "Float"] {
        assert!(picture(&format!("--dims 1x3x4 --type {name}")) == expected, "{name}");
    }
    must_fail(&folder, "render v.raw --dims 2x3 --type u16", 2, &["dims"]);
    must_fail(&folder, "render v.raw --dims 2,3,4 --type uint", 2, &["uint"]);
    must_fail(&folder, "render v.raw --dims 2,3,4 --type uint128", 2, &["uint128"]);
}

#[test]
fn an_output_whose_folder_is_not_there_says_so_and_no_other_name() {
    let folder = Folder::new();
    fs::write(folder.path().join("file"), "").unwrap();
    for (arguments, named) in [
        ("render box -o no/such/out.png", "'no/such' does not exist"),
        ("render box -o file/out.png", "'file' is not a folder"),
        ("map box -o no/out.exr", "'no' does not exist"),
        ("convert box.vdb no/out.npy", "'no' does not exist"),
        ("compare box -o no/such/report", "'no/such' does not exist"),
    ] {
        fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("box.vdb")).unwrap();
        let said = must_fail(&folder, arguments, 1, &[named]);
        assert!(!said.contains(".deepshadow"), "a temporary name: {said}");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_as_input_is_called_a_pipe() {
    let folder = Folder::new();
    for arguments in [
        &["info", "/dev/stdin"][..],
        &["render", "/dev/stdin"],
        &["convert", "/dev/stdin", "x.npy"],
        &["render", "/dev/stdin", "--dims", "2,2,2", "--type", "u8"],
        &["info", "/dev/null"],
    ] {
        let output = piped(&folder, arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("a pipe or a device") && said.lines().count() == 1, "{said}");
    }
    // A file that is redirected is no pipe.
    let file = fs::File::open(vdb_fixture("ball_blosc.vdb")).unwrap();
    let mut info = Command::new(program());
    must_succeed(&info.args(["info", "/dev/stdin"]).stdin(file).output().unwrap());
}

#[test]
fn a_truncated_vdb_file_is_said_to_be_cut_short() {
    let folder = Folder::new();
    let bytes = fs::read(vdb_fixture("ball_blosc.vdb")).unwrap();
    for share in [0.5, 0.9, 0.999] {
        let end = (bytes.len() as f64 * share) as usize;
        fs::write(folder.path().join("x.vdb"), &bytes[..end]).unwrap();
        must_fail(&folder, "info x.vdb", 1, &["x.vdb", "cut short", &end.to_string()]);
    }
}

/// What is surely no raw volume gets no advice on raw volumes.
#[test]
fn files_that_are_no_volumes_are_called_what_they_are() {
    let folder = Folder::new();
    must_succeed(&folder.run(&format!("render box {SMALL} --quiet -o p.png")));
    must_succeed(&folder.run(&format!("render box {SMALL} --quiet -o p.jpg")));
    fs::write(folder.path().join("empty.vdb"), "").unwrap();
    fs::write(folder.path().join("m.obj"), "# made by hand\n\nmtllib m.mtl\nv 0 0 0\n").unwrap();
    fs::write(folder.path().join("m.ply"), "ply\nformat ascii 1.0\n").unwrap();
    for (name, what) in [
        ("empty.vdb", "empty"),
        ("m.obj", "mesh"),
        ("m.ply", "a mesh in PLY"),
        ("p.png", "a picture (PNG)"),
        ("p.jpg", "a picture (JPEG)"),
    ] {
        for command in ["info", "render"] {
            let said = must_fail(&folder, &format!("{command} {name}"), 1, &[name, what]);
            assert!(!said.contains("--dims"), "{said}");
        }
    }
    // Anything may be raw.
    fs::write(folder.path().join("v.raw"), "v 1234567").unwrap();
    must_succeed(&folder.run(&format!("render v.raw --dims 3,3,1 --type u8 {SMALL}")));
    fs::write(folder.path().join("w.raw"), [9; 64]).unwrap();
    must_fail(&folder, "info w.raw", 1, &["--dims", "w.raw.toml"]);
}

#[test]
fn a_broken_file_beside_the_input_does_no_harm() {
    let folder = Folder::new();
    fs::write(folder.path().join("v.raw"), [9; 27]).unwrap();
    must_succeed(&folder.run("convert v.raw v.npy --dims 3,3,3 --type u8 --quiet"));
    fs::remove_file(folder.path().join("v.npy.toml")).unwrap();
    for text in ["[volume\n", "width = 3\n", "dims = [3, 3, 3]\nspacng = [1, 1, 1]\n"] {
        fs::write(folder.path().join("v.toml"), text).unwrap();
        must_succeed(&folder.run(&format!("render v.npy {SMALL}")));
        must_succeed(&folder.run(&format!("render v.raw --dims 3,3,3 --type u8 {SMALL}")));
        must_succeed(&folder.run("info v.npy"));
    }
    // Where it may have been meant, it is named.
    must_fail(&folder, "render v.raw", 1, &["--dims", "v.toml", "spacng"]);
    let output = folder.run(&format!("render v.npy {SMALL}"));
    assert!(stderr(&output).contains("v.toml is not read"), "{}", stderr(&output));
}

#[test]
fn info_describes_presets() {
    let folder = Folder::new();
    let output = folder.run("info clouds");
    must_succeed(&output);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("512 x 512 x 32") && text.contains("histogram"), "{text}");
    let output = folder.run("info bucky --json");
    must_succeed(&output);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let grid = &found["grids"][0];
    assert_eq!(found["format"], "preset");
    assert_eq!(grid["active_voxels"], 32 * 32 * 32);
    assert_eq!((&grid["min"], &grid["max"]), (&0.0.into(), &1.0.into()));
    must_fail(&folder, "info clouds --dims 1,1,1", 2, &["dims"]);
    must_fail(&folder, "info cloud", 1, &["cloud", "no such file", "clouds"]);
    // A file of that name is that file.
    fs::write(folder.path().join("clouds"), "").unwrap();
    must_fail(&folder, "info clouds", 1, &["empty"]);
}

#[test]
fn completions_are_printed_for_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = folder.run(&format!("completions {shell}"));
        must_succeed(&output);
        let script = String::from_utf8(output.stdout).unwrap();
        for word in ["deepshadow", "render", "tolerance"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    must_fail(&folder, "completions csh", 2, &["csh", "bash"]);
}

#[test]
fn the_environment_gives_the_number_of_threads_unless_the_option_does() {
    let folder = Folder::new();
    let run = |value: &str, option: &[&str]| {
        let mut command = Command::new(program());
        command.args("render box -o x.png".split(' ')).args(SMALL.split(' ')).args(option);
        command.current_dir(folder.path()).env("DEEPSHADOW_THREADS", value).output().unwrap()
    };
    let output = run("3", &[]);
    assert!(stderr(&output).contains("3 threads"), "{}", stderr(&output));
    let output = run("3", &["--threads", "2"]);
    assert!(stderr(&output).contains("2 threads"), "{}", stderr(&output));
    assert_eq!(run("many", &[]).status.code(), Some(2));
    assert_eq!(Picture::open(folder.path().join("x.png")).size, [8, 8]);
}
