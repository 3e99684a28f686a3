//! Tests that automatic choices depend neither on a few voxels, nor on a volume's orientation, nor
//! on its unit.

use std::path::Path;

use deepshadow::io::vdb::{Compression, IndexBox, Metadata, NewGrid, TreeBuilder, VdbWriter};
use deepshadow::io::{load_ingredients, load_volume};
use deepshadow::math::frame_of;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::file::{TransferTable, VolumeTable};
use deepshadow::scene::{Media, Projection, Scene, SceneFile};
use deepshadow::volume::{Volume, Voxels};
use glam::{DMat3, DMat4, DVec3, IVec3};
use ndarray::Array3;

use crate::stored_values::{described, write_npy};
use crate::support::backends::every_backend;

fn chosen(volume: Volume, surroundings: Surroundings) -> Scene {
    complete(&SceneFile::default(), vec![volume.into()], surroundings).unwrap().0
}

fn scale(media: &Media) -> f64 {
    media.first().unwrap().medium.density_scale
}

/// A part of an egg, not at its centre.
fn egg(at: [usize; 3], dims: [usize; 3]) -> f32 {
    let away = |axis: usize| ((at[axis] as f32 + 0.5) / dims[axis] as f32 - 0.45) * 2.2;
    let r = (0..3).map(|axis| away(axis).powi(2)).sum::<f32>();
    (1.0 - r).max(0.0) * if at[0] > dims[0] / 2 { 2.0 } else { 1.0 }
}

/// The same voxels in the same places, with the array's axes in another order and one of them
/// reversed.
fn laid(order: [usize; 3], reversed: usize, unit: f64) -> Volume {
    let dims = [10, 18, 7];
    let steps = [DVec3::X * 3.0, DVec3::Y, DVec3::Z * 5.0].map(|step| step * unit);
    let new_dims = order.map(|axis| dims[axis]);
    let [nx, ny, nz] = new_dims;
    let values = Array3::from_shape_fn((nz, ny, nx), |(z, y, x)| {
        let mut at = [0; 3];
        for (new, axis) in order.into_iter().enumerate() {
            let i = [x, y, z][new];
            at[axis] = if new == reversed { new_dims[new] - 1 - i } else { i };
        }
        egg(at, dims)
    });
    let mut columns = order.map(|axis| steps[axis]);
    let origin = columns[reversed] * (new_dims[reversed] as f64 - 1.0);
    columns[reversed] = -columns[reversed];
    let [x, y, z] = columns;
    let place = DMat4::from_translation(origin) * DMat4::from_mat3(DMat3::from_cols(x, y, z));
    Volume::new("egg", values, place).unwrap()
}

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

#[test]
fn density_is_the_same_however_a_volume_lies_and_scales_with_its_unit() {
    let first = scale(&chosen(laid(ORDERS[0], 0, 1.0), Surroundings::Studio).media);
    for order in ORDERS {
        for reversed in 0..3 {
            let scene = chosen(laid(order, reversed, 1.0), Surroundings::Void);
            let found = scale(&scene.media);
            assert!((found / first - 1.0).abs() < 1e-9, "{order:?}: {found} instead of {first}");
        }
    }
    for unit in [1e-20, 1e-9, 1e-3, 1e5, 1e13, 1e22] {
        let found = scale(&chosen(laid(ORDERS[3], 1, unit), Surroundings::Studio).media) * unit;
        assert!((found / first - 1.0).abs() < 1e-9, "{unit}: {found} instead of {first}");
    }
    // A volume that lies down is a rotated volume.
    let turned = DMat4::from_mat3(DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X));
    let lying = laid(ORDERS[0], 0, 1.0);
    let lying = lying.clone().placed(turned * *lying.world_from_index()).unwrap();
    let found = scale(&chosen(lying, Surroundings::Studio).media);
    assert!((found / first - 1.0).abs() < 1e-9, "{found} instead of {first}");
}

#[test]
fn pictures_are_the_same_however_a_volume_lies() {
    let mut file = SceneFile::default();
    (file.image.width, file.image.height, file.shadow.size) = (Some(24), Some(24), Some(48));
    for backend in every_backend() {
        let picture = |volume: Volume| {
            let made = complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
            backend.render(&made.0, &made.1, &deepshadow::progress::Silent).unwrap().pixels
        };
        let first = picture(laid(ORDERS[0], 0, 1.0));
        let other = picture(laid(ORDERS[4], 1, 1.0));
        let off = first.iter().zip(&other).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f32::max);
        assert!(off < 1.0 / 255.0, "{off}");
    }
}

