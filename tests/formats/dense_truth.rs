//! Dense formats: exact values and places from files made by hand, and known facts of real ones
//! in the folder of outside data.

use std::path::Path;

use deepshadow::io::ReadOptions;
use deepshadow::io::dense::DenseFile;
use deepshadow::io::{Format, load_volume};
use deepshadow::scene::file::VolumeTable;
use deepshadow::{ErrorKind, Result};
use glam::{DMat4, DVec3};

use super::dense_fixtures::{Case, cases, dds, gzip, nifti, npy, vti};

/// Opens a file as what it begins with.
pub fn open(path: &Path) -> Result<DenseFile> {
    DenseFile::open(path, Format::of_file(path)?, &ReadOptions::default())
}

fn case(name: &str) -> Case {
    cases().into_iter().find(|case| case.name == name).unwrap()
}

fn open_case(case: &Case) -> Result<DenseFile> {
    open(&case.write(&tempfile::tempdir().unwrap()))
}

fn assert_close(found: DMat4, expected: DMat4, what: &str) {
    let off = (found - expected).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(off <= 1e-6, "{what}: {found} instead of {expected}");
}

#[test]
fn every_format_gives_its_values_and_its_place() {
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        let path = case.write(&folder);
        let file = open(&path).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let prefix = case.name.split('_').next().unwrap();
        assert!(file.format().name().starts_with(prefix), "{}: {:?}", case.name, file.format());
        assert_eq!(file.header().dims, [3, 2, 2], "{}", case.name);
        assert_close(file.header().world_from_index, case.world_from_index, case.name);
        let density = file.voxels().unwrap_or_else(|error| panic!("{error}")).density().unwrap();
        assert_eq!(density.dim(), (2, 2, 3), "{}", case.name);
        let expected: Vec<f32> = (0..12_u8).map(f32::from).collect();
        assert_eq!(density.iter().copied().collect::<Vec<_>>(), expected, "{}", case.name);
        let mut sum = 0.0;
        file.voxels().unwrap().for_each(|value, _| sum += value);
        assert_eq!(sum, 66.0, "{}", case.name);
    }
}

/// What `load_volume` makes of the first case of `name` with the options of `table`.
fn loaded(name: &str, table: &VolumeTable) -> DMat4 {
    let folder = tempfile::tempdir().unwrap();
    let path = case(name).write(&folder);
    let table = VolumeTable { path: Some(path), ..table.clone() };
    *load_volume(&table).unwrap().world_from_index()
}

#[test]
fn nrrd_space_directions_become_the_transform() {
    let world = loaded("nrrd_raw", &VolumeTable::default());
    let point = world.transform_point3(DVec3::new(2.0, 1.0, 1.0));
    assert_eq!(point, DVec3::new(7.0 - 3.0, 8.0 + 4.0, 9.5 + 0.5));
}

#[test]
fn spacing_replaces_lengths_and_keeps_axes_and_origin() {
    let table = VolumeTable { spacing: Some([5.0, 6.0, 7.0]), ..VolumeTable::default() };
    let world = loaded("metaimage_local", &table);
    let point = world.transform_point3(DVec3::ONE);
    assert_eq!(point, DVec3::new(1.0 - 6.0, -1.0 + 5.0, 0.5 + 7.0));
}

#[test]
fn up_turns_the_files_world() {
    let table = VolumeTable { up: Some("z".to_owned()), ..VolumeTable::default() };
    let world = loaded("nifti_sform", &table);
    // The file's z is 7 at the first voxel and now points up; its y, 6 to the front of the patient
    // and so -6 in LPS, points away from the viewer.
    assert_eq!(world.transform_point3(DVec3::ZERO), DVec3::new(-5.0, 7.0, 6.0));
}

