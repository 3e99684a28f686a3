//! What is written reads back as it was, voxel by voxel, and as the real library writes it.

use std::collections::HashMap;
use std::path::PathBuf;

use deepshadow::io::vdb::{
    AnyValue, Compression, EVERYWHERE, Grid, IndexBox, MetaValue, Metadata, NewGrid, Transform,
    TreeBuilder, Value, VdbFile, VdbWriter,
};
use glam::{DMat4, DVec3, IVec3};
use half::f16;

use super::vdb_fixtures::fixture;
use super::vdb_hostile::fixtures;
use crate::support::Random;

const COMPRESSIONS: [Compression; 4] =
    [Compression::BLOSC, Compression::ZIP, Compression::ACTIVE_MASK, Compression::NONE];

/// All bits of a value, of which a NaN's and a zero's sign are two.
fn bits(value: AnyValue) -> [u64; 3] {
    match value {
        AnyValue::Float(value) => [value.to_bits().into(), 0, 0],
        AnyValue::Double(value) => [value.to_bits(), 0, 0],
        AnyValue::Half(value) => [value.to_bits().into(), 0, 0],
        AnyValue::Int32(value) => [value as u64, 0, 0],
        AnyValue::Int64(value) => [value as u64, 0, 0],
        AnyValue::Bool(value) => [value.into(), 0, 0],
        AnyValue::Vec3s(values) => values.map(|value| value.to_bits().into()),
        AnyValue::Vec3d(values) => values.map(f64::to_bits),
        AnyValue::Vec3i(values) => values.map(|value| value as u64),
        other => panic!("{other:?}"),
    }
}

fn same(found: (AnyValue, bool), expected: (AnyValue, bool)) -> bool {
    found.1 == expected.1 && bits(found.0) == bits(expected.0)
}

/// Voxels where something is stored: all of every leaf, and the corners of every tile.
fn places(grid: &Grid) -> Vec<IVec3> {
    fn of<T: Value>(tree: &deepshadow::io::vdb::Tree<T>) -> Vec<IVec3> {
        let mut places = Vec::new();
        for leaf in tree.leaves() {
            let IndexBox { min, max } = leaf.bounds();
            for x in min.x..=max.x {
                for y in min.y..=max.y {
                    places.extend((min.z..=max.z).map(|z| IVec3::new(x, y, z)));
                }
            }
        }
        for tile in tree.tiles() {
            let IndexBox { min, max } = tile.bounds();
            places.extend([min, max, min.saturating_sub(IVec3::ONE), IVec3::new(max.x, min.y, 5)]);
        }
        places
    }
    match grid {
        Grid::Float(tree) => of(tree),
        Grid::Double(tree) => of(tree),
        Grid::Half(tree) => of(tree),
        Grid::Int32(tree) => of(tree),
        Grid::Int64(tree) => of(tree),
        Grid::Bool(tree) => of(tree),
        Grid::Vec3s(tree) => of(tree),
        Grid::Vec3d(tree) => of(tree),
        Grid::Vec3i(tree) => of(tree),
        _ => panic!("an unknown type"),
    }
}

fn assert_same_voxels(found: &Grid, expected: &Grid, what: &str) {
    assert_eq!(found.value_type(), expected.value_type(), "{what}");
    assert_eq!(bits(found.background()), bits(expected.background()), "{what}");
    assert_eq!(found.active_voxel_count(), expected.active_voxel_count(), "{what}");
    assert_eq!(found.active_bounds(), expected.active_bounds(), "{what}");
    for index in places(expected).into_iter().chain(places(found)) {
        let (found, expected) = (found.get(index), expected.get(index));
        assert!(same(found, expected), "{what} at {index}: {found:?} instead of {expected:?}");
    }
}

