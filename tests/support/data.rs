//! Files that are no part of the repository, in the folder that `DEEPSHADOW_DATA` names: volumes
//! and images in its `data/`, OpenVDB files with what the real library says of them in its `vdb/`.
//!
//! Tests that need them are ignored unless asked for, and each names a twin that needs none; see
//! `tests/formats/fixture_list.rs`. Nothing here is lenient: what is missing fails.

use std::path::PathBuf;

/// The file or folder `name` in the folder `DEEPSHADOW_DATA`.
pub fn outside(name: &str) -> PathBuf {
    let folder = std::env::var_os("DEEPSHADOW_DATA").expect("DEEPSHADOW_DATA names no folder");
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} is not there", path.display());
    path
}

/// The `.vdb` files of the folder `name` in the folder `DEEPSHADOW_DATA`, in order.
pub fn outside_grids(name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(outside(name)).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "vdb"));
    paths.sort();
    assert!(!paths.is_empty(), "no OpenVDB files in {name}");
    paths
}
