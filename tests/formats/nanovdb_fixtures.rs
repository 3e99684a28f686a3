//! NanoVDB files of the real library hold what `tests/fixtures/nvdb/make_fixtures.cc` put into
//! them, at every voxel and for all three codecs.

use std::io::Read;

use deepshadow::io::dense::{DenseFile, SparsePart};
use deepshadow::io::load_volume;
use deepshadow::io::vdb::{Grid, IndexBox, VdbFile};
use deepshadow::scene::file::VolumeTable;
use flate2::read::GzDecoder;
use glam::{DMat4, DVec3, DVec4, IVec3};
use tempfile::TempDir;

use super::dense_truth::open;
use crate::support::fixture;

/// The same grid three times. Its bare nodes are mostly zeros, which nothing but a zip around the
/// whole file keeps small.
pub const BUMPS: [(&str, &str); 3] = [
    ("nvdb/bumps_none.nvdb.gz", "none"),
    ("nvdb/bumps_zip.nvdb", "zip"),
    ("nvdb/bumps_blosc.nvdb", "blosc"),
];

pub const SLAB: &str = "nvdb/slab_zip.nvdb";

/// The tree of the bumps as OpenVDB.
const OPENVDB: &str = "vdb/bumps.vdb";

/// Value of the bumps at an index, and whether it is active.
fn bump(at: IVec3) -> (f32, bool) {
    let IVec3 { x, y, z } = at;
    let formula = (x + 64 * y + 2048 * z) as f32 / 8.0;
    let within = |low: [i32; 3], edges: [i32; 3]| {
        (0..3).all(|axis| (low[axis]..low[axis] + edges[axis]).contains(&at[axis]))
    };
    let spread = (x + 2 * y + 3 * z).rem_euclid(4) == 0;
    match at.to_array() {
        [-6, -9, 5] => (9.0, false),
        [300, -9, 4] => (formula, true),
        _ if within([-6, -20, 0], [16, 16, 13]) && spread => (formula, true),
        // Tiles: two of a lower node, one of an upper node, one of the root.
        _ if within([16, -16, 8], [8; 3]) => (7.0, true),
        _ if within([24, -16, 0], [8; 3]) => (-2.0, false),
        _ if within([128, -128, 0], [128; 3]) => (3.0, false),
        _ if within([0, -4096, -4096], [4096; 3]) => (-1.5, false),
        _ => (0.5, false),
    }
}

/// Bytes of one of the fixtures, without gzip around them.
pub fn bytes_of(name: &str) -> Vec<u8> {
    let bytes = std::fs::read(fixture(name)).unwrap();
    if !bytes.starts_with(b"\x1f\x8b") {
        return bytes;
    }
    let mut unpacked = Vec::new();
    GzDecoder::new(&bytes[..]).read_to_end(&mut unpacked).unwrap();
    unpacked
}

