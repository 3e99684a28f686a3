//! Tests that the programs in `examples/` do what they claim.

use std::path::Path;

use crate::support::project;

#[path = "../examples/array.rs"]
mod array;
#[path = "../examples/map_error.rs"]
mod map_error;
#[path = "../examples/picture.rs"]
mod picture;
#[cfg(feature = "gpu")]
#[path = "../examples/wgpu_program.rs"]
mod wgpu_program;

/// Width and height in a PNG's header.
fn size(path: &Path) -> [u32; 2] {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[1..4], b"PNG");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

#[test]
fn an_array_becomes_a_picture_and_shadows() {
    let folder = tempfile::tempdir().unwrap();
    let light = array::example(folder.path()).unwrap();
    assert_eq!(size(&folder.path().join("puff.png")), [160, 120]);
    assert_eq!(light.len(), 5);
    assert!(light[0] > 0.9, "in front nothing is in the way: {light:?}");
    assert!(light.windows(2).all(|pair| pair[1] <= pair[0] + 1e-3), "{light:?}");
    assert!(light[4] < 0.3, "behind there is shadow: {light:?}");
}

#[test]
fn a_file_becomes_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let input = project().join("tests/fixtures/vdb").read_dir().unwrap();
    let mut files: Vec<_> = input.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let readable = files.iter().find_map(|file| picture::example(Some(file), folder.path()).ok());
    assert_eq!(size(&readable.expect("one of the fixtures is a picture")), [320, 240]);
    assert!(picture::example(None, folder.path()).unwrap().ends_with("bucky.png"));
}

#[test]
fn errors_of_maps_fall_with_what_they_keep() {
    let found = map_error::example().unwrap();
    let rms: Vec<f64> = found.iter().map(|(_, _, rms)| *rms).collect();
    assert!(rms[1] < 0.5 * rms[0] && rms.iter().all(|rms| *rms < 0.05), "{found:?}");
}

#[cfg(feature = "gpu")]
#[test]
fn another_wgpu_program_has_our_shadows() {
    if crate::support::backends::gpu().is_none() {
        return;
    }
    let light = wgpu_program::example().unwrap();
    assert!(light[0] > 0.99 && light[light.len() - 1] < 0.5, "{light:?}");
}
