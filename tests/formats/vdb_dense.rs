//! A dense box is what the voxels are, one by one, and never larger than allowed.

use deepshadow::ErrorKind;
use deepshadow::io::vdb::{Grid, IndexBox, SurveyDepth, VdbFile};
use deepshadow::io::{FiniteRange, Histogram};
use glam::IVec3;

use super::vdb_bytes::OneGrid;
use super::vdb_fixtures::fixture;

/// Checks every voxel of the box.
fn check(grid: &Grid, bounds: IndexBox) {
    let Grid::Float(tree) = grid else { panic!("not a float grid") };
    let dense = grid.densify(bounds, 1 << 24).unwrap();
    assert_eq!(dense.origin, bounds.min);
    let [x, y, z] = bounds.dims().map(|length| length as usize);
    assert_eq!(dense.values.dim(), (z, y, x));
    for ((z, y, x), &value) in dense.values.indexed_iter() {
        let index = bounds.min + IVec3::new(x as i32, y as i32, z as i32);
        assert_eq!(value, tree.get(index).0, "{index}");
    }
}

#[test]
fn a_dense_box_has_every_voxel_where_it_belongs() {
    let ball = VdbFile::open(fixture("ball_blosc.vdb")).unwrap().load(0).unwrap();
    let bounds = ball.active_bounds().unwrap();
    check(&ball, bounds);
    check(&ball, bounds.padded(1));
    check(&ball, IndexBox { min: IVec3::new(57, 61, 59), max: IVec3::new(65, 62, 59) });
    check(&ball, IndexBox { min: IVec3::splat(-9), max: IVec3::new(-1, 3, 5) });
    let made = VdbFile::open(fixture("types_zip.vdb")).unwrap().load(0).unwrap();
    check(&made, made.active_bounds().unwrap().padded(2));
    check(&made, IndexBox { min: IVec3::new(17, 1, 1), max: IVec3::new(18, 2, 2) });
}

#[test]
fn vectors_become_their_length() {
    let grid = VdbFile::open(fixture("types_zip.vdb")).unwrap().load(5).unwrap();
    let one = IndexBox { min: IVec3::new(4, 8, -12), max: IVec3::new(4, 8, -12) };
    let dense = grid.densify(one, 4).unwrap();
    assert_eq!(dense.values[[0, 0, 0]], (16.0_f32 + 16.0 + 1.0).sqrt());
}

#[test]
fn a_box_beyond_the_limit_says_what_it_takes() {
    let grid = VdbFile::open(fixture("ball_blosc.vdb")).unwrap().load(0).unwrap();
    let bounds = grid.active_bounds().unwrap();
    assert!(grid.densify(bounds, 4 * 11 * 11 * 11).is_ok());
    let error = grid.densify(bounds, 4 * 11 * 11 * 11 - 1).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Limit { .. }));
    assert!(error.to_string().contains("5324 bytes"), "{error}");
    let everything = IndexBox { min: IVec3::MIN, max: IVec3::MAX };
    let error = grid.densify(everything, u64::MAX).unwrap_err();
    assert!(error.to_string().contains("316912650057057350374175801344 bytes"), "{error}");
}

#[test]
fn root_tiles_of_a_small_file_count_without_being_made() {
    let value = 1.5_f32.to_le_bytes().to_vec();
    let mut file = OneGrid::float(0, Vec::new());
    (file.branch_blocks, file.type_name) = (None, "Tree_float_5_4_3");
    file.root_tiles =
        vec![([4096, -4096, 0], value.clone(), true), ([i32::MIN, 0, 0], value, false)];
    let grid = VdbFile::from_bytes("memory", file.bytes()).unwrap().load(0).unwrap();
    assert_eq!(grid.active_voxel_count(), 1 << 36);
    let bounds = grid.active_bounds().unwrap();
    assert_eq!((bounds.min, bounds.max), (IVec3::new(4096, -4096, 0), IVec3::new(8191, -1, 4095)));
    let statistics = grid.statistics();
    assert_eq!((statistics[0].min, statistics[0].max, statistics[0].mean), (1.5, 1.5, 1.5));
    assert!(grid.memory_bytes() < 1000);
    let error = grid.densify(bounds, 1 << 30).unwrap_err();
    assert!(error.to_string().contains("274877906944 bytes"), "{error}");
    check(&grid, IndexBox { min: IVec3::new(4090, -2, -3), max: IVec3::new(4100, 1, 2) });
    check(&grid, IndexBox { min: IVec3::MIN, max: IVec3::MIN + 3 });
}

#[test]
fn an_inverted_box_is_empty() {
    let grid = VdbFile::open(fixture("ball_blosc.vdb")).unwrap().load(0).unwrap();
    let nothing = IndexBox { min: IVec3::splat(60), max: IVec3::new(62, 50, 62) };
    assert_eq!(grid.densify(nothing, 0).unwrap().values.len(), 0);
}

/// Also where a histogram is made without keeping voxels, as `info` does.
#[test]
fn a_streamed_histogram_counts_what_a_loaded_grid_holds() {
    const BINS: usize = 7;
    for name in ["ball_blosc.vdb", "types_zip.vdb"] {
        let file = VdbFile::open(fixture(name)).unwrap();
        for (index, header) in file.grids().iter().enumerate() {
            let Ok(grid) = file.load(index) else { continue };
            let mut range = FiniteRange::default();
            grid.for_each_active(|value, _| range.add(value));
            let due = range.0.map(|range| {
                let mut due = Histogram::new(range, BINS);
                grid.for_each_active(|value, voxels| due.add(value, voxels));
                due
            });
            let survey = file.survey(index, SurveyDepth::Histogram(BINS)).unwrap();
            assert_eq!(survey.histogram, due, "{name}, {}", header.name);
            let counted: u64 = due.map_or(0, |due| due.counts.iter().sum());
            assert_eq!(counted, survey.active_voxels, "{name}, {}", header.name);
            assert_eq!(survey.statistics, grid.statistics(), "{name}, {}", header.name);
        }
    }
}