/// A section has, through the face from which most of it is seen, at least a third of a cube's
/// optical depth.
#[test]
fn thin_sections_and_single_slices_are_visible() {
    for thickness in [1, 3, 40] {
        for axis in 0..3 {
            let mut dims = [40; 3];
            dims[axis] = thickness;
            let [nx, ny, nz] = dims;
            let values = Array3::from_elem((nz, ny, nx), 2.0);
            let volume = Volume::new("section", values, DMat4::IDENTITY).unwrap();
            let scene = chosen(volume, Surroundings::Studio);
            let through = scale(&scene.media) * 2.0 * thickness as f64;
            let expected = 5.0 * (1.0 + 2.0 * thickness as f64 / 40.0) / 3.0;
            assert!((through - expected).abs() < 1e-9, "{thickness} along {axis}: {through}");
        }
    }
}

#[test]
fn a_scene_file_has_the_density_of_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    // An object in noise.
    write_npy(&folder.path().join("v.npy"), [12; 3], |[x, y, z]| {
        let inside = [x, y, z].iter().all(|i| (4..8).contains(i));
        if inside { 900.0 } else { 100.0 + ((x * 7 + y * 5 + z * 3) % 11) as f32 }
    });
    let table = VolumeTable { path: Some(folder.path().join("v.npy")), ..VolumeTable::default() };
    let (of_line, _) = load_ingredients(&table, true).unwrap();
    let line = complete(&SceneFile::default(), vec![of_line], Surroundings::Studio).unwrap().0;
    let (scene, _, notes) = described("[volume]\npath = \"v.npy\"\n", folder.path());
    assert_eq!(scale(&scene.media), scale(&line.media));
    assert!(notes.iter().any(|note| note.starts_with("window")), "{notes:?}");
    // A given density scale refers to stored values.
    let given = "[volume]\npath = \"v.npy\"\ndensity_scale = 0.01\n";
    let (scene, _, notes) = described(given, folder.path());
    assert!(scene.media.plain().is_some() && notes.is_empty(), "{notes:?}");
}

#[test]
fn hot_voxels_change_no_choice() {
    let folder = tempfile::tempdir().unwrap();
    for hot in [false, true] {
        let name = if hot { "hot.npy" } else { "cold.npy" };
        write_npy(&folder.path().join(name), [20; 3], |[x, y, z]| {
            if hot && [[1, 2, 3], [15, 15, 2]].contains(&[x, y, z]) {
                return 1e6;
            }
            let inside = [x, y, z].iter().all(|i| (6..14).contains(i));
            let noise = ((x * 7 + y * 5 + z * 3) % 11) as f32;
            if inside { 900.0 + noise } else { 100.0 + noise }
        });
    }
    let scene = |name: &str, more: &str| {
        described(&format!("[volume]\npath = \"{name}\"\n{more}\n"), folder.path())
    };
    for more in ["", "transfer = { name = \"viridis\" }", "transfer = { name = \"auto\" }"] {
        let (cold, _, cold_notes) = scene("cold.npy", more);
        let (hot, _, hot_notes) = scene("hot.npy", more);
        assert_eq!(cold_notes.len(), hot_notes.len(), "{more}: {hot_notes:?}");
        let [a, b] = [&cold, &hot].map(|scene| scale(&scene.media));
        assert!((a / b - 1.0).abs() < 0.02, "{more}: {a} and {b}");
        let [a, b] = [&cold, &hot]
            .map(|scene| scene.media.first().unwrap().medium.transfer.clone().unwrap().range()[1]);
        assert!((a / b - 1.0).abs() < 0.01, "{more}: {a} and {b}");
    }
    // With one bright voxel in smoke, the camera still sees all of the smoke.
    let smoke = |bright: f32| {
        let values = Array3::from_shape_fn((24, 24, 24), |(z, y, x)| egg([x, y, z], [24; 3]));
        let mut values = values;
        values[[12, 12, 12]] = bright;
        chosen(Volume::new("smoke", values, DMat4::IDENTITY).unwrap(), Surroundings::Studio)
    };
    let (calm, bright) = (smoke(1.0).camera, smoke(1e6).camera);
    assert!((calm.position - bright.position).length() < 0.5, "{bright:?} {calm:?}");
}

