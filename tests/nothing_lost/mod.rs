//! Tests of outputs and the files around them: no input ever changes, no file of another output
//! changes, and however a run ends, it leaves either old or new files, complete and matching.

mod ended;
mod inputs;
mod places;

use std::fs;
use std::path::Path;

use super::cli::{Folder, must_succeed, stderr};
use super::formats::vdb_fixture;

/// The endings of all formats that `convert` writes.
const ENDINGS: [&str; 7] = ["vdb", "npy", "raw", "nrrd", "nhdr", "mha", "mhd"];

type Contents = Vec<(String, Vec<u8>)>;

/// The names and contents of all files.
fn contents(folder: &Path) -> Contents {
    let mut all: Contents = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| {
            let bytes = fs::read(entry.path()).unwrap_or_default();
            (entry.file_name().to_string_lossy().into_owned(), bytes)
        })
        .collect();
    all.sort();
    all
}

/// A folder with the same volume as `v` in every format.
fn with_all_formats() -> Folder {
    let folder = Folder::new();
    fs::copy(vdb_fixture("ball_blosc.vdb"), folder.path().join("v.vdb")).unwrap();
    for ending in &ENDINGS[1..] {
        must_succeed(&folder.run(&format!("convert v.vdb v.{ending} --quiet")));
    }
    folder
}

/// The voxels of `name`, converted to the bytes of an array.
fn voxels(folder: &Folder, name: &str) -> Result<Vec<u8>, String> {
    let outside = Folder::new();
    let to = outside.path().join("x.raw");
    let output = folder.run(&format!("convert {name} {} --quiet", to.display()));
    if output.status.success() { Ok(fs::read(to).unwrap()) } else { Err(stderr(&output)) }
}
