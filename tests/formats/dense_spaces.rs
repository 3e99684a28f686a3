//! Where voxels lie in a patient's space, LPS: closed forms of what ITK makes of the same headers.

use deepshadow::io::ReadOptions;
use deepshadow::io::dense::{DenseFile, DenseGrid, DenseTarget, Space};
use deepshadow::io::{Format, Inputs};
use glam::{DMat4, DVec3};
use tempfile::TempDir;

use super::dense_fixtures::nifti;

/// Columns (steps) of an oblique, stretched frame whose third axis may be mirrored.
fn steps(mirrored: bool) -> [DVec3; 3] {
    let third = if mirrored { -4.0 } else { 4.0 };
    [DVec3::new(1.6, 1.2, 0.0), DVec3::new(-1.8, 2.4, 0.0), DVec3::new(0.0, 0.0, third)]
}

const ORIGIN: DVec3 = DVec3::new(10.0, 20.0, 30.0);

fn matrix(steps: [DVec3; 3], origin: DVec3) -> DMat4 {
    let [x, y, z] = steps.map(|step| step.extend(0.0));
    DMat4::from_cols(x, y, z, origin.extend(1.0))
}

fn nrrd(space: &str, steps: [DVec3; 3], voxels: &[u8]) -> Vec<u8> {
    let bracket = |v: DVec3| format!("({},{},{})", v.x, v.y, v.z);
    let [x, y, z] = steps.map(bracket);
    let head = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\n{space}\nsizes: 3 2 2\nspace directions: {x} {y} {z}\n\
         space origin: {}\nencoding: raw\n\n",
        bracket(ORIGIN)
    );
    [head.as_bytes(), voxels].concat()
}

/// A NIfTI file with codes of qform and sform and the rotation by `atan(3/4)` about z in both.
fn nifti_of(codes: [f64; 2], mirrored: bool, shift: f64) -> Vec<u8> {
    let [x, y, z] = steps(mirrored);
    let rows = [0, 1, 2].map(|row| [x[row], y[row], z[row], ORIGIN[row] + shift]);
    // A quaternion (0, 0, sin, w) of the angle whose cosine is .8.
    let half = f64::sqrt(0.1);
    let mut fields = vec![
        (252, codes[0]),
        (254, codes[1]),
        (76, if mirrored { -1.0 } else { 1.0 }),
        (80, 2.0),
        (84, 3.0),
        (88, 4.0),
        (264, half),
        (268, 10.0),
        (272, 20.0),
        (276, 30.0),
    ];
    for (row, at) in rows.into_iter().zip([280, 296, 312]) {
        fields.extend((0..4).map(|column| (at + 4 * column, row[column])));
    }
    let fields: Vec<(usize, f32)> = fields.into_iter().map(|(at, x)| (at, x as f32)).collect();
    [nifti(2, false, *b"n+1\0", &fields), (0..12).collect()].concat()
}

fn read(name: &str, bytes: &[u8]) -> DenseGrid {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    opened(&path)
}

fn opened(path: &std::path::Path) -> DenseGrid {
    let format = Format::of_file(path).unwrap();
    DenseGrid::read(&DenseFile::open(path, format, &ReadOptions::default()).unwrap()).unwrap()
}

fn assert_close(found: DMat4, expected: DMat4, what: &str) {
    let off = (found - expected).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(off <= 1e-5, "{what}: {found} instead of {expected}");
    assert_eq!(found.determinant() > 0.0, expected.determinant() > 0.0, "{what}");
}

/// Writes the grid as `name` and reads it.
fn through(grid: &DenseGrid, name: &str) -> (DenseGrid, Vec<String>, String) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    let target = DenseTarget::of_path(&path).unwrap();
    let output = target.promise(&path, false, &Inputs::default()).unwrap();
    let written = output.write(grid.clone()).unwrap();
    let head = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    (opened(&path), written.lost, head)
}

const VOXELS: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

#[test]
fn every_patients_space_becomes_lps_as_itk_reads_it() {
    for mirrored in [false, true] {
        let own = matrix(steps(mirrored), ORIGIN);
        for (space, signs) in [
            ("space: left-posterior-superior", [1.0, 1.0, 1.0]),
            ("space: LPS", [1.0, 1.0, 1.0]),
            ("space: RAS", [-1.0, -1.0, 1.0]),
            ("space: right-anterior-superior", [-1.0, -1.0, 1.0]),
            ("space: ras", [-1.0, -1.0, 1.0]),
            ("space: LAS", [1.0, -1.0, 1.0]),
            ("space: left-anterior-superior-time", [1.0, -1.0, 1.0]),
            ("space: LPST", [1.0, 1.0, 1.0]),
        ] {
            let grid = read("v.nrrd", &nrrd(space, steps(mirrored), &VOXELS));
            let lps = DMat4::from_scale(DVec3::from(signs)) * own;
            assert_eq!(grid.space, Some(Space::Lps), "{space}");
            assert_close(grid.world_from_voxel(), lps, space);
        }
        // What is nobody's patient keeps its numbers, and its name.
        for (space, named) in [
            ("space dimension: 3", None),
            ("space: scanner-xyz", Some(Space::ScannerXyz)),
            ("space: 3D-left-handed", Some(Space::LeftHanded)),
        ] {
            let grid = read("v.nrrd", &nrrd(space, steps(mirrored), &VOXELS));
            assert_eq!(grid.space, named);
            assert_close(grid.world_from_voxel(), own, space);
        }
        // NIfTI is RAS.
        let lps = DMat4::from_scale(DVec3::new(-1.0, -1.0, 1.0)) * own;
        for codes in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 2.0]] {
            let grid = read("v.nii", &nifti_of(codes, mirrored, 0.0));
            assert_eq!(grid.space, Some(Space::Lps));
            assert_close(grid.world_from_voxel(), lps, &format!("nifti {codes:?}"));
        }
    }
}

