//! Maps of nested knots that a GPU codes and looks up.
#![cfg(feature = "gpu")]

use deepshadow::accuracy::ExactTexels;
use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::progress::Silent;
use deepshadow::scene::{LightKind, Scene};
use deepshadow::settings::{Coding, MapKind, Settings};
use deepshadow::shadow::{CodedMap, Map, TexelMap};
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::answers::{Bound, Weights, picture_bound};
use crate::support::backends::{gpu, interpolates_in_f32};
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};
use crate::support::{Random, rms};

const NESTED: MapKind = MapKind::Coded(Coding::Nested);
const SIZE: u32 = 48;

fn nested() -> Settings {
    settings(SIZE, [40, 32]).with(|s| s.map.kind = Some(NESTED))
}

/// Thin and thick, with jumps and without, and a light with a position.
fn scenes() -> Vec<(&'static str, Scene)> {
    let noise = volume([9, 17, 5], unit_cube(), |[x, y, z]| ((x * y + 3 * z) % 7) as f32 * 0.317);
    let mut near = anchor_scene(Preset::Box, 5.0, SIZE);
    near.lights[0].kind = LightKind::Point { position: DVec3::new(0.9, 1.6, 0.7) };
    vec![
        ("bucky", anchor_scene(Preset::Bucky, 6.0, SIZE)),
        ("dense rods", anchor_scene(Preset::Rods, 200.0, SIZE)),
        ("thin rods", anchor_scene(Preset::Rods, 0.05, SIZE)),
        ("noise", scene(noise, 2.0)),
        ("point light", near),
    ]
}

fn coded(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> CodedMap {
    let beam = scene.only_beam().unwrap();
    match backend.map(&beam, settings, &Silent).unwrap() {
        Map::Coded(map) => map,
        other => panic!("{other:?}"),
    }
}

/// RMS error of transmittance along texels' own rays.
fn error(map: &CodedMap, scene: &Scene) -> f64 {
    let beam = scene.only_beam().unwrap();
    let exact = ExactTexels::new(&beam, SIZE);
    let farthest = beam.view.position.map_or(2.0, |_| 4.0);
    let mut random = Random(3);
    rms((0..40_000).map(|_| {
        let [x, y] = [(); 2].map(|()| (random.unit() * f64::from(SIZE)) as u32);
        let depth = random.unit() as f32 * farthest as f32;
        let [found, true_one] =
            [map.texel_transmittance(x, y, depth), exact.texel_transmittance(x, y, depth)];
        f64::from(found - true_one)
    }))
}

/// Knots are chosen anew on the device, so codes differ; their errors do not. The lists that are
/// coded add the square of their tolerance at most.
#[test]
fn codes_of_a_gpu_are_as_exact_as_those_of_the_processor() {
    let Some(gpu) = gpu() else { return };
    for (name, scene) in scenes() {
        let [own, other] = [&CpuBackend as &dyn Backend, &*gpu]
            .map(|b| error(&coded(b, &scene, &nested()), &scene));
        assert!(other < 1.05 * own.hypot(5e-4), "{name}: {other}, not {own}");
        // Of other codes, or of the wrong texel, it would be far more.
        let mut shifted = scene.clone();
        shifted.media.medium_mut().density_scale *= 1.05;
        let bent = error(&coded(&*gpu, &shifted, &nested()), &scene);
        assert!(name == "thin rods" || bent > 1.05 * own.hypot(5e-4), "{name}: {bent}");
    }
}

/// The processor's codes, looked up by both: nothing but rounding lies between the pictures, and
/// hardware's weights of voxels. One per cent of density does not pass.
#[test]
fn both_backends_read_the_same_codes() {
    let Some(gpu) = gpu() else { return };
    let exact = interpolates_in_f32(&*gpu);
    let device = if exact { Weights::F32 } else { Weights::EightBit };
    for (name, scene) in scenes() {
        let numbers = |backend: &dyn Backend, scene: &Scene| {
            let (settings, beam) = (nested(), scene.only_beam().unwrap());
            let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
            let image = backend.view(&beam, &settings, &map, &Silent).unwrap();
            image.pixels.iter().flatten().map(|&v| f64::from(v)).collect::<Vec<f64>>()
        };
        let own = numbers(&CpuBackend, &scene);
        let mut thicker = scene.clone();
        thicker.media.medium_mut().density_scale *= 1.01;
        let bent = Bound::of(&own, &numbers(&CpuBackend, &thicker), 0.0);
        for weights in [Weights::F32, Weights::EightBit] {
            let limit = picture_bound(&own, weights, |bent| numbers(bent, &scene));
            assert!(!limit.holds(bent), "{name}: {limit:?} says nothing of {bent:?}");
            let found = Bound::of(&own, &numbers(&*gpu, &scene), 0.0);
            assert!(weights != device || limit.holds(found), "{name}: {found:?}, not {limit:?}");
        }
    }
}

/// Maps that are made in parts of rows are the same.
#[test]
fn little_memory_changes_no_code() {
    let Some(gpu) = gpu() else { return };
    let (_, scene) = scenes().swap_remove(0);
    let usual = nested().with(|s| s.map.size = 128);
    let little = usual.with(|s| s.map.fragments.memory = 1 << 20);
    let [whole, parts] = [usual, little].map(|settings| coded(&*gpu, &scene, &settings));
    assert_eq!(whole.texels(), parts.texels());
    assert!(whole.texels().iter().any(|&byte| byte != 0));
}