#[test]
fn from_overrules_what_a_file_begins_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = case("nrrd_raw").write(&folder);
    let table = |from: &str| VolumeTable {
        path: Some(path.clone()),
        from: Some(from.to_owned()),
        ..VolumeTable::default()
    };
    assert!(load_volume(&table("nrrd")).is_ok());
    for (from, word) in [("npy", "NumPy"), ("raw", "`volume.dims`"), ("nrd", "'nrd' is not one of")]
    {
        let error = load_volume(&table(from)).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn nifti_slope_and_intercept_make_the_values() {
    let head = nifti(2, false, *b"n+1\0", &[(112, 0.5), (116, -3.0)]);
    let case = Case {
        name: "nifti",
        files: vec![("v.nii".to_owned(), [head, (0..12).collect()].concat())],
        world_from_index: DMat4::IDENTITY,
    };
    let folder = tempfile::tempdir().unwrap();
    let density = open(&case.write(&folder)).unwrap().voxels().unwrap().density().unwrap();
    assert_eq!(density[[0, 0, 1]], -2.5);
    assert_eq!(density[[1, 1, 2]], 2.5);
}

/// The library's own writer leaves out zeros of the end marker that would begin a byte.
#[test]
fn a_pvm_stream_without_the_end_of_its_end_marker_is_whole() {
    let pvm = [b"PVM\n3 2 2\n1\n", &(0..12).collect::<Vec<u8>>()[..]].concat();
    let whole = dds(&pvm, 'd', 1, 1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.pvm");
    let read = |cut: usize| {
        std::fs::write(&path, &whole[..whole.len() - cut]).unwrap();
        open(&path).and_then(|file| file.voxels()).map(|voxels| voxels.bytes().to_vec())
    };
    for cut in [0, 1] {
        assert_eq!(read(cut).unwrap(), (0..12).collect::<Vec<u8>>(), "{cut} bytes cut");
    }
    assert!(read(2).is_err());
}

#[test]
fn vectors_and_colours_become_their_length() {
    let head = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 1 1 2\nkinds: vector domain domain \
         domain\nencoding: raw\n\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nrrd");
    std::fs::write(&path, [head.as_bytes(), &[3, 4, 6, 8]].concat()).unwrap();
    let density = open(&path).unwrap().voxels().unwrap().density().unwrap();
    assert_eq!(density.iter().copied().collect::<Vec<_>>(), [5.0, 10.0]);
}

#[test]
fn what_is_wrong_is_said_in_one_line_with_the_number() {
    let dims = |shape: &str| {
        npy(1, &format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape})}}"), &[0; 9])
    };
    let nrrd = |lines: &str| format!("NRRD0004\n{lines}\n\n").into_bytes();
    let cell = "<DataArray type=\"Int8\" Name=\"d\" format=\"ascii\">1 2 x</DataArray>";
    let few = "<DataArray type=\"Int8\" Name=\"d\" format=\"ascii\">1 2 3</DataArray>";
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("v.npy", dims("1, 1, 2"), "9 bytes of voxels, expected 16"),
        ("v.npy", dims("2, 2"), "2 axes"),
        ("v.npy", dims("0, 2, 2"), "dims 2,2,0"),
        ("v.npy", dims("-1, 2, 2"), "dims 2,2,-1"),
        ("v.npy", dims("1, 1, 9999999"), "9999999"),
        ("v.npy", npy(9, "", &[]), "version 9"),
        ("v.npy", npy(1, "{'descr': '<c8', 'fortran_order': False, 'shape': (1,1,1)}", &[]), "c8"),
        ("v.npy", npy(1, "{'descr': [('a', '<f4')], 'shape': (1,1,1)}", &[]), "structures"),
        ("v.nrrd", nrrd("type: float\ndimension: 3\nsizes: 3 2"), "2 sizes for 3 axes"),
        ("v.nrrd", nrrd("type: block\ndimension: 3\nsizes: 3 2 1"), "'block'"),
        ("v.nrrd", nrrd("type: int\ndimension: 3\nsizes: 1 1 1\nencoding: bzip2"), "'bzip2'"),
        ("v.nrrd", nrrd("type: int\ndimension: 3\nsizes: 1 1 1\nspacings: 0 1 1"), "no inverse"),
        ("v.nrrd", nrrd("type: int\ndimension: 3\nsizes: 1 1 1\nencoding: gzip"), "unpacked"),
        ("v.pvm", b"PVM\n2 2 2\n4\n".to_vec(), "4 bytes per voxel"),
        ("v.pvm", b"DDS v3d\nx".to_vec(), "ends early"),
        ("v.nii", nifti(1792, false, *b"n+1\0", &[]), "number type 1792"),
        ("v.nii", nifti(2, false, *b"n+1\0", &[(108, -5.0)]), "byte -5"),
        ("v.gz", gzip(b"something"), "a gzip file"),
        ("v.vti", vti("", cell, b""), "'x' is not a valid i8"),
        ("v.vti", vti("", few, b""), "3 numbers, expected 12"),
        ("v.vti", vti("compressor=\"vtkLZMADataCompressor\"", few, b""), "vtkLZMA"),
        ("v.mhd", b"NDims = 3\nDimSize = 2 2 2\n".to_vec(), "ElementDataFile"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, word) in cases {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = open(&path).and_then(|file| file.voxels()).err();
        let text = error.unwrap_or_else(|| panic!("{word}: no error")).to_string();
        assert!(text.contains(word) && !text.contains('\n'), "'{word}' is not in: {text}");
        assert!(text.contains(name), "{text}");
    }
}