/// The order of ITK: an sform of the scanner, else the qform where the two differ.
#[test]
fn of_two_places_in_a_nifti_file_the_one_that_itk_takes_counts() {
    let flip = DVec3::new(-1.0, -1.0, 1.0);
    for (codes, taken, said) in
        [([2.0, 1.0], 5.0, true), ([1.0, 2.0], 0.0, true), ([1.0, 4.0], 0.0, true)]
    {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("v.nii");
        std::fs::write(&path, nifti_of(codes, false, 5.0)).unwrap();
        let file = DenseFile::open(&path, Format::Nifti, &ReadOptions::default()).unwrap();
        let place = file.header().world_from_index.w_axis.truncate();
        assert!((place - flip * (ORIGIN + taken)).length() < 1e-5, "{codes:?}: {place}");
        assert_eq!(file.header().notes.len(), usize::from(said), "{:?}", file.header().notes);
    }
    // A matrix of zeros, which some programs write, says nothing.
    let mut zeros = nifti_of([1.0, 1.0], false, 0.0);
    zeros[280..328].fill(0);
    let expected = DMat4::from_scale(flip) * matrix(steps(false), ORIGIN);
    assert_close(read("v.nii", &zeros).world_from_voxel(), expected, "zeros");
    // Neither: sizes, and no patient.
    let grid = read("v.nii", &nifti_of([0.0, 0.0], false, 0.0));
    assert_eq!(grid.space, None);
    assert_close(grid.world_from_voxel(), DMat4::from_scale(DVec3::new(2.0, 3.0, 4.0)), "sizes");
}

#[test]
fn conversions_keep_the_space_and_every_place() {
    for mirrored in [false, true] {
        for grid in [
            read("v.nii", &nifti_of([1.0, 1.0], mirrored, 0.0)),
            read("v.nrrd", &nrrd("space: LAS", steps(mirrored), &VOXELS)),
        ] {
            for name in ["v.nrrd", "v.nhdr", "v.mha", "v.mhd", "v.npy", "v.raw"] {
                let (found, _, head) = through(&grid, name);
                assert_eq!(found.space, Some(Space::Lps), "{name}");
                assert_close(found.world_from_voxel(), grid.world_from_voxel(), name);
                assert!(!head.contains("space_") && !head.contains(":=left"), "{head}");
            }
            let (_, _, head) = through(&grid, "v.nrrd");
            assert!(head.contains("\nspace: left-posterior-superior\n"), "{head}");
        }
    }
    // Letters of where each axis comes from: voxels' x runs to the left and a little to the back.
    for (mirrored, letters) in [(false, "RAI"), (true, "RAS")] {
        let grid = read("v.nrrd", &nrrd("space: LPS", steps(mirrored), &VOXELS));
        let (_, _, head) = through(&grid, "v.mha");
        assert!(head.contains(&format!("\nAnatomicalOrientation = {letters}\n")), "{head}");
    }
    let lying = [DVec3::new(0.0, 0.0, -2.0), DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, -1.0, 0.0)];
    let (_, _, head) = through(&read("v.nrrd", &nrrd("space: LPS", lying, &VOXELS)), "v.mha");
    assert!(head.contains("\nAnatomicalOrientation = SRP\n"), "{head}");
    // A file without a patient is given none; what MetaImage cannot hold is said with what follows.
    let bare = read("v.nrrd", &nrrd("space dimension: 3", steps(false), &VOXELS));
    let (found, _, head) = through(&bare, "v.mha");
    assert!(found.space.is_none() && !head.contains("Anatomical"), "{head}");
    let (found, _, head) = through(&bare, "v.nrrd");
    assert!(found.space.is_none() && head.contains("space dimension: 3"), "{head}");
    let scanner = read("v.nrrd", &nrrd("space: scanner-xyz", steps(false), &VOXELS));
    let (_, lost, _) = through(&scanner, "v.mha");
    assert!(lost.iter().any(|one| one.contains("scanner-xyz") && one.contains("LPS")), "{lost:?}");
}

#[test]
fn right_angles_of_single_precision_are_right_angles() {
    let turned = [DVec3::new(0.600_000_1, 0.8, 1e-7), DVec3::new(-0.799_999_9, 0.6, 0.0), DVec3::Z];
    let (_, lost, _) = through(&read("v.nrrd", &nrrd("space: LPS", turned, &VOXELS)), "v.mha");
    assert_eq!(lost, Vec::<String>::new());
}
