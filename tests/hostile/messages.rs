//! Whatever a file or an argument holds, what people read of it is lines of bounded length without
//! a byte that a terminal obeys.

use std::process::{Command, Output};

use deepshadow::io::vdb::{Compression, MetaValue, Metadata, NewGrid, TreeBuilder, VdbWriter};
use glam::{DMat4, IVec3};

use crate::cli::{Folder, program, stderr};

/// What is wrong with a text for people, if anything.
pub fn fault(text: &str) -> Option<String> {
    steering(text).or_else(|| {
        let long = text.lines().find(|line| line.chars().count() > 300)?;
        Some(format!("{} characters: {long:?}", long.chars().count()))
    })
}

/// The first line with what a terminal obeys or hides, if there is one.
pub fn steering(text: &str) -> Option<String> {
    text.lines().find_map(|line| {
        let hidden = line.chars().find(|&c| {
            c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{2028}' | '\u{2029}')
        });
        hidden.map(|c| format!("{c:?} in {line:?}"))
    })
}

fn run(folder: &Folder, arguments: &[&str]) -> Output {
    let command = &mut Command::new(program());
    command.args(arguments).current_dir(folder.path()).output().unwrap()
}

const ESCAPES: &str = "\u{1b}[31m\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}\r\u{7f}";

/// A small grid with hostile names.
fn vdb() -> Vec<u8> {
    let mut tree = TreeBuilder::new(0.0_f32);
    tree.set(IVec3::ONE, 1.0, true);
    let mut grid = NewGrid::new(tree.finish().into(), &DMat4::IDENTITY).with_class(ESCAPES);
    let long = format!("{ESCAPES}\n{}", "x".repeat(2000));
    grid.metadata().set(ESCAPES, MetaValue::String(long.clone()));
    let mut writer = VdbWriter::new(&[&long, "other"], Compression::NONE, &Metadata::default());
    writer.add(grid).unwrap();
    let mut tree = TreeBuilder::new(0.0_f32);
    tree.set(IVec3::ONE, 1.0, true);
    writer.add(NewGrid::new(tree.finish().into(), &DMat4::IDENTITY)).unwrap();
    writer.finish().unwrap()
}

#[test]
fn errors_that_quote_files_steer_no_terminal() {
    let folder = Folder::new();
    let nrrd =
        |line: &str| format!("NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\n{line}\n\n");
    let long = "y".repeat(5000);
    let vti = |name: &str| {
        format!(
            "<?xml version=\"1.0\"?><VTKFile type=\"ImageData\" {name}=\"1\"><ImageData \
             WholeExtent=\"0 1 0 1 {name} 1\"><{name}></VTKFile>"
        )
    };
    let files: [(&str, Vec<u8>); 11] = [
        ("type.nrrd", nrrd(&format!("type: fl{ESCAPES}oat")).into()),
        ("long.nrrd", nrrd(&format!("type: {long}")).into()),
        ("encoding.nrrd", nrrd(&format!("encoding: {ESCAPES}")).into()),
        ("spacing.nrrd", nrrd(&format!("encoding: raw\nspacings: {ESCAPES} {long}")).into()),
        ("mark.pvm", format!("PVM{ESCAPES}\n2 2 2\n1\n12345678").into()),
        ("dims.pvm", format!("PVM\n2 {ESCAPES} 2\n1\n12345678").into()),
        ("type.mha", format!("NDims = 3\nDimSize = 2 2 2\nElementType = {ESCAPES}\nElementDataFile = LOCAL\n").into()),
        ("file.mhd", format!("NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = {ESCAPES}{long}\n").into()),
        ("xml.vti", vti(ESCAPES).into()),
        ("long.vti", vti(&long).into()),
        ("key.toml", format!("[volume]\n\"{long}\\u001b\" = 1\n\"a\\u009b\" = 2\n").into()),
    ];
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let command = if name.ends_with("toml") { "render" } else { "info" };
        for arguments in [&[command, name][..], &["convert", name, "out.npy"]] {
            let output = run(&folder, arguments);
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", stderr(&output));
            let said = stderr(&output);
            assert_eq!((said.lines().count(), fault(&said)), (1, None), "{arguments:?}");
        }
    }
}

