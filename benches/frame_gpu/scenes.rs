//! The scenes: the presets as shipped, and close views of them and of clouds.

use std::path::Path;

use deepshadow::gpu::Renderer;
use deepshadow::io::load_volume;
use deepshadow::math::Aabb;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{LightKind, LightView, Media, Projection, Scene, SceneFile, descriptor};
use deepshadow::settings::Settings;
use deepshadow::volume::Volume;
use deepshadow::volume::presets::Preset;
use glam::{DMat4, DVec3};

use crate::bench::{Bench, size};
use crate::cloud::cloud;

/// Smallest share of the picture that the volume covers in close views.
const COVERED: f64 = 0.62;

/// Creates a scene on the device.
pub type Make = Box<dyn Fn(&Renderer) -> Bench<'_>>;

/// A preset with the automatically chosen camera.
pub fn preset(gpu: &Renderer, preset: Preset) -> Bench<'_> {
    let (scene, settings) = shipped(preset);
    Bench::new(gpu, preset.name().to_owned(), scene, &settings)
}

/// The scenes of table frame, which are created one by one because they are large.
pub fn close() -> Vec<Make> {
    let presets = Preset::ALL.into_iter().map(|preset| -> Make {
        Box::new(move |gpu| {
            let (scene, settings) = shipped(preset);
            Bench::new(gpu, preset.name().to_owned(), closer(scene), &settings)
        })
    });
    let edges: [usize; 2] = if size() < 512 { [64, 128] } else { [256, 512] };
    let clouds = edges.into_iter().map(|n| -> Make {
        Box::new(move |gpu| {
            let (volume, density_scale) = cloud(n);
            let name = volume.name.clone();
            let text = format!("[volume]\ndensity_scale = {density_scale:?}\n");
            let file = SceneFile::parse(&text, Path::new(&name)).unwrap();
            let (scene, settings) = completed(&file, volume);
            Bench::new(gpu, name, closer(scene), &settings)
        })
    });
    presets.chain(clouds).collect()
}

/// Number of rays, of a map of `size` squared texels, that hit the volume's box.
pub fn map_rays(scene: &Scene, view: &LightView, size: u32) -> u32 {
    hits(&scene.media, size, |x, y| view.ray(x, y))
}

/// The same for a picture of `size` squared pixels.
pub fn picture_rays(scene: &Scene, size: u32) -> u32 {
    let rays = scene.camera.rays(1.0);
    hits(&scene.media, size, |x, y| rays.ray(x, y))
}

fn shipped(preset: Preset) -> (Scene, Settings) {
    let file = descriptor(preset).unwrap();
    let volume = load_volume(&file.volume[0]).unwrap();
    completed(&file, volume)
}

fn completed(file: &SceneFile, volume: Volume) -> (Scene, Settings) {
    let (scene, settings, _) = complete(file, vec![volume.into()], Surroundings::Studio).unwrap();
    assert!(matches!(scene.lights[0].kind, LightKind::Directional { .. }));
    (scene, settings)
}

/// The scene with such a long lens that the volume covers enough of the picture.
fn closer(mut scene: Scene) -> Scene {
    scene.camera.target = scene.media.world_bounds().center();
    let probes = 128;
    while f64::from(picture_rays(&scene, probes)) < COVERED * f64::from(probes * probes) {
        match &mut scene.camera.projection {
            Projection::Perspective { fov_y_degrees } => *fov_y_degrees *= 0.97,
            Projection::Orthographic { height } => *height *= 0.97,
            _ => return scene,
        }
    }
    scene
}

fn hits(media: &Media, size: u32, ray: impl Fn(f64, f64) -> (DVec3, DVec3)) -> u32 {
    let index_from_world: DMat4 = media.world_from_index().inverse();
    let domain: Aabb = media.domain();
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    let hit = |x: u32, y: u32| {
        let (origin, direction) = ray(at(x), at(y));
        let origin = index_from_world.transform_point3(origin);
        domain.intersect(origin, index_from_world.transform_vector3(direction)).is_some()
    };
    (0..size).map(|y| (0..size).map(|x| u32::from(hit(x, y))).sum::<u32>()).sum()
}
