//! Scenes for tests.

use std::sync::Arc;

use deepshadow::accuracy::largest_optical_depth;
use deepshadow::math::Aabb;
use deepshadow::scene::{Camera, Light, LightKind, Media, Medium, Scene};
use deepshadow::settings::Settings;
use deepshadow::volume::presets::Preset;
use deepshadow::volume::{Axis, Volume, world_from_index_in_bounds};
use glam::DVec3;
use ndarray::Array3;

/// The light of the published figures, in index axes (z up).
pub const ANCHOR_LIGHT: DVec3 = DVec3::new(0.5, 0.3, -0.81);

/// A volume in `bounds` with the given density at each voxel (x, y, z).
pub fn volume(
    dims: [usize; 3],
    bounds: Aabb,
    mut density: impl FnMut([usize; 3]) -> f32,
) -> Volume {
    let [nx, ny, nz] = dims;
    let values = Array3::from_shape_fn((nz, ny, nx), |(z, y, x)| density([x, y, z]));
    let placement = world_from_index_in_bounds(dims, &bounds, Axis::Y).unwrap();
    Volume::new("test", values, placement).unwrap()
}

/// The cube around the origin with edges of length 1.
pub fn unit_cube() -> Aabb {
    Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) }
}

/// A white medium lit from above, seen from the front, without surroundings.
pub fn scene(volume: Volume, density_scale: f64) -> Scene {
    let direction = DVec3::new(0.597_614_3, -0.717_137_2, -0.358_568_6);
    let media = Media::of(Arc::new(volume), Medium::new(density_scale));
    let (eye, target) = (DVec3::new(0.0, 0.55, 2.0), DVec3::new(0.0, -0.1, 0.0));
    let camera = Camera::perspective(eye, target, 45.0);
    Scene::new(media, vec![Light::directional(direction)], camera)
}

/// A preset under the anchors' light, scaled such that the largest optical depth over a map of
/// `map_size` squared texels is `largest`.
pub fn anchor_scene(preset: Preset, largest: f64, map_size: u32) -> Scene {
    let mut scene = scene(preset.volume(Axis::Z).unwrap(), 1.0);
    scene.lights[0].kind =
        LightKind::Directional { direction: Axis::Z.world_from_file() * ANCHOR_LIGHT };
    let deepest = largest_optical_depth(&scene.only_beam().unwrap(), map_size);
    scene.media.medium_mut().density_scale = largest / deepest;
    scene
}

/// Settings with small maps and pictures.
pub fn settings(map_size: u32, image_size: [u32; 2]) -> Settings {
    Settings::default().with(|s| {
        s.map.size = map_size;
        s.image.size = image_size;
        // Pixels are compared one by one.
        s.image.tolerance = 0.0;
    })
}
