//! Volumes in blocks say and show what dense ones do, and take memory where there is something.

use std::path::PathBuf;
use std::sync::Arc;

use deepshadow::io::vdb::{EVERYWHERE, Grid, IndexBox, Tree, Value, VdbFile};
use deepshadow::progress::Silent;
use deepshadow::scene::{Media, Scene};
use deepshadow::settings::MapKind;
use deepshadow::shadow::Map;
use deepshadow::volume::presets::Preset;
use deepshadow::volume::{BLOCK, BLOCK_EDGE, BLOCK_VALUES, Range, SparseVoxels, Volume, Voxels};
use glam::{DMat4, DVec3, IVec3};

use crate::formats::vdb_fixture as fixture;
use crate::support::Random;
use crate::support::backends::{every_backend, gpu};
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};

/// A ball that reaches two borders of a box of which most is empty.
fn ball(dims: [usize; 3]) -> Volume {
    volume(dims, unit_cube(), |voxel| {
        let place = DVec3::from_array(voxel.map(|c| c as f64));
        let [nx, _, nz] = dims.map(|n| n as f64);
        let far = place.distance(DVec3::new(nx - 5.0, 7.0, nz - 6.0));
        ((12.0 - far) / 12.0).max(0.0) as f32
    })
}

fn blocks_of(volume: &Volume) -> usize {
    let Voxels::Sparse(voxels) = volume.voxels() else { panic!("dense") };
    voxels.values().len() / BLOCK_VALUES
}

#[test]
fn blocks_hold_what_the_array_held() {
    let mut random = Random(7);
    for dims in [[1, 1, 1], [16, 17, 18], [33, 1, 15], [40, 49, 64]] {
        let noise = volume(dims, unit_cube(), |_| (random.unit() as f32 - 0.7).max(0.0));
        for dense in [noise, ball(dims)] {
            let sparse = dense.clone().sparse();
            assert!(sparse.values() == dense.values(), "{dims:?}");
            assert_eq!(sparse.bricks().ranges(), dense.bricks().ranges(), "{dims:?}");
            assert_eq!(sparse.statistics().border, dense.statistics().border, "{dims:?}");
            assert!((sparse.statistics().mean - dense.statistics().mean).abs() < 1e-12);
            assert_eq!(sparse.visible_points(0.1), dense.visible_points(0.1), "{dims:?}");
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let (a, b) = (sparse.column_integrals(axis), dense.column_integrals(axis));
                assert_eq!(a.len(), b.len(), "{dims:?}");
                assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * b), "{dims:?}");
            }
            let changed: [fn(&Volume) -> Volume; 3] = [
                |volume| volume.gradient_magnitude(),
                |volume| volume.mapped(|value| value + 0.5),
                |volume| volume.clone().windowed([-1.0, 0.2]).unwrap(),
            ];
            check_edges(&sparse);
            for change in changed {
                let (a, b) = (change(&sparse), change(&dense));
                assert!(a.values() == b.values(), "{dims:?}");
                assert_eq!(a.statistics().border, b.statistics().border, "{dims:?}");
                check_edges(&a);
            }
        }
    }
}

/// Blocks know the first voxels of the next ones, and repeat the volume's last.
fn check_edges(volume: &Volume) {
    let Voxels::Sparse(voxels) = volume.voxels() else { panic!("dense") };
    check_edges_of(voxels, "");
}

fn check_edges_of(voxels: &SparseVoxels, what: &str) {
    let [x, y, z] = voxels.blocks();
    for block in (0..x * y * z).map(|i| [i % x, i / x % y, i / (x * y)]) {
        for (i, value) in voxels.block(block).iter().enumerate() {
            let inside = [i % BLOCK_EDGE, i / BLOCK_EDGE % BLOCK_EDGE, i / BLOCK_EDGE / BLOCK_EDGE];
            let voxel = std::array::from_fn(|axis| {
                (block[axis] * BLOCK + inside[axis]).min(voxels.dims()[axis] - 1)
            });
            assert_eq!(voxels.get(voxel).to_bits(), value.to_bits(), "{what}: {block:?}, {i}");
        }
    }
    check_corners(voxels);
}

/// The corners of cells, also of those without extent at the end of an axis.
fn check_corners(voxels: &SparseVoxels) {
    let dims = voxels.dims();
    let [nx, ny, nz] = dims;
    for low in (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / (nx * ny)]) {
        let cell = [0, 1, 2].map(|axis| [low[axis], (low[axis] + 1).min(dims[axis] - 1)]);
        let [x, y, z] = cell;
        let row = |y: usize, z: usize| x.map(|x| voxels.get([x, y, z]));
        let rows = [row(y[0], z[0]), row(y[1], z[0]), row(y[0], z[1]), row(y[1], z[1])];
        assert_eq!(voxels.corners(cell), rows, "{low:?}");
    }
}