#[test]
fn hounsfield_units_are_known_and_their_presets_speak_them() {
    let folder = tempfile::tempdir().unwrap();
    // A head: air, tissue of 40, a shell of bone, two voxels of metal, and a scan's padding.
    let head = |metal: f32, padding: f32, [x, y, z]: [usize; 3]| {
        if [[9, 10, 10], [9, 9, 9]].contains(&[x, y, z]) {
            return metal;
        }
        if x == 0 {
            return padding;
        }
        let r = [x, y, z].map(|i| (i as f32 - 9.5).powi(2)).iter().sum::<f32>().sqrt();
        match r {
            r if r < 6.0 => 40.0,
            r if r < 7.0 => 900.0,
            r if r < 8.5 => 30.0,
            _ => -1000.0,
        }
    };
    let table = |name: &str| VolumeTable {
        path: Some(folder.path().join("v.npy")),
        transfer: Some(TransferTable { name: Some(name.to_owned()), ..TransferTable::default() }),
        ..VolumeTable::default()
    };
    for (metal, padding) in [(40.0, -1000.0), (30_000.0, -1024.0), (3071.0, -2048.0)] {
        write_npy(&folder.path().join("v.npy"), [20; 3], |at| head(metal, padding, at));
        let opacity = |name: &str, hounsfield: f64| {
            let (own, _) = load_ingredients(&table(name), true).unwrap();
            let by = f64::from(own.volume.moved_by());
            own.transfer.unwrap().at(hounsfield + by).1
        };
        assert_eq!([opacity("bone", 40.0), opacity("bone", 150.0)], [0.0, 0.0], "{metal}");
        assert!(opacity("bone", 300.0) > 0.2 && opacity("bone", 1500.0) > 0.9, "{metal}");
        assert!(opacity("tissue", 40.0) > 0.03 && opacity("tissue", -1000.0) == 0.0, "{metal}");
        assert!(opacity("skin", 0.0) > 0.9 && opacity("skin", -1000.0) == 0.0, "{metal}");
    }
    // Other numbers are not Hounsfield units, so the preset spans them.
    write_npy(&folder.path().join("v.npy"), [20; 3], |at| {
        (head(900.0, -1000.0, at) + 1000.0) / 8.0
    });
    let (own, _) = load_ingredients(&table("bone"), true).unwrap();
    let range = own.transfer.unwrap().range();
    assert!(range[0] >= 0.0 && (range[1] - 237.5).abs() < 1.0, "{range:?}");
}

#[test]
fn one_voxel_is_framed_with_its_edges() {
    let volume = Volume::new("dot", Array3::from_elem((1, 1, 1), 1.0), DMat4::IDENTITY).unwrap();
    let mut alone = Array3::zeros((3, 3, 3));
    alone[[1, 1, 1]] = 1.0;
    let alone = Volume::new("dot", alone, DMat4::IDENTITY).unwrap();
    for volume in [volume, alone] {
        let corners = volume.world_corners();
        let camera = chosen(volume, Surroundings::Studio).camera;
        let Projection::Perspective { fov_y_degrees } = camera.projection else { panic!() };
        let slope = (0.5 * fov_y_degrees.to_radians()).tan();
        let forward = (camera.target - camera.position).normalize();
        let (right, up) = frame_of(forward, camera.up);
        for corner in corners {
            // With three voxels, the outer half of each neighbour is empty.
            let way = DVec3::ONE
                + (corner - DVec3::ONE) * if corners[7].x > 1.0 { 2.0 / 3.0 } else { 1.0 };
            let way = way - camera.position;
            let (x, y) = (way.dot(right).abs(), way.dot(up).abs());
            assert!(x.max(y) < slope * way.dot(forward), "{corner}: {x}, {y}");
        }
    }
}

fn vdb(grids: Vec<(&str, TreeBuilder<f32>)>, path: &Path, class: &str) {
    let names: Vec<&str> = grids.iter().map(|(name, _)| *name).collect();
    let mut writer = VdbWriter::new(&names, Compression::BLOSC, &Metadata::default());
    for (_, tree) in grids {
        let grid = NewGrid::new(tree.finish().into(), &DMat4::IDENTITY).with_class(class);
        writer.add(grid).unwrap();
    }
    std::fs::write(path, writer.finish().unwrap()).unwrap();
}

