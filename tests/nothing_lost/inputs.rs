//! Tests that inputs stay unchanged, and so do the files of other outputs.

use std::fs;
use std::os::unix::fs::symlink;

use super::{ENDINGS, contents, voxels, with_all_formats};
use crate::cli::{Folder, must_succeed, stderr};
use crate::formats::vdb_fixture;

#[test]
fn files_of_every_pair_of_formats_live_side_by_side() {
    let folder = with_all_formats();
    let before = contents(folder.path());
    let first = voxels(&folder, "v.vdb").unwrap();
    for from in ENDINGS {
        assert!(voxels(&folder, &format!("v.{from}")).unwrap() == first, "{from}");
        for to in ENDINGS {
            // With the same name, another ending and other voxels, no existing file changes.
            let output = folder.run(&format!("convert v.{from} w.{to} --type f64 --quiet"));
            must_succeed(&output);
            for (name, bytes) in &before {
                let now = fs::read(folder.path().join(name)).unwrap();
                assert!(now == *bytes, "{name} after {from} to {to}");
            }
        }
    }
    for from in ENDINGS {
        assert!(voxels(&folder, &format!("v.{from}")).unwrap() == first, "{from} at last");
    }
}

#[test]
fn no_output_takes_the_place_of_an_input() {
    let folder = with_all_formats();
    fs::write(folder.path().join("colours.txt"), "0 1 1 1 0\n25 1 0 0 1\n").unwrap();
    let scene = "[volume]\npath = \"v.mhd\"\n[volume.transfer]\nfile = \"colours.txt\"\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let all: Vec<String> = folder.names();
    let voxels_of = |header: &str| {
        let name = all.iter().find(|name| name.starts_with(&format!("{header}.")));
        name.unwrap_or_else(|| panic!("{header}")).clone()
    };
    // Names that lead to an input: itself, a symbolic link, a hard link.
    let aims = [
        ("v.raw", "v.raw"),
        ("v.raw", "v.raw.toml"),
        ("v.npy", "v.npy.toml"),
        ("v.mhd", &voxels_of("v.mhd")),
        ("v.nhdr", &voxels_of("v.nhdr")),
        ("v.nrrd", "v.nrrd"),
        ("v.vdb", "v.vdb"),
        ("scene.toml", &voxels_of("v.mhd")),
        ("scene.toml", "v.mhd"),
        ("scene.toml", "colours.txt"),
        ("scene.toml", "scene.toml"),
    ];
    let before = contents(folder.path());
    for (input, aim) in aims {
        for ending in ["raw", "npy", "vdb", "mhd", "nhdr", "nrrd", "png", "exr", "deep.exr"] {
            let name = format!("aim.{ending}");
            let output = folder.path().join(&name);
            for hard in [false, true] {
                let aim = folder.path().join(aim);
                if hard { fs::hard_link(aim, &output) } else { symlink(aim, &output) }.unwrap();
                let small = "--backend cpu --size 8x8 --map-size 8 --quiet";
                let run = match (ending, input.ends_with("toml")) {
                    ("exr", _) => format!("map {input} --backend cpu --map-size 8 -o {name}"),
                    ("png" | "deep.exr", _) => format!("render {input} {small} -o {name}"),
                    (_, false) => format!("convert {input} {name} --type u8"),
                    // A scene file is not a volume that can be converted.
                    (_, true) => String::new(),
                };
                if !run.is_empty() {
                    let result = folder.run(&run);
                    assert_eq!(result.status.code(), Some(1), "{run}: {}", stderr(&result));
                    assert!(stderr(&result).contains("which is an input"), "{}", stderr(&result));
                }
                let _ = fs::remove_file(&output);
            }
        }
        assert!(contents(folder.path()) == before, "{input}, {aim}");
    }
    // Under their own names, and beside the voxels of a header.
    for (run, code) in [
        ("convert v.vdb v.vdb --compression none".to_owned(), 1),
        ("convert v.raw v.raw --type u8".to_owned(), 1),
        (format!("convert v.mhd {} --type u8", voxels_of("v.mhd")), 1),
        ("convert v.mhd v.mhd --crop 55,55,55,60,60,60".to_owned(), 1),
    ] {
        assert_eq!(folder.run(&run).status.code(), Some(code), "{run}");
        assert!(contents(folder.path()) == before, "{run}");
    }
}

/// Names as other programs and earlier versions use them: `x.raw` beside `x.mhd`, `x.toml` beside
/// `x.raw`.
#[test]
fn files_named_as_before_are_read_and_spared() {
    let folder = Folder::new();
    let voxels: Vec<u8> = (0..24).collect();
    fs::write(folder.path().join("x.raw"), &voxels).unwrap();
    let header = "NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = x.raw\n";
    fs::write(folder.path().join("x.mhd"), header).unwrap();
    fs::write(folder.path().join("x.toml"), "dims = [4, 3, 2]\ntype = \"u8\"\n").unwrap();
    let before = contents(folder.path());
    for run in
        ["x.mhd x.nhdr --crop 0,0,0,1,1,1", "x.raw x.npy --type f32", "x.npy x.mha --type u16"]
    {
        must_succeed(&folder.run(&format!("convert {run}")));
    }
    assert_eq!(folder.run("convert x.mhd x.raw --type f32").status.code(), Some(1));
    for (name, bytes) in &before {
        assert!(fs::read(folder.path().join(name)).unwrap() == *bytes, "{name}");
    }
    assert_eq!(self::voxels(&folder, "x.raw").unwrap(), voxels);
    // The sidecar may belong to either of two files, neither of which describes its own contents.
    fs::write(folder.path().join("x.bin"), &voxels).unwrap();
    let why = self::voxels(&folder, "x.raw").unwrap_err();
    assert!(why.contains("x.toml") && why.contains("x.raw.toml"), "{why}");
}

#[test]
fn a_sidecar_of_other_voxels_is_refused() {
    let folder = Folder::new();
    fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("v.vdb")).unwrap();
    for name in ["a.raw", "a.npy"] {
        must_succeed(&folder.run(&format!("convert v.vdb {name} --quiet")));
        let path = folder.path().join(name);
        let mut bytes = fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&path, bytes).unwrap();
        let why = voxels(&folder, name).unwrap_err();
        assert!(why.contains("do not belong together"), "{why}");
        let output = folder.run(&format!("render {name} --backend cpu --size 8x8 --map-size 8"));
        assert_eq!(output.status.code(), Some(1));
    }
    // An array of another shape beside the sidecar.
    must_succeed(&folder.run("convert v.vdb b.npy --crop 56,56,56,60,60,60 --quiet"));
    fs::copy(folder.path().join("b.npy"), folder.path().join("a.npy")).unwrap();
    let why = voxels(&folder, "a.npy").unwrap_err();
    assert!(why.contains("describes different voxels"), "{why}");
}