#[test]
fn a_voxel_count_beyond_the_limit_is_refused_before_memory_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in ["raw", "gzip", "ascii"] {
        let path = folder.path().join("v.nrrd");
        let n = 1 << 20;
        let head = "NRRD0004\ntype: double\ndimension: 3\n";
        let text = format!("{head}sizes: {n} {n} {n}\nencoding: {encoding}\n\n");
        std::fs::write(&path, text).unwrap();
        let error = open(&path).unwrap().voxels().err().unwrap();
        assert!(matches!(error.kind(), ErrorKind::Limit { .. }), "{error}");
        assert!(error.to_string().contains("13835058055282163712 bytes"), "{error}");
    }
}

#[test]
fn a_cut_file_is_an_error() {
    for case in cases() {
        let mut case = case;
        let whole = case.files[0].1.clone();
        for length in [0, whole.len() / 3, whole.len() / 2] {
            case.files[0].1.truncate(length);
            let read = open_case(&case).and_then(|file| file.voxels().map(|_| ()));
            assert!(read.is_err(), "{} cut to {length} bytes", case.name);
            case.files[0].1.clone_from(&whole);
        }
    }
}

mod outside {
    use super::*;
    use crate::support::data::outside;

    /// Sums and samples as other readers give them: pynrrd, nibabel, SimpleITK, VTK, NumPy.
    ///
    /// Twin: `files_of_other_programs_hold_their_formulas_at_every_voxel`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    #[allow(clippy::unreadable_literal, clippy::excessive_precision)] // As the readers print them.
    fn real_files_hold_what_other_readers_find_in_them() {
        // Name, voxels along x, y, z, sum of all values, an index (x, y, z) and the value there.
        type Fact = (&'static str, [usize; 3], f64, [usize; 3], f32);
        let facts: &[Fact] = &[
            (
                "nrrd/xtk_smallvolume.nrrd",
                [27, 27, 27],
                7156683.851019859,
                [13, 13, 13],
                118.31072998046875,
            ),
            ("raw/nucleon.nrrd", [41, 41, 41], 2715326.0, [20, 20, 20], 8.0),
            ("nifti/avg152T1_LR_nifti.nii.gz", [91, 109, 91], 74825382.0, [45, 54, 45], 121.0),
            (
                "nifti/little.nii.gz",
                [64, 64, 21],
                11648.372022011292,
                [32, 32, 10],
                -1.2852673530578613,
            ),
            ("mhd/5_annotation.mhd", [67, 43, 40], 190498735.0, [33, 21, 20], 16353.0),
            ("mhd/Bucky.mhd", [32, 32, 32], 1174726.0, [16, 16, 16], 1.0),
            ("vti/voreen_flow_A_0020000.vti", [33, 44, 28], 331.5420003593099, [16, 22, 14], 0.0),
            ("pvm/Bucky.pvm", [32, 32, 32], 1174726.0, [16, 16, 16], 1.0),
            ("den/head-scaleddown4.den", [64, 64, 28], 4070712.0, [32, 32, 14], 171.0),
            ("mitsuba_vol/torus_sdfgrid.vol", [40, 40, 40], 570627.9328067699, [20, 20, 20], 6.0),
        ];
        for &(name, dims, sum, [x, y, z], value) in facts {
            let path = outside("data").join(name);
            let file = open(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(file.header().dims, dims, "{name}");
            let density =
                file.voxels().unwrap_or_else(|error| panic!("{error}")).density().unwrap();
            let found: f64 = density.iter().map(|&v| f64::from(v)).sum();
            assert!((found - sum).abs() <= 1e-9 * sum.abs(), "{name}: {found} instead of {sum}");
            assert_eq!(density[[z, y, x]], value, "{name}");
        }
    }

    /// Twin: `files_of_other_programs_hold_their_formulas_at_every_voxel`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn bucky_is_the_same_in_every_format() {
        let voxels = std::fs::read(outside("data/raw/Bucky.raw")).unwrap();
        for name in ["data/pvm/Bucky.pvm", "data/mhd/Bucky.mhd"] {
            let file = open(&outside(name)).unwrap();
            assert!(file.voxels().unwrap().bytes() == voxels, "{name}");
        }
    }

    /// The same smoke, once as NanoVDB and once as OpenVDB.
    ///
    /// Twin: `one_tree_is_the_same_volume_as_nanovdb_and_as_openvdb`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn a_nanovdb_grid_has_the_voxels_of_the_openvdb_grid_it_came_from() {
        let volume = |name: &str| {
            load_volume(&VolumeTable { path: Some(outside(name)), ..VolumeTable::default() })
                .unwrap()
        };
        let nano = volume("data/nvdb/fvdb_smoke-blosc.nvdb");
        let open_vdb = volume("data/vdb/openvdb_smoke.vdb");
        assert_eq!(nano.dims(), [113, 224, 114]);
        assert!(nano.values() == open_vdb.values());
        assert_eq!(nano.domain(), open_vdb.domain());
    }
}
