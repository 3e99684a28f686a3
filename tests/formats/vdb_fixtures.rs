//! The project's own files, written by the real OpenVDB library, hold what their formulas say; see
//! `tests/fixtures/vdb/README.md`.

use std::path::PathBuf;

use deepshadow::io::vdb::{
    AnyValue, Grid, IndexBox, MetaValue, SurveyDepth, Transform, ValueType, VdbFile,
};
use glam::{DMat4, DVec3, IVec3};

/// All fixtures in `tests/fixtures/vdb`; `bumps.vdb` is checked in `nanovdb_fixtures.rs`.
pub const FILES: [&str; 7] = [
    "ball_blosc.vdb",
    "bumps.vdb",
    "instance.vdb",
    "strings.vdb",
    "strings_stream.vdb",
    "types_stream.vdb",
    "types_zip.vdb",
];

/// Path of a fixture.
pub fn fixture(name: &str) -> PathBuf {
    crate::support::project().join("tests/fixtures/vdb").join(name)
}

fn open(name: &str) -> VdbFile {
    VdbFile::open(fixture(name)).unwrap()
}

/// Checks a grid made by `make` of `make_fixtures.cc`.
fn check_made(grid: &Grid, background: AnyValue, value: impl Fn(i32) -> AnyValue) {
    assert_eq!(grid.background(), background);
    for i in 0..10 {
        assert_eq!(grid.get(IVec3::new(i, 2 * i, -3 * i)), (value(i), true), "voxel {i}");
    }
    assert_eq!(grid.get(IVec3::new(3, 6, -8)), (background, false));
    assert_eq!(grid.get(IVec3::new(16, 0, 0)), (value(42), true));
    assert_eq!(grid.get(IVec3::new(19, 3, 3)), (value(42), true));
    assert_eq!(grid.get(IVec3::new(20, 0, 0)), (background, false));
    assert_eq!(grid.get(IVec3::new(-5000, 0, 1 << 30)), (background, false));
    assert_eq!(grid.active_voxel_count(), 10 + 64);
    let bounds = IndexBox { min: IVec3::new(0, 0, -27), max: IVec3::new(19, 18, 3) };
    assert_eq!(grid.active_bounds(), Some(bounds));
}

fn check_types(file: &VdbFile) {
    let names: Vec<_> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["density", "density", "", "flag", "mask", "velocity"]);
    let types: Vec<_> = file.grids().iter().map(|grid| grid.value_type.name()).collect();
    assert_eq!(types, ["float", "float", "int32", "bool", "mask", "vec3d"]);
    assert!(!file.grids()[0].saved_as_half && file.grids()[1].saved_as_half);
    for grid in file.grids() {
        let half = DMat4::from_scale(DVec3::splat(0.5));
        assert_eq!(grid.transform, Transform::Affine(half));
        assert_eq!(grid.refused, None);
        let known = file.load(file.find(&grid.name).unwrap()).unwrap().active_voxel_count();
        assert_eq!(known, 74);
    }
    let [density, half, unnamed, flag, mask, velocity] =
        std::array::from_fn(|index| file.load(index).unwrap());
    check_made(&density, AnyValue::Float(0.0), |i| AnyValue::Float(1.5 + i as f32));
    check_made(&half, AnyValue::Float(0.5), |i| AnyValue::Float(1.5 + i as f32));
    check_made(&unnamed, AnyValue::Int32(-7), |i| AnyValue::Int32(100 * i));
    check_made(&flag, AnyValue::Bool(false), |i| AnyValue::Bool(i % 2 == 0));
    check_made(&mask, AnyValue::Bool(false), |_| AnyValue::Bool(true));
    check_made(&velocity, AnyValue::Vec3d([1.0, 2.0, 3.0]), |i| {
        AnyValue::Vec3d([f64::from(i), f64::from(-i), 0.25 * f64::from(i)])
    });
}