/// Block 0 is the same everywhere, but its last voxel, which block 1 begins with, feels the jump
/// beyond it.
#[test]
fn a_gradient_is_felt_across_the_end_of_an_even_block() {
    let jump = volume([40, 1, 1], unit_cube(), |[x, ..]| if x > 16 { 1.0 } else { 0.0 });
    let steep = jump.clone().sparse().gradient_magnitude();
    assert!(steep.values() == jump.gradient_magnitude().values());
    assert!(steep.values()[[0, 0, 16]] > 0.0);
    check_edges(&steep);
}

#[test]
fn blocks_that_cannot_be_are_refused() {
    let wrong = |dims, table: &[u32], values: usize| {
        SparseVoxels::new(dims, table.to_vec(), (0..values).map(|i| i as f32).collect()).is_err()
    };
    assert!(wrong([17, 1, 1], &[0], BLOCK_VALUES));
    assert!(wrong([16, 1, 1], &[1], BLOCK_VALUES));
    assert!(wrong([16, 1, 1], &[0], BLOCK_VALUES - 1));
    // A block that ends inside cannot also be one that does not.
    assert!(wrong([20, 16, 16], &[0, 0], BLOCK_VALUES));
    let even = SparseVoxels::new([20, 16, 16], vec![0, 0], vec![2.0; 2 * BLOCK_VALUES]).unwrap();
    assert_eq!(even.values().len(), BLOCK_VALUES);
}

#[test]
fn empty_blocks_take_no_memory() {
    // Of 4 x 3 x 5 blocks the ball touches its own and one along each axis, and all others are one.
    let sparse = ball([64, 48, 80]).sparse();
    assert_eq!(blocks_of(&sparse), 5);
    assert_eq!(blocks_of(&sparse.mapped(|value| value.max(2.0))), 1);
    assert_eq!(sparse.windowed([-1.0, 1.0]).unwrap().values()[[0, 40, 0]], 0.5);
}

fn pictured(scene: &Scene, volume: Volume) -> Scene {
    let medium = scene.media.first().unwrap().medium.clone();
    let mut changed = scene.clone();
    changed.media = Media::of(Arc::new(volume), medium);
    changed
}

#[test]
fn every_backend_sees_the_same_through_blocks() {
    let rods = anchor_scene(Preset::Rods, 8.0, 32);
    let floats = scene(ball([40, 33, 52]), 9.0);
    for (name, dense) in [("rods", rods), ("ball", floats)] {
        let volume = Volume::clone(&dense.media.first().unwrap().volume).sparse();
        let sparse = pictured(&dense, volume);
        for kind in [MapKind::Threshold, MapKind::Fragments] {
            let settings = settings(48, [40, 32]).with(|s| s.map.kind = Some(kind));
            for backend in every_backend() {
                let of = |scene: &Scene| {
                    let map = backend.map(&scene.only_beam().unwrap(), &settings, &Silent).unwrap();
                    let image = backend.render(scene, &settings, &Silent).unwrap();
                    (map, image)
                };
                let ((map, image), (same_map, same_image)) = (of(&dense), of(&sparse));
                let what = format!("{name}, {kind:?}, {}", backend.description());
                let apart = largest_difference(&image.pixels, &same_image.pixels);
                assert!(image.pixels.iter().any(|pixel| pixel[3] > 0.2), "{what}: nothing there");
                if backend.description().contains("cpu") {
                    // The same sums of the same numbers.
                    assert_eq!(apart, 0.0, "{what}");
                    let (Map::Threshold(a), Map::Threshold(b)) = (&map, &same_map) else {
                        continue;
                    };
                    assert_eq!(a.texels(), b.texels(), "{what}");
                } else {
                    let limit =
                        if backend.description().contains("llvmpipe") { 2e-4 } else { 3e-3 };
                    assert!(apart < limit, "{what}: {apart}");
                }
            }
        }
    }
}

fn largest_difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    assert_eq!(a.len(), b.len());
    let differences = a.iter().zip(b).flat_map(|(a, b)| (0..4).map(move |i| (a[i] - b[i]).abs()));
    differences.fold(0.0, |most, next| if next <= most { most } else { next })
}

