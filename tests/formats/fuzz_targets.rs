//! The fuzz targets: there is one a reader, and they read valid files.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::deep_exr::{COMPRESSIONS, small_image};
use super::dense_fixtures::cases;
use super::nanovdb_fixtures::{BUMPS, bytes_of};
use super::surface_fixtures;
use super::vdb_hostile::{Random, fixtures, mutate};
use crate::readers::{READERS, read};
use crate::support::project;

/// Valid files by target.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let mut seeds = Vec::new();
    for case in cases() {
        let (_, bytes) = &case.files[0];
        let target = case.name.split('_').next().unwrap();
        let target = READERS.iter().map(|(name, _)| *name).find(|name| *name == target);
        let target = target.unwrap_or_else(|| panic!("no target for {}", case.name));
        if target == "raw" {
            let sidecar = case.files.iter().find(|(name, _)| name == "v.toml");
            let sidecar = sidecar.map_or(&[][..], |(_, text)| text);
            seeds.push((target, [sidecar, &[0], bytes].concat()));
        } else {
            seeds.push((target, bytes.clone()));
        }
    }
    seeds.extend(fixtures().iter().map(|path| ("vdb", std::fs::read(path).unwrap())));
    seeds.extend(BUMPS.map(|(name, _)| ("nanovdb", bytes_of(name))));
    let images = COMPRESSIONS.map(|compression| small_image(compression).encode().unwrap());
    seeds.extend(images.map(|bytes| ("deep_exr", bytes)));
    seeds.extend(surface_fixtures::seeds().into_iter().map(|(target, _, bytes)| match target {
        "obj" => (target, [surface_fixtures::MTL, &[0], &bytes].concat()),
        _ => (target, bytes),
    }));
    let scene = "[volume]\npath = \"a.vdb\"\ndims = [1, 2, 3]\nwindow = [0.0, 1.5]\n[light]\n\
                 kind = \"spot\"\nposition = [0, 1, 2]\n[image]\nwidth = 7\n[ground]\nenabled = true\n";
    seeds.push(("scene", scene.into()));
    seeds
}

#[test]
fn every_fuzz_target_has_its_file_and_reads_its_seeds() {
    let folder = project().join("tests/fuzz");
    let names: BTreeSet<String> = READERS.iter().map(|(name, _)| (*name).to_owned()).collect();
    let files = std::fs::read_dir(folder.join("fuzz_targets")).unwrap();
    let files: BTreeSet<String> = files
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    assert_eq!(files, names);
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    for name in &names {
        assert!(manifest.contains(&format!("name = \"{name}\"\n")), "{name}");
        let target = folder.join(format!("fuzz_targets/{name}.rs"));
        let target = std::fs::read_to_string(target).unwrap();
        assert!(target.contains(&format!("read(\"{name}\", bytes)")), "{name}");
    }
    let mut random = Random(23);
    for (target, bytes) in seeds() {
        read(target, &bytes);
        // Enough to see that targets bear it; other tests mutate at length.
        for _ in 0..20 {
            let mut bytes = bytes.clone();
            mutate(&mut bytes, &mut random);
            read(target, &bytes);
        }
    }
}

/// Fills the folder `DEEPSHADOW_SEEDS` with a folder of valid files a target.
#[test]
#[ignore = "writes files for the fuzzer"]
fn write_fuzz_seeds() {
    let folder = PathBuf::from(std::env::var("DEEPSHADOW_SEEDS").unwrap());
    for (number, (target, bytes)) in seeds().into_iter().enumerate() {
        std::fs::create_dir_all(folder.join(target)).unwrap();
        std::fs::write(folder.join(target).join(format!("seed-{number}")), bytes).unwrap();
    }
}