#[test]
fn an_empty_grid_is_a_picture_without_medium() {
    let folder = tempfile::tempdir().unwrap();
    let mut full = TreeBuilder::new(0.0_f32);
    full.set(IVec3::ONE, 1.0, true);
    let grids = vec![("density", TreeBuilder::new(0.0)), ("heat", full)];
    vdb(grids, &folder.path().join("v.vdb"), "fog volume");
    let text = "[volume]\npath = \"v.vdb\"\n[image]\nwidth = 8\nheight = 8\n[shadow]\nsize = 8\n\
         [background]\nradiance = [0.25, 0.25, 0.25]\n[ground]\nenabled = false\n";
    let (scene, settings, notes) = described(text, folder.path());
    assert!(notes.iter().any(|note| note.contains("'heat' (`volume.grid`)")), "{notes:?}");
    for backend in every_backend() {
        let silent = deepshadow::progress::Silent;
        let image = backend.render(&scene, &settings, &silent).unwrap();
        assert!(image.pixels.iter().all(|pixel| (pixel[0] - 0.25).abs() < 1e-6));
    }
}

/// A tile covers thousands of blocks, and those at its faces are equal.
#[test]
fn a_large_tile_takes_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    let mut tree = TreeBuilder::new(0.0_f32);
    tree.fill(IndexBox { min: IVec3::ZERO, max: IVec3::splat(255) }, 0.5, true);
    let path = folder.path().join("v.vdb");
    vdb(vec![("density", tree)], &path, "fog volume");
    let volume = load_volume(&VolumeTable { path: Some(path), ..VolumeTable::default() }).unwrap();
    let Voxels::Sparse(blocks) = volume.voxels() else { panic!("dense") };
    assert!(volume.voxels().bytes() < 2 << 20, "{} bytes", volume.voxels().bytes());
    assert_eq!(blocks.dims(), [258; 3]);
    for (voxel, expected) in
        [([0, 9, 9], 0.0), ([1, 1, 1], 0.5), ([256, 256, 17], 0.5), ([257, 3, 3], 0.0)]
    {
        assert_eq!(blocks.get(voxel), expected, "{voxel:?}");
    }
    let sum: f64 = volume.column_integrals(DVec3::Y).iter().sum();
    assert_eq!(sum, 0.5 * 256.0_f64.powi(3));
}

#[test]
fn distances_without_their_class_are_said_to_be_such() {
    let folder = tempfile::tempdir().unwrap();
    let distance = |p: DVec3| (p - 8.0).length() as f32 - 4.3;
    let mut tree = TreeBuilder::new(2.0_f32);
    let inner = |i: usize| IVec3::new(i as i32 % 17, i as i32 / 17 % 17, i as i32 / 289);
    for at in (0..17 * 17 * 17).map(inner) {
        let value = distance(at.as_dvec3());
        if value.abs() < 2.0 {
            tree.set(at, value, true);
        }
    }
    vdb(vec![("surface", tree)], &folder.path().join("v.vdb"), "unknown");
    let whole = |[x, y, z]: [usize; 3]| distance(DVec3::new(x as f64, y as f64, z as f64));
    write_npy(&folder.path().join("v.npy"), [17; 3], whole);
    // Signed values that are not distances.
    write_npy(&folder.path().join("w.npy"), [17; 3], |at| whole(at).powi(3));
    // Distances may have another unit than the voxels' lengths.
    write_npy(&folder.path().join("u.npy"), [17; 3], |at| 40.0 * whole(at));
    for (name, said) in [("v.vdb", true), ("v.npy", true), ("u.npy", true), ("w.npy", false)] {
        let (_, _, notes) = described(&format!("[volume]\npath = \"{name}\"\n"), folder.path());
        let found = notes.iter().any(|note| note.contains("`volume.class = level-set`"));
        assert_eq!(found, said, "{name}: {notes:?}");
        let path = Some(folder.path().join(name));
        let class = Some("level-set".to_owned());
        let table = VolumeTable { path, class, ..VolumeTable::default() };
        let (own, notes) = load_ingredients(&table, true).unwrap();
        assert!(!notes.iter().any(|note| note.contains("`volume.class")), "{notes:?}");
        let middle = own.volume.world_from_index().inverse().transform_point3(DVec3::splat(8.0));
        let [x, y, z] = middle.to_array().map(|c| c.round() as usize);
        assert_eq!(own.volume.values()[[z, y, x]], if name == "v.vdb" { 0.0 } else { 1.0 });
    }
}