/// A volume that no texture of this device is long enough for is seen whole.
#[test]
fn a_volume_longer_than_textures_is_split() {
    let Some(backend) = gpu() else { return };
    let long = volume([17_000, 3, 2], unit_cube(), |[x, ..]| if x > 16_900 { 1.0 } else { 0.02 });
    let scene = scene(long, 5.0);
    let settings = settings(32, [32, 32]).with(|s| s.map.kind = Some(MapKind::Threshold));
    let [seen, truth] = [backend.as_ref(), &deepshadow::cpu::CpuBackend]
        .map(|backend| backend.render(&scene, &settings, &Silent).unwrap().pixels);
    assert!(truth.iter().any(|pixel| pixel[3] > 0.05));
    assert!(largest_difference(&seen, &truth) < 3e-3);
}

/// All voxels of a box one by one, as [`Tree::blocks`] has them.
fn check_blocks<T: Value>(tree: &Tree<T>, bounds: IndexBox, what: &str) {
    let dense = tree.densify(bounds, 1 << 26, Value::to_f32).unwrap();
    let blocks = tree.blocks(bounds, 1 << 30).unwrap();
    let room = blocks.bytes();
    let sparse = blocks.fill(|value| value).unwrap();
    assert!(sparse.bytes() as u64 <= room, "{what}");
    for ((z, y, x), value) in dense.values.indexed_iter() {
        assert_eq!(sparse.get([x, y, z]).to_bits(), value.to_bits(), "{what}: {x} {y} {z}");
    }
    check_edges_of(&sparse, what);
}

fn check_grid(grid: &Grid, what: &str) {
    let Some(active) = grid.active_bounds() else { return };
    let voxels = active.padded(1).dims().iter().map(|&n| n as f64).product::<f64>();
    if voxels > 4e6 {
        return;
    }
    for bounds in [active.padded(1), active.padded(11)] {
        match grid {
            Grid::Float(tree) => check_blocks(tree, bounds, what),
            Grid::Double(tree) => check_blocks(tree, bounds, what),
            Grid::Half(tree) => check_blocks(tree, bounds, what),
            Grid::Int32(tree) => check_blocks(tree, bounds, what),
            Grid::Bool(tree) => check_blocks(tree, bounds, what),
            Grid::Vec3s(tree) => check_blocks(tree, bounds, what),
            _ => {}
        }
    }
}

#[test]
fn blocks_of_trees_hold_every_voxel() {
    let own = ["ball_blosc.vdb", "bumps.vdb", "types_zip.vdb", "instance.vdb"];
    assert_eq!(check_files(&own.map(fixture)), 10);
}

mod outside {
    use super::*;
    use crate::support::data::outside_grids;

    /// Twin: `blocks_of_trees_hold_every_voxel`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn blocks_of_trees_of_the_real_library_hold_every_voxel() {
        assert!(check_files(&outside_grids("vdb")) > 0);
    }
}

/// Checks the grids that load; how many do.
fn check_files(paths: &[PathBuf]) -> usize {
    let mut grids = 0;
    for path in paths {
        let file = VdbFile::open(path).unwrap();
        for (i, header) in file.grids().iter().enumerate() {
            if let Ok(grid) = file.load(i) {
                check_grid(&grid, &format!("{} {}", path.display(), header.name));
                grids += 1;
            }
        }
    }
    grids
}

#[test]
fn a_small_cloud_in_a_large_box_stays_small() {
    let ball = VdbFile::open(fixture("ball_blosc.vdb")).unwrap().load(0).unwrap();
    let near = ball.active_bounds().unwrap();
    let far = IndexBox { min: near.min, max: near.min + IVec3::new(1499, 999, 1499) };
    // 2.2 billion voxels.
    let Voxels::Sparse(voxels) = ball.voxels(far, 1 << 30, |value| value).unwrap() else {
        panic!("9 GB of voxels")
    };
    assert!(voxels.bytes() < 12 << 20, "{}", voxels.bytes());
    // The background.
    assert_eq!(voxels.get([1000, 900, 1000]), 0.25);
    // All but the ball holds the background, and is counted without being visited.
    let volume = Volume::with_window("far", Voxels::Sparse(voxels), DMat4::IDENTITY, None).unwrap();
    let statistics = volume.statistics();
    assert!((statistics.mean - 0.25).abs() < 1e-5, "{}", statistics.mean);
    assert_eq!((statistics.border, statistics.nonempty > 0.999), (0.25, true));
    let columns = volume.column_integrals(DVec3::Z);
    assert!(columns.len() <= 1_500_000 && columns.contains(&375.0));
    assert_eq!(volume.bricks().ranges()[[20, 20, 20]], Range { low: 0.25, high: 0.25, slope: 0.0 });
    let error = ball.voxels(far, 1 << 20, |value| value).unwrap_err();
    assert!(error.to_string().contains("1500 x 1000 x 1500"), "{error}");
    let error = ball.voxels(EVERYWHERE, u64::MAX, |value| value).unwrap_err();
    assert!(error.to_string().contains("blocks"), "{error}");
}