/// The file of all grids of `file` that load.
fn rewritten(file: &VdbFile, compression: Compression) -> Vec<u8> {
    let kept: Vec<usize> =
        (0..file.grids().len()).filter(|&at| file.grids()[at].refused.is_none()).collect();
    let names: Vec<&str> = kept.iter().map(|&at| file.grids()[at].name.as_str()).collect();
    let mut writer = VdbWriter::new(&names, compression, file.metadata());
    for &at in &kept {
        writer.add(NewGrid::like(&file.grids()[at], file.load(at).unwrap())).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn files_of_the_real_library_written_again_hold_the_same() {
    write_again(&fixtures());
}

mod outside {
    use super::*;
    use crate::support::data::outside_grids;

    /// Twin: `files_of_the_real_library_written_again_hold_the_same`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn files_of_many_programs_written_again_hold_the_same() {
        write_again(&[outside_grids("vdb"), outside_grids("data/vdb")].concat());
    }
}

/// Checks that the files hold the same when they are read, written and read again.
fn write_again(paths: &[PathBuf]) {
    let mut grids = 0;
    for path in paths {
        // All ways for small files, the usual one for large ones.
        let small = std::fs::metadata(path).unwrap().len() < 300_000;
        let file = VdbFile::open(path).unwrap();
        for compression in COMPRESSIONS.into_iter().take(if small { 4 } else { 1 }) {
            let bytes = rewritten(&file, compression);
            let what = format!("{} as {compression}", path.display());
            let again = VdbFile::from_bytes("memory", bytes).unwrap();
            let expected =
                file.grids().iter().enumerate().filter(|(_, grid)| grid.refused.is_none());
            for (at, (index, header)) in expected.enumerate() {
                let found = &again.grids()[at];
                assert_eq!(found.refused, None, "{what}");
                assert_eq!(found.name, header.name, "{what}");
                assert_eq!(found.map_name, header.map_name, "{what}");
                assert_eq!(found.transform, header.transform, "{what}");
                assert_eq!(found.class(), header.class(), "{what}");
                for (key, value) in header.metadata.iter() {
                    let kept = !key.starts_with("file_") && key != "is_saved_as_half_float";
                    // A NaN is not itself.
                    let is_nan = format!("{value:?}").contains("NaN");
                    if kept && !is_nan {
                        let metadata = &again.grids()[at].metadata;
                        assert_eq!(metadata.get(key), Some(value), "{what}: {key}");
                    }
                }
                let (found, expected) = (again.load(at).unwrap(), file.load(index).unwrap());
                assert_same_voxels(&found, &expected, &what);
                grids += 1;
            }
        }
    }
    assert!(grids > 0);
    eprintln!("{grids} grids");
}

#[test]
fn the_same_grid_gives_the_same_bytes_and_another_one_another_identity() {
    let file = VdbFile::open(fixture("types_zip.vdb")).unwrap();
    let (first, second) =
        (rewritten(&file, Compression::BLOSC), rewritten(&file, Compression::BLOSC));
    assert!(first == second);
    let identity = |bytes: Vec<u8>| VdbFile::from_bytes("memory", bytes).unwrap().uuid().to_owned();
    let other = VdbFile::open(fixture("ball_blosc.vdb")).unwrap();
    let [a, b] = [identity(first), identity(rewritten(&other, Compression::BLOSC))];
    assert!(a != b && a.len() == 36 && a.matches('-').count() == 4, "{a} {b}");
}

/// What a tree must hold: single voxels over boxes over the background.
struct Model<T> {
    boxes: Vec<(IndexBox, T, bool)>,
    voxels: HashMap<[i32; 3], (T, bool)>,
    background: T,
}

impl<T: Value> Model<T> {
    fn get(&self, index: IVec3) -> (T, bool) {
        let stored = self.voxels.get(&index.to_array()).copied();
        let filled = || self.boxes.iter().rev().find(|(bounds, ..)| bounds.contains(index));
        stored
            .or_else(|| filled().map(|&(_, value, active)| (value, active)))
            .unwrap_or((self.background, false))
    }
}

fn between(random: &mut Random, low: i32, high: i32) -> i32 {
    low + (random.unit() * f64::from(high - low + 1)) as i32
}

/// A tree of tiles of all sizes, leaves with many and with few inactive values, and what it holds.
fn made<T: Value>(
    random: &mut Random,
    background: T,
    value: impl Fn(&mut Random) -> T,
) -> (TreeBuilder<T>, Model<T>) {
    let mut tree = TreeBuilder::new(background);
    let mut model = Model { boxes: Vec::new(), voxels: HashMap::new(), background };
    for _ in 0..between(random, 0, 5) {
        let log = [0, 3, 7, 12][between(random, 0, 3) as usize];
        let corner = |random: &mut Random| between(random, -3, 2) << log;
        let min = IVec3::new(corner(random), corner(random), corner(random));
        let more = if log > 3 { 0 } else { between(random, 0, 9) };
        let max = min + (1 << log) - 1 + more;
        let (bounds, value) = (IndexBox { min, max }, value(random));
        let active = random.unit() < 0.6;
        tree.fill(bounds, value, active);
        model.boxes.push((bounds, value, active));
    }
    for _ in 0..between(random, 0, 4) {
        let corner = IVec3::from_array([0; 3].map(|_: i32| between(random, -300, 300)));
        let palette: Vec<T> = (0..between(random, 1, 4)).map(|_| value(random)).collect();
        for _ in 0..between(random, 1, 700) {
            let offset = IVec3::from_array([0; 3].map(|_: i32| between(random, 0, 11)));
            let active = random.unit() < 0.5;
            let index = corner + offset;
            let value = if active {
                value(random)
            } else {
                palette[between(random, 0, palette.len() as i32 - 1) as usize]
            };
            tree.set(index, value, active);
            model.voxels.insert(index.to_array(), (value, active));
        }
    }
    (tree, model)
}

/// Writes random trees of a type and reads them back.
fn check_random<T: Value>(
    name: &str,
    backgrounds: &[T],
    half: bool,
    value: impl Fn(&mut Random) -> T + Copy,
) where
    deepshadow::io::vdb::Tree<T>: Into<Grid>,
{
    for seed in 0..16_u64 {
        let mut random = Random(77 + seed * 0x9e37_79b9);
        let background = backgrounds[seed as usize % backgrounds.len()];
        let (tree, model) = made(&mut random, background, value);
        let compression = COMPRESSIONS[seed as usize / 2 % 4];
        let what = format!("{name}, seed {seed}, {compression}, half {half}");
        let tree = tree.finish();
        let bytes = {
            let same = tree.rebuilt(EVERYWHERE, &|value, active| (value, active));
            let grid = NewGrid::new(same.into(), &DMat4::IDENTITY).with_half(half);
            let mut writer = VdbWriter::new(&[""], compression, &Metadata::default());
            writer.add(grid).unwrap();
            writer.finish().unwrap()
        };
        let file = VdbFile::from_bytes("memory", bytes).unwrap();
        let found = file.load(0).unwrap();
        let written = tree.rebuilt(EVERYWHERE, &|value, active| (value, active));
        assert_same_voxels(&found, &written.into(), &what);
        let near = |index: &[i32; 3], offset: IVec3| IVec3::from_array(*index) + offset;
        let voxels = model.voxels.keys().map(|index| near(index, IVec3::ZERO));
        let beside = model.voxels.keys().map(|index| near(index, IVec3::new(1, -1, 8)));
        let corners = model.boxes.iter().flat_map(|(b, ..)| [b.min, b.max, b.min - 1, b.max + 1]);
        for index in voxels.chain(beside).chain(corners) {
            let (value, active) = model.get(index);
            let expected = (value.any(), active);
            assert!(same(found.get(index), expected), "{what} at {index}: {expected:?}");
        }
    }
}

#[test]
fn random_trees_of_every_type_come_back() {
    let float = |random: &mut Random| match between(random, 0, 9) {
        0 => -0.0,
        1 => f32::NAN,
        2 => f32::NEG_INFINITY,
        _ => random.unit() as f32 - 0.5,
    };
    check_random("float", &[0.0, -0.0, 0.25, -3.0, f32::NAN], false, float);
    check_random("double", &[0.0, 1.0e300], false, |random| random.unit() - 0.5);
    check_random("int32", &[0, -7, i32::MIN], false, |random| between(random, -9, 9));
    check_random("int64", &[0, i64::MAX], false, |random| {
        i64::MIN + i64::from(between(random, 0, 9))
    });
    check_random("bool", &[false, true], false, |random| random.unit() < 0.5);
    let vector = |random: &mut Random| [float(random), random.unit() as f32, 1.0];
    check_random("vec3s", &[[0.0; 3], [0.5, -0.0, 2.0]], false, vector);
    check_random("vec3d", &[[0.1; 3]], false, |random| [random.unit(), 0.0, -1.0]);
    check_random("vec3i", &[[1, 2, 3]], false, |random| [between(random, 0, 2), 0, i32::MAX]);
}

/// Values that half floats hold come back as they were.
#[test]
fn random_trees_of_half_floats_come_back() {
    let half = |random: &mut Random| f16::from_f64(random.unit() * 300.0 - 150.0).to_f32();
    check_random("half", &[0.0, 0.5, -3.0], true, half);
    check_random("half double", &[0.0, 0.5], true, |random| f64::from(half(random)));
    check_random("half vec3s", &[[0.0; 3], [0.5; 3]], true, |random| [half(random), 0.25, 1.0]);
    check_random("int32 as half", &[3], true, |random| between(random, -9, 70_000));
}

#[test]
fn half_floats_round_values_tiles_and_the_background() {
    let mut tree = TreeBuilder::new(0.1_f32);
    tree.set(IVec3::ZERO, 0.3, true);
    let tile = IndexBox { min: IVec3::splat(128), max: IVec3::splat(255) };
    tree.fill(tile, 1.0e-3, true);
    let grid = NewGrid::new(tree.finish().into(), &DMat4::IDENTITY).with_half(true);
    let mut writer = VdbWriter::new(&["a"], Compression::BLOSC, &Metadata::default());
    writer.add(grid).unwrap();
    let file = VdbFile::from_bytes("memory", writer.finish().unwrap()).unwrap();
    assert_eq!(file.grids()[0].type_name, "Tree_float_5_4_3_HalfFloat");
    let grid = file.load(0).unwrap();
    let rounded = |value: f32| AnyValue::Float(f16::from_f32(value).to_f32());
    assert_eq!(grid.get(IVec3::ZERO), (rounded(0.3), true));
    assert_eq!(grid.get(IVec3::splat(200)), (rounded(1.0e-3), true));
    assert_eq!(grid.background(), rounded(0.1));
    assert_eq!(grid.get(IVec3::ONE), (rounded(0.1), false));
}

/// A box of one value takes a few hundred bytes, however large it is.
#[test]
fn constant_regions_become_tiles() {
    let mut tree = TreeBuilder::new(0_i32);
    for x in 0..128 {
        for y in 0..16 {
            for z in 0..16 {
                tree.set(IVec3::new(x, y, z), 5, true);
            }
        }
    }
    let tree = tree.finish();
    assert_eq!((tree.leaf_count(), tree.tiles().count()), (0, 64));
    assert_eq!(tree.active_voxel_count(), 128 * 16 * 16);
    let mut tree = TreeBuilder::new(0_i32);
    let whole = IndexBox { min: IVec3::splat(-4096), max: IVec3::splat(-1) };
    tree.fill(IndexBox { max: IVec3::new(-1, -1, -2), ..whole }, 5, true);
    tree.fill(IndexBox { min: IVec3::new(-4096, -4096, -1), ..whole }, 5, true);
    let tree = tree.finish();
    assert_eq!(tree.tiles().map(|tile| tile.log_edge).collect::<Vec<_>>(), [12]);
}

#[test]
fn metadata_says_what_is_in_the_file() {
    let mut tree = TreeBuilder::new(0.0_f32);
    tree.set(IVec3::new(-5, 2, 3), 1.0, true);
    tree.set(IVec3::new(7, 2, -3), 1.0, true);
    let place =
        DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DMat4::from_scale(DVec3::splat(0.1));
    let mut grid = NewGrid::new(tree.finish().into(), &place).with_class("fog volume");
    grid.metadata().set("note", MetaValue::Vec4d([1.0, 2.0, 3.0, 4.0]));
    let nothing = NewGrid::new(TreeBuilder::new(0.0_f32).finish().into(), &DMat4::IDENTITY);
    let mut writer = VdbWriter::new(&["a", "a"], Compression::ZIP, &Metadata::default());
    writer.add(grid).unwrap();
    writer.add(nothing).unwrap();
    assert!(writer.add(NewGrid::new(TreeBuilder::new(1_i32).finish().into(), &place)).is_err());
    let file = VdbFile::from_bytes("memory", writer.finish().unwrap()).unwrap();
    let [header, empty] = [&file.grids()[0], &file.grids()[1]];
    assert_eq!(
        (header.map_name.as_str(), empty.map_name.as_str()),
        ("UniformScaleTranslateMap", "UniformScaleMap")
    );
    assert_eq!(header.transform, Transform::Affine(place));
    let text = |text: &str| MetaValue::String(text.to_owned());
    for (key, value) in [
        ("name", text("a")),
        ("class", text("fog volume")),
        ("file_compression", text("zip + active values")),
        ("file_bbox_min", MetaValue::Vec3i([-5, 2, -3])),
        ("file_bbox_max", MetaValue::Vec3i([7, 2, 3])),
        ("file_voxel_count", MetaValue::Int64(2)),
        ("is_saved_as_half_float", MetaValue::Bool(false)),
        ("note", MetaValue::Vec4d([1.0, 2.0, 3.0, 4.0])),
    ] {
        assert_eq!(header.metadata.get(key), Some(&value), "{key}");
    }
    assert_eq!(empty.metadata.get("file_bbox_min"), Some(&MetaValue::Vec3i([i32::MAX; 3])));
    assert_eq!((header.unique_name.as_str(), empty.unique_name.as_str()), ("a\u{1e}0", "a\u{1e}1"));
}

#[test]
fn an_instance_written_again_shares_its_parents_voxels() {
    let file = VdbFile::open(fixture("instance.vdb")).unwrap();
    let names: Vec<&str> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    let mut writer = VdbWriter::new(&names, Compression::BLOSC, file.metadata());
    writer.add(NewGrid::like(&file.grids()[0], file.load(0).unwrap())).unwrap();
    writer.add_instance(&file.grids()[1], 0).unwrap();
    let again = VdbFile::from_bytes("memory", writer.finish().unwrap()).unwrap();
    assert_eq!(again.grids()[1].instance_of.as_deref(), Some("density"));
    assert_eq!(again.grids()[1].transform, file.grids()[1].transform);
    assert_same_voxels(&again.load(1).unwrap(), &file.load(1).unwrap(), "instance");
}

/// OpenVDB says so of grids of whole numbers too, and stores them as they are.
#[test]
fn whole_numbers_are_never_halves() {
    let mut tree = TreeBuilder::new(0_i32);
    tree.set(IVec3::ONE, 123_456_789, true);
    let grid = NewGrid::new(tree.finish().into(), &DMat4::IDENTITY).with_half(true);
    let mut writer = VdbWriter::new(&["a"], Compression::BLOSC, &Metadata::default());
    writer.add(grid).unwrap();
    let file = VdbFile::from_bytes("memory", writer.finish().unwrap()).unwrap();
    assert!(!file.grids()[0].saved_as_half);
    assert_eq!(file.load(0).unwrap().get(IVec3::ONE), (AnyValue::Int32(123_456_789), true));
}