fn opened(name: &str, folder: &TempDir) -> DenseFile {
    let path = folder.path().join("v.nvdb");
    std::fs::write(&path, bytes_of(name)).unwrap();
    open(&path).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Checks every voxel of a file's box against `value`, and the statistics against what it gives;
/// the sum of all.
fn check(file: &DenseFile, active: IndexBox, value: impl Fn(IVec3) -> (f32, bool)) -> f64 {
    let header = file.header();
    let origin = active.min - 1;
    assert_eq!(header.dims, (active.max - active.min + 3).as_usizevec3().to_array());
    let lattice = header.lattice.unwrap();
    assert_eq!(lattice.origin, origin);
    assert_eq!(
        header.world_from_index,
        lattice.world_from_index * DMat4::from_translation(origin.as_dvec3())
    );
    let density = file.voxels().unwrap().density().unwrap();
    let [mut sum, mut active_sum, mut count] = [0.0; 3];
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for ((z, y, x), &found) in density.indexed_iter() {
        let at = origin + IVec3::new(x as i32, y as i32, z as i32);
        let (due, is_active) = value(at);
        assert_eq!(found, due, "at {at}");
        let due = f64::from(due);
        sum += due;
        if is_active {
            active_sum += due;
            count += 1.0;
            range = [range[0].min(due), range[1].max(due)];
        }
    }
    let SparsePart { active_bounds, active_voxels, level_set, statistics, .. } =
        header.sparse.clone().unwrap();
    assert_eq!((active_bounds, active_voxels as f64, level_set), (active, count, false));
    assert_eq!(([statistics.min, statistics.max], statistics.nan_count), (range, 0));
    assert!((statistics.mean - active_sum / count).abs() < 1e-9, "{}", statistics.mean);
    sum
}

#[test]
fn nanovdb_of_every_codec_holds_its_formula_at_every_voxel() {
    let folder = tempfile::tempdir().unwrap();
    for (name, codec) in BUMPS {
        let file = opened(name, &folder);
        let header = file.header();
        assert_eq!((header.name.as_deref(), header.compression), (Some("bumps"), codec));
        assert_eq!(header.background, Some(vec![0.5]), "{name}");
        // One step along x goes along the world's y, one along y against its x.
        let world = DMat4::from_cols(
            DVec4::new(0.0, 0.25, 0.0, 0.0),
            DVec4::new(-0.5, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 0.125, 0.75, 0.0),
            DVec4::new(10.0, -20.0, 30.5, 1.0),
        );
        assert_eq!(header.lattice.unwrap().world_from_index, world, "{name}");
        let active = IndexBox { min: IVec3::new(-6, -20, 0), max: IVec3::new(300, -5, 15) };
        let sum = check(&file, active, bump);
        // NanoVDB's own figures.
        assert_eq!((header.sparse.as_ref().unwrap().active_voxels, sum), (1345, 1_334_639.5));
    }
}

#[test]
fn an_active_tile_of_an_upper_node_is_as_many_voxels() {
    let folder = tempfile::tempdir().unwrap();
    let file = opened(SLAB, &folder);
    let header = file.header();
    assert_eq!(header.lattice.unwrap().world_from_index, DMat4::from_scale(DVec3::splat(0.1)));
    let active = IndexBox { min: IVec3::new(-128, 0, 128), max: IVec3::new(-1, 127, 255) };
    let sum =
        check(&file, active, |at| if active.contains(at) { (2.25, true) } else { (0.0, false) });
    assert_eq!(sum, 2.25 * f64::from(1 << 21));
}

#[test]
fn one_tree_is_the_same_volume_as_nanovdb_and_as_openvdb() {
    let folder = tempfile::tempdir().unwrap();
    let volume =
        |path| load_volume(&VolumeTable { path: Some(path), ..VolumeTable::default() }).unwrap();
    let open_vdb = volume(fixture(OPENVDB));
    for (name, _) in BUMPS {
        let path = folder.path().join("v.nvdb");
        std::fs::write(&path, bytes_of(name)).unwrap();
        let nano = volume(path);
        assert_eq!(nano.dims(), [309, 18, 18]);
        assert!(nano.values() == open_vdb.values(), "{name}");
        assert_eq!(nano.domain(), open_vdb.domain(), "{name}");
        assert!(nano.world_from_index().abs_diff_eq(*open_vdb.world_from_index(), 1e-12), "{name}");
    }
}

#[test]
fn openvdb_tiles_of_every_level_hold_their_formula() {
    let grid = VdbFile::open(fixture(OPENVDB)).unwrap().load(0).unwrap();
    let Grid::Float(tree) = grid else { panic!("not a float grid") };
    for x in -30..310 {
        for y in -30..10 {
            for z in -10..30 {
                let at = IVec3::new(x, y, z);
                assert_eq!(tree.get(at), bump(at), "at {at}");
            }
        }
    }
    for far in [IVec3::new(4095, -1, -4096), IVec3::new(255, -128, 127), IVec3::new(-1, -1, -1)] {
        assert_eq!(tree.get(far), bump(far), "at {far}");
    }
    assert_eq!(tree.active_voxel_count(), 1345);
}