#[test]
fn names_of_grids_and_of_files_are_escaped_wherever_they_are_said() {
    let folder = Folder::new();
    let name = format!("{}\n.vdb", &ESCAPES.replace('/', ""));
    std::fs::write(folder.path().join(&name), vdb()).unwrap();
    let name = name.as_str();
    for arguments in [
        &["info", name][..],
        &["info", name, "--grid", ESCAPES],
        &["convert", name, "out.npy"],
        &["convert", name, "out.nrrd"],
        &["convert", name, "out.vdb", "--grid", "none\u{1b}"],
        &["render", name, "--size", "8x8", "--map-size", "8", "--backend", "cpu"],
        &["render", name, "--grid", "\u{9b}"],
        &["map", name, "-o", "m\u{1b}.png"],
        &["render", "none\u{1b}[2J\n.vdb"],
        // Words of the command line, which it quotes itself.
        &["render", "rods", "--size", "1x\u{1b}[31m\n\n2"],
        &["render", "rods", "--map", "\u{1b}\u{202e}"],
        &["\u{1b}[31m"],
        &["render", "--\u{1b}[31m\nx"],
        &["convert", "a", "b", "--compression", "\u{9b}"],
    ] {
        let output = run(&folder, arguments);
        assert!(output.status.code().is_some_and(|code| code <= 2), "{arguments:?}");
        let said = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        for text in &said {
            assert_eq!(fault(text), None, "{arguments:?}");
        }
        let words = said.concat();
        assert!(
            words.contains("\\u{1b}")
                || words.contains("\\u{9b}")
                || output.status.code() == Some(2),
            "{arguments:?}: {words}"
        );
    }
    // Programs read the very names.
    let output = run(&folder, &["info", name, "--json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.chars().all(|c| c == '\n' || !c.is_control()), "{text}");
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let grid = found["grids"][0]["name"].as_str().unwrap();
    assert_eq!(grid, format!("{ESCAPES}\n{}", "x".repeat(2000)));
}

#[cfg(feature = "gpu")]
#[test]
fn a_lost_device_is_an_error_of_one_line() {
    use deepshadow::backend::Backend;
    use deepshadow::gpu::{AdapterChoice, GpuBackend};
    use deepshadow::progress::Silent;
    use deepshadow::volume::presets::Preset;

    use crate::support::scenes::{anchor_scene, settings};

    if crate::support::backends::gpu().is_none() {
        return;
    }
    let gpu = GpuBackend::open(AdapterChoice::Any).unwrap();
    let (scene, settings) = (anchor_scene(Preset::Rods, 4.0, 8), settings(8, [8, 8]));
    gpu.render(&scene, &settings, &Silent).unwrap();
    gpu.renderer().device().destroy();
    for _ in 0..2 {
        let error = gpu.render(&scene, &settings, &Silent).unwrap_err().to_string();
        assert!(error.starts_with("gpu: the device is lost"), "{error}");
        assert_eq!(fault(&error), None);
    }
}

#[cfg(feature = "gpu")]
#[test]
fn what_a_device_is_too_small_for_is_refused_before_the_work_with_the_number() {
    use crate::support::scenes::settings;
    use deepshadow::backend::Backend;
    use deepshadow::gpu::{AdapterChoice, GpuBackend};

    if crate::support::backends::gpu().is_none() {
        return;
    }
    let gpu = GpuBackend::open(AdapterChoice::Any).unwrap();
    let limits = gpu.renderer().device().limits();
    let longest = limits.max_texture_dimension_2d;
    gpu.check_room(&settings(64, [64, 64])).unwrap();
    let error = gpu.renderer().image(longest + 1, 1).unwrap_err().to_string();
    let due = format!("picture: needs {}x1, the limit is {longest} along an edge", longest + 1);
    assert_eq!(error, due);
}