#[test]
fn the_ball_holds_its_formula_everywhere() {
    let file = open("ball_blosc.vdb");
    let header = &file.grids()[0];
    assert_eq!((header.class(), header.value_type.clone()), ("fog volume", ValueType::Float));
    assert_eq!(header.compression.to_string(), "blosc + active values");
    assert_eq!(header.background, Some(AnyValue::Float(0.25)));
    let Grid::Float(tree) = file.load(0).unwrap() else { panic!("not a float grid") };
    let (mut count, mut sum) = (0, 0.0);
    for x in 50..70 {
        for y in 50..70 {
            for z in 50..70 {
                let index = IVec3::new(x, y, z);
                let r2 = (index - 60).length_squared();
                let expected = if r2 <= 25 { (r2 as f32, true) } else { (0.25, false) };
                assert_eq!(tree.get(index), expected, "{index}");
                if r2 <= 25 {
                    count += 1;
                    sum += f64::from(r2);
                }
            }
        }
    }
    assert_eq!(tree.active_voxel_count(), count);
    assert_eq!(header.metadata.get("file_voxel_count"), Some(&MetaValue::Int64(count as i64)));
    assert_eq!(tree.active_values().count() as u64, count);
    assert!(tree.active_values().all(|voxel| tree.get(voxel.origin) == (voxel.value, true)));
    let statistics = tree.statistics();
    assert_eq!((statistics[0].min, statistics[0].max), (0.0, 25.0));
    assert!((statistics[0].mean - sum / count as f64).abs() < 1e-12);
    assert_eq!(file.survey(0, SurveyDepth::Values).unwrap().statistics, statistics);
    assert_eq!(file.survey(0, SurveyDepth::Topology).unwrap().active_voxels, count);
}

#[test]
fn all_types_and_a_double_and_an_empty_name_read_from_zip() {
    let file = open("types_zip.vdb");
    assert!(file.unreachable().is_none());
    check_types(&file);
}

#[test]
fn a_stream_without_offsets_reads_like_a_file() {
    let file = open("types_stream.vdb");
    assert!(file.is_stream());
    check_types(&file);
}

#[test]
fn the_second_of_a_name_is_found_by_its_number() {
    let file = open("types_zip.vdb");
    assert_eq!(file.find("density"), Some(0));
    assert_eq!(file.find("density[0]"), Some(0));
    assert_eq!(file.find("density[1]"), Some(1));
    assert_eq!(file.find("density[2]"), None);
    assert_eq!(file.find(""), Some(2));
    assert_eq!(file.find("nothing"), None);
}

#[test]
fn a_string_grid_is_named_and_stepped_over() {
    let file = open("strings.vdb");
    assert_eq!(file.grids()[0].name, "words");
    let refused = file.grids()[0].refused.as_deref().unwrap();
    assert!(refused.contains("\"string\""), "{refused}");
    assert!(file.load(0).is_err());
    assert_eq!(file.load(1).unwrap().active_voxel_count(), 74);
}

#[test]
fn a_string_grid_in_a_stream_hides_what_follows_and_says_so() {
    let file = open("strings_stream.vdb");
    let names: Vec<_> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["density", "words"]);
    assert_eq!(file.load(0).unwrap().active_voxel_count(), 74);
    let unreachable = file.unreachable().unwrap();
    assert!(unreachable.starts_with("1 grids after"), "{unreachable}");
}

#[test]
fn an_instance_has_its_parents_voxels_and_its_own_transform() {
    let file = open("instance.vdb");
    let [first, second] = [0, 1].map(|index| &file.grids()[index]);
    assert_eq!(second.instance_of.as_deref(), Some("density"));
    assert_eq!(second.transform, Transform::Affine(DMat4::from_scale(DVec3::splat(2.0))));
    assert_ne!(first.transform, second.transform);
    assert_eq!(second.background, Some(AnyValue::Float(0.0)));
    let grid = file.load(1).unwrap();
    check_made(&grid, AnyValue::Float(0.0), |i| AnyValue::Float(1.5 + i as f32));
}
