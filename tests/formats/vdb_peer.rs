//! An independent reader, the crate `vdb-rs`, finds the same active voxels in the files that it
//! reads right. It misreads or breaks on others, so the files are named one by one.

use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use deepshadow::io::vdb::{Grid, VdbFile};
use vdb_rs::{VdbLevel, VdbReader};

use super::vdb_fixtures::fixture;

/// The bits of all active values by voxel, tiles taken apart.
type Voxels = HashMap<[i32; 3], u32>;

fn by_peer(path: &Path, name: &str) -> Voxels {
    let mut reader = VdbReader::new(BufReader::new(File::open(path).unwrap())).unwrap();
    let grid = reader.read_grid::<f32>(name).unwrap();
    let mut voxels = Voxels::new();
    for (origin, value, level) in grid.iter() {
        let edge = if level == VdbLevel::Voxel { 1 } else { level.scale() as i32 };
        let origin = [origin.x, origin.y, origin.z].map(|c| c as i32);
        insert(&mut voxels, origin, edge, value);
    }
    voxels
}

fn by_us(path: &Path, name: &str) -> Voxels {
    let file = VdbFile::open(path).unwrap();
    let Grid::Float(tree) = file.load(file.find(name).unwrap()).unwrap() else {
        panic!("{} is no grid of floats", path.display());
    };
    let mut voxels = Voxels::new();
    for tile in tree.active_values() {
        insert(&mut voxels, tile.origin.to_array(), 1 << tile.log_edge, tile.value);
    }
    voxels
}

fn insert(voxels: &mut Voxels, [x, y, z]: [i32; 3], edge: i32, value: f32) {
    for dz in 0..edge {
        for dy in 0..edge {
            for dx in 0..edge {
                let before = voxels.insert([x + dx, y + dy, z + dz], value.to_bits());
                assert!(before.is_none(), "a voxel twice at {x}, {y}, {z}");
            }
        }
    }
}

fn compare(path: &Path, name: &str) {
    let (theirs, ours) = (by_peer(path, name), by_us(path, name));
    assert!(!ours.is_empty());
    assert!(ours == theirs, "{}: {} and {}", path.display(), ours.len(), theirs.len());
}

#[test]
fn an_independent_reader_finds_the_same_active_voxels() {
    compare(&fixture("ball_blosc.vdb"), "density");
}

mod outside {
    use super::*;
    use crate::support::data::outside;

    /// Twin: `an_independent_reader_finds_the_same_active_voxels`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn an_independent_reader_finds_the_same_active_voxels_in_published_files() {
        compare(&outside("data/vdb/openvdb_smoke.vdb"), "density");
        compare(&outside("data/vdb/openvdb_sphere.vdb"), "ls_sphere");
    }
}
