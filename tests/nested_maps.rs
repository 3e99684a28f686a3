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

/// Errors of transmittance along texels' own rays.
fn errors(map: &CodedMap, scene: &Scene) -> Vec<f64> {
    let beam = scene.only_beam().unwrap();
    let exact = ExactTexels::new(&beam, SIZE);
    let farthest = beam.view.position.map_or(2.0, |_| 4.0);
    let mut random = Random(3);
    let at = |_| {
        let [x, y] = [(); 2].map(|()| (random.unit() * f64::from(SIZE)) as u32);
        let depth = random.unit() as f32 * farthest as f32;
        let [found, true_one] =
            [map.texel_transmittance(x, y, depth), exact.texel_transmittance(x, y, depth)];
        f64::from(found - true_one)
    };
    (0..40_000).map(at).collect()
}

/// Knots are chosen anew on the device, so codes differ; their errors do not. The lists that are
/// coded add the square of their tolerance at most.
#[test]
fn codes_of_a_gpu_are_as_exact_as_those_of_the_processor() {
    let Some(gpu) = gpu() else { return };
    for (name, scene) in scenes() {
        let of = |backend: &dyn Backend, density: f64| {
            let mut bent = scene.clone();
            bent.media.medium_mut().density_scale *= density;
            errors(&coded(backend, &bent, &nested()), &scene)
        };
        let [own, other, bent] = [of(&CpuBackend, 1.0), of(&*gpu, 1.0), of(&*gpu, 1.05)];
        let largest = 1.05 * rms(own.iter().copied()).hypot(5e-4);
        let found = rms(other);
        assert!(found < largest, "{name}: {found}, not {largest}");
        // Of other codes, or of the wrong texel, it would be far more.
        let found = rms(bent);
        assert!(name == "thin rods" || found > largest, "{name}: {found}");
        // One per cent is less than codes err at single points, but not in the mean, of which three
        // deviations are allowed: errors of texels have nothing to do with each other, and those of
        // the two encoders little. Errors of lists are spread evenly within their tolerance.
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        let off = |density: f64| (mean(&of(&*gpu, density)) - mean(&own)).abs();
        let both = rms(own.iter().copied()).hypot(5e-4 / 3.0_f64.sqrt()) * 2.0_f64.sqrt();
        let limit = 3.0 * both / f64::from(SIZE);
        let (found, bent) = (off(1.0), off(1.01));
        assert!(found < limit, "{name}: {found}, not {limit}");
        assert!(bent > limit, "{name}: {limit} says nothing of {bent}");
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
