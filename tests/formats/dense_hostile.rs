//! Whatever the bytes of a dense file are: an answer or an error, soon, and in little memory.

use std::path::Path;
use std::time::{Duration, Instant};

use deepshadow::io::Format;
use deepshadow::io::ReadOptions;
use deepshadow::io::dense::DenseFile;

use super::dense_by_others::FACTS;
use super::dense_fixtures::cases;
use super::nanovdb_fixtures::{BUMPS, bytes_of};
use super::vdb_hostile::{Random, mutate, rounds};

/// Longest time that a file may take, in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens the file as what it seems to be and as `format`; whether its voxels could be read.
fn exercise(path: &Path, format: Format, what: &str) -> bool {
    let start = Instant::now();
    let table = ReadOptions::default().with(|options| options.max_bytes = 1 << 26);
    let mut read = false;
    for format in Format::of_file(path).into_iter().chain([format]) {
        let Ok(file) = DenseFile::open(path, format, &table) else { continue };
        let Ok(voxels) = file.voxels() else { continue };
        let dims = file.header().dims;
        assert_eq!(voxels.density().unwrap().len(), dims.iter().product::<usize>(), "{what}");
        let mut count = 0;
        voxels.for_each(|_, _| count += 1);
        assert_eq!(count, dims.iter().product::<usize>() * file.header().components, "{what}");
        let _ = file.volume(None, None);
        read = true;
    }
    assert!(start.elapsed() < PATIENCE, "{what} took {:?}", start.elapsed());
    read
}

#[test]
fn mutated_dense_files_give_an_answer_or_an_error() {
    let rounds = rounds(300);
    for (number, case) in cases().into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        let path = case.write(&folder);
        let format = Format::of_file(&path).unwrap();
        assert!(exercise(&path, format, case.name));
        let mut read = 0;
        for round in 0..rounds {
            let mut random = Random(7 + (number * rounds + round) as u64 * 0x9e37_79b9);
            // Mostly the first file, whose header the others depend on.
            let at = if round % 4 == 0 { case.files.len() - 1 } else { 0 };
            let (name, whole) = &case.files[at];
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut random);
            std::fs::write(folder.path().join(name), bytes).unwrap();
            read += usize::from(exercise(&path, format, &format!("{}, round {round}", case.name)));
            std::fs::write(folder.path().join(name), whole).unwrap();
        }
        eprintln!("{}: read {read} of {rounds}", case.name);
    }
}

/// A header may name any file of the machine that reads it.
#[cfg(unix)]
#[test]
fn voxels_in_a_device_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in ["raw", "ascii", "gzip"] {
        let path = folder.path().join("v.nhdr");
        let text = format!(
            "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: {encoding}\n\
             data file: /dev/zero\n"
        );
        std::fs::write(&path, text).unwrap();
        let file = DenseFile::open(&path, Format::Nrrd, &ReadOptions::default()).unwrap();
        let error = file.voxels().err().unwrap().to_string();
        assert!(error.contains("not in a file"), "{error}");
    }
}

/// Mutates the file `name` so many times.
fn mutate_file(name: &str, whole: &[u8], rounds: usize) {
    let folder = tempfile::tempdir().unwrap();
    let mutated = folder.path().join(Path::new(name).file_name().unwrap());
    std::fs::write(&mutated, whole).unwrap();
    let format = Format::of_file(&mutated).unwrap();
    for round in 0..rounds {
        let mut random = Random(11 + round as u64 * 0x9e37_79b9);
        let mut bytes = whole.to_vec();
        mutate(&mut bytes, &mut random);
        std::fs::write(&mutated, bytes).unwrap();
        exercise(&mutated, format, &format!("{name}, round {round}"));
    }
}

#[test]
fn mutated_fixtures_of_other_programs_give_an_answer_or_an_error() {
    for fact in FACTS {
        mutate_file(fact.file, &std::fs::read(fact.path()).unwrap(), rounds(30));
    }
    for (name, _) in BUMPS {
        mutate_file(name, &bytes_of(name), rounds(30));
    }
}

mod outside {
    use super::*;
    use crate::support::data::outside;

    /// Twin: `mutated_fixtures_of_other_programs_give_an_answer_or_an_error`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn mutated_real_dense_files_give_an_answer_or_an_error() {
        for name in [
            "den/head-scaleddown4.den",
            "mhd/Bucky.mhd",
            "mitsuba_vol/torus_sdfgrid.vol",
            "nifti/little.nii.gz",
            "nvdb/fvdb_smoke-blosc.nvdb",
            "nrrd/xtk_smallvolume.nrrd",
            "pvm/Bucky.pvm",
            "vti/voreen_flow_A_0020000.vti",
        ] {
            let path = outside("data").join(name);
            mutate_file(name, &std::fs::read(path).unwrap(), rounds(30));
        }
    }
}
