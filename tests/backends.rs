//! One answer from every backend: the same bodies on CPU and GPU, against the reference and against
//! each other. A missing adapter fails, unless DEEPSHADOW_TEST_GPU=skip says that there is none.

use std::sync::Arc;

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::image::Image;
use deepshadow::math::Aabb;
use deepshadow::progress::Silent;
use deepshadow::reference::brute_force_image;
use deepshadow::scene::transfer::preset;
use deepshadow::scene::{Body, Emission, Ground, LightKind, Media, Medium, Projection, Scene};
use deepshadow::settings::{Crossing, Filter, Lookup, MapKind, Settings, Shading, Slices};
use deepshadow::shadow::Shadow;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::answers::{Answers, Weights, bounds};
use crate::support::backends::{Bent, every_backend, gpu, interpolates_in_f32};
use crate::support::rms;
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};

/// Of fits: so small that one percent of density stands out.
const TOLERANCE: f64 = 5e-4;

/// Steps, texels and the four numbers stand between a picture and brute force.
const TRUTH_RMS: f64 = 6e-3;

/// Scenes that between them use every branch of the passes.
fn scenes() -> Vec<(&'static str, Scene, Settings)> {
    let base = settings(48, [40, 32]).with(|s| s.map.kind = Some(MapKind::Threshold));
    let fragments = base.with(|s| {
        s.map.kind = Some(MapKind::Fragments);
        s.map.fragments.tolerance = TOLERANCE;
    });
    let ground = Ground::new(-0.6, 0.3).within(1.5);
    let mut lit = anchor_scene(Preset::Bucky, 6.0, 32);
    lit.ground = Some(ground);
    lit.ambient = DVec3::new(0.1, 0.2, 0.3);
    let mut endless = anchor_scene(Preset::Rods, 12.0, 32);
    endless.ground = Some(Ground::new(ground.height, ground.albedo));
    endless.media.medium_mut().phase_g = 0.6;
    endless.media.medium_mut().albedo = DVec3::new(1.0, 0.6, 0.2);
    let mut point = anchor_scene(Preset::Box, 5.0, 32);
    point.lights[0].kind = LightKind::Point { position: DVec3::new(0.9, 1.6, 0.7) };
    point.ground = Some(ground);
    let mut headlight = point.clone();
    headlight.lights[0].kind = LightKind::Point { position: point.camera.position };
    let mut spot = point.clone();
    spot.lights[0].kind = LightKind::Spot {
        position: DVec3::new(-0.9, 1.6, 0.7),
        direction: DVec3::new(0.45, -0.8, -0.3),
        cone_degrees: 20.0,
        cone_softness: 0.5,
    };
    spot.camera.projection = Projection::Orthographic { height: 2.0 };
    spot.background = None;
    let floats = volume([9, 17, 5], unit_cube(), |[x, y, z]| ((x * y + 3 * z) % 7) as f32 * 0.317);
    let floats = scene(floats, 2.0);
    let paper = base.with(|s| {
        s.map.threshold.lookup = Lookup::Paper;
        s.map.threshold.crossing = Crossing::Smoothstep;
        s.view.shading = Shading::Paper;
    });
    let coarse = base.with(|s| {
        s.map.threshold.crossing = Crossing::Bucket;
        s.map.filter = Filter::Nearest;
        s.image.samples = 3;
        s.view.steps = Some(40);
        s.map.steps = 100;
        s.map.threshold.levels = [0.2, 0.4, 0.7];
    });
    let planes = fragments.with(|s| {
        s.map.fragments.slices = Slices::Raster;
        s.map.fragments.tolerance = 0.0;
        s.map.filter = Filter::Pcf5;
    });
    let linked = planes.with(|s| s.map.fragments.links = Some(true));
    let fitted_planes = fragments.with(|s| {
        s.map.fragments.slices = Slices::Planes;
        s.map.filter = Filter::Edsm3;
    });
    let mut mixed = lit.clone();
    mixed.media = mixture();
    mixed.lights.push(point.lights[0]);
    let octaves = fragments.with(|s| s.view.octaves = 2);
    vec![
        ("mixture, two lights, fragments", mixed.clone(), octaves),
        ("mixture, two lights", mixed, base.clone()),
        ("bucky, fragments", lit.clone(), fragments.clone()),
        ("box, point light, fragments", point.clone(), fragments.clone()),
        ("box, light at the camera, fragments", headlight, fragments.clone()),
        (
            "rods, raw fragments",
            endless.clone(),
            fragments.with(|s| s.map.fragments.tolerance = 0.0),
        ),
        ("bucky, drawn planes, pcf along links", lit.clone(), linked),
        ("box, point light, drawn planes", point.clone(), planes),
        ("f32 voxels, planes, edsm", floats.clone(), fitted_planes),
        ("bucky, ground, ambient", lit.clone(), base.clone()),
        ("rods, endless ground, phase", endless, base.clone()),
        ("box, point light", point, base.clone()),
        ("box, spot light, orthographic", spot, base.clone()),
        ("f32 voxels", floats, base),
        ("bucky, the paper's ways", lit.clone(), paper),
        ("bucky, coarse ways", lit, coarse),
    ]
}

/// Two bodies with all that a medium can have: transfer function, colour, modulation, emission,
/// tint.
fn mixture() -> Media {
    let grid = |seed: usize| {
        Arc::new(volume([7, 9, 8], unit_cube(), |[x, y, z]| ((x * y + seed * z) % 6) as f32 / 5.0))
    };
    let fire = Emission::new(Arc::new(preset("fire").unwrap()), 0.4);
    let colors = Medium::new(6.0).with(|medium| {
        medium.albedo = DVec3::new(0.9, 0.8, 1.0);
        medium.phase_g = 0.3;
        medium.transfer = Some(Arc::new(preset("inferno").unwrap()));
        medium.color = Some([grid(1), grid(2), grid(3)]);
        medium.emission = Some(fire.over(grid(4)));
    });
    let tinted = Medium::new(4.0).with(|medium| {
        medium.tint = DVec3::new(0.2, 1.0, 1.5);
        medium.modulation = Some(grid(2));
    });
    let bounds = Aabb { min: DVec3::new(-0.3, -0.2, -0.5), max: DVec3::new(0.7, 0.6, 0.4) };
    let second = Arc::new(volume([5, 6, 4], bounds, |[x, y, z]| ((x + y + z) % 3) as f32 * 0.5));
    let bodies = vec![Body::new(grid(5), colors), Body::new(second, tinted)];
    Media::new(bodies)
}

fn image_differences(a: &Image, b: &Image) -> Vec<f64> {
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    pairs.map(|(a, b)| f64::from(a - b)).collect()
}

/// Whether a backend's maps and pictures are the CPU's, within the bounds, though all its densities
/// are `bent` by a factor; says what is not.
fn agrees_with_the_cpu(backend: &dyn Backend, bent: f64) -> Vec<String> {
    let mut complaints = Vec::new();
    let exact = interpolates_in_f32(backend);
    let weights = if exact { Weights::F32 } else { Weights::EightBit };
    for (name, scene, settings) in scenes() {
        let cpu = Answers::of(&CpuBackend, &scene, &settings);
        let mut bent_scene = scene.clone();
        bent_scene.media.mediums_mut().for_each(|medium| medium.density_scale *= bent);
        let own = Answers::of(backend, &bent_scene, &settings);
        let (allowed, spared) = bounds(&scene, &settings, &cpu, weights);
        let found = cpu.differences(&own, spared);
        for ((what, allowed), found) in ["map", "picture"].into_iter().zip(allowed).zip(found) {
            let said = format!(
                "{name}: {what} {:.1e} of {:.1e}, rms {:.1e} of {:.1e}",
                found.largest, allowed.largest, found.rms, allowed.rms
            );
            eprintln!("{said}");
            if !allowed.holds(found) {
                complaints.push(said);
            }
        }
    }
    complaints
}

/// Those of scenes in which nobody complains.
fn unnoticed(complaints: &[String]) -> Vec<&'static str> {
    let names = scenes().into_iter().map(|(name, ..)| name);
    let noticed = |name: &str| complaints.iter().any(|c| c.starts_with(&format!("{name}:")));
    names.filter(|name| !noticed(name)).collect()
}

#[test]
fn the_gpu_gives_the_cpus_answers_and_one_percent_is_noticed() {
    if let Some(gpu) = gpu() {
        let complaints = agrees_with_the_cpu(&*gpu, 1.0);
        assert!(complaints.is_empty(), "{complaints:#?}");
        let complaints = agrees_with_the_cpu(&*gpu, 1.01);
        assert_eq!(unnoticed(&complaints), Vec::<&str>::new());
    }
}

/// Within the bounds for graphics hardware, too, which a machine without any can tell.
#[test]
fn one_percent_of_density_is_noticed_in_every_scene() {
    for backend in [Bent::Exact, Bent::EightBit] {
        let complaints = agrees_with_the_cpu(&backend, 1.01);
        assert_eq!(unnoticed(&complaints), Vec::<&str>::new(), "{}", backend.description());
        let unbent = agrees_with_the_cpu(&backend, 1.0);
        assert!(unbent.is_empty(), "an unbent one is the CPU itself: {unbent:#?}");
    }
}

#[test]
fn pictures_converge_to_brute_force() {
    for preset in [Preset::Box, Preset::Bucky, Preset::Rods] {
        let mut scene = anchor_scene(preset, 8.0, 64);
        scene.ground = Some(Ground::new(-0.55, 0.3));
        let truth = brute_force_image(&scene, [40, 32], 2).unwrap();
        for backend in every_backend() {
            let image = backend.render(&scene, &settings(128, [40, 32]), &Silent).unwrap();
            let error = rms(image_differences(&image, &truth));
            eprintln!("{} on {}: RMSE {error:.1e}", preset.name(), backend.description());
            assert!(error < TRUTH_RMS, "{} on {}: {error}", preset.name(), backend.description());
        }
    }
}

/// Every kind of light, phase, albedo, ambient light and ground against the reference, which shares
/// no arithmetic with either backend.
#[test]
fn every_scene_is_what_brute_force_says() {
    for (name, scene, settings) in scenes() {
        // The paper's shading, exponential tests and three rays a pixel are something else.
        let exponential = settings.map.filter.window().1;
        let plain = scene.media.plain().is_some();
        if settings.view.shading == Shading::Paper
            || settings.image.samples != 1
            || exponential
            || !plain
        {
            continue;
        }
        let settings = settings.with(|s| s.map.size = 128);
        let truth = brute_force_image(&scene, settings.image.size, 2).unwrap();
        for backend in every_backend() {
            let image = backend.render(&scene, &settings, &Silent).unwrap();
            let lit = truth.pixels.iter().zip(&image.pixels);
            let lit = lit.filter(|(truth, image)| truth[3] > 0.0 || image[3] > 0.0);
            let relative = lit.flat_map(|(truth, image)| {
                (0..3).map(|c| f64::from(image[c] - truth[c])).collect::<Vec<_>>()
            });
            let error = rms(relative);
            let brightness = rms(truth.pixels.iter().map(|p| f64::from(p[1])));
            eprintln!("{name} on {}: RMSE {error:.1e} of {brightness:.1e}", backend.description());
            assert!(error < 0.02 * brightness.max(0.1), "{name}: {error} of {brightness}");
        }
    }
}

/// With g = 0.6 a thin medium seen against the light is ((1 + g) / (1 - g))^3 = 64 times as bright
/// as seen with it.
#[test]
fn light_is_scattered_forwards_for_positive_g() {
    let mut thin = scene(volume([4; 3], unit_cube(), |_| 1.0), 1e-3);
    thin.media.medium_mut().phase_g = 0.6;
    thin.background = None;
    thin.camera.target = DVec3::ZERO;
    thin.camera.projection = Projection::Orthographic { height: 0.5 };
    for backend in every_backend() {
        let seen = [-1.0, 1.0].map(|side| {
            let mut scene = thin.clone();
            scene.camera.position = DVec3::new(0.0, 0.0, 3.0);
            scene.lights[0].kind =
                LightKind::Directional { direction: DVec3::new(0.0, 0.0, -side) };
            let image = backend.render(&scene, &settings(8, [4, 4]), &Silent).unwrap();
            image.pixel(2, 2)[0]
        });
        // Side -1: light travels towards the camera.
        let ratio = seen[0] / seen[1];
        assert!((ratio / 64.0 - 1.0).abs() < 1e-2, "{}: {seen:?}", backend.description());
    }
}

#[test]
fn nothing_lies_in_the_shadow_of_an_empty_volume() {
    let mut empty = scene(volume([4; 3], unit_cube(), |_| 0.0), 3.0);
    empty.ground = Some(Ground::new(-0.55, 0.5));
    for backend in every_backend() {
        let image = backend.render(&empty, &settings(16, [16, 16]), &Silent).unwrap();
        let map =
            backend.map(&empty.only_beam().unwrap(), &settings(16, [16, 16]), &Silent).unwrap();
        assert_eq!(map.lookup(1, 0.5, 0.5, 1e3), 1.0);
        let lit =
            0.5 / std::f32::consts::PI * 4.0 * std::f32::consts::PI * 0.717_137_2 / 1.000_000_1;
        let lowest_row = &image.pixels[16 * 15..];
        for pixel in lowest_row {
            assert!(
                (pixel[0] - lit).abs() < 1e-3,
                "{}: {pixel:?}, not {lit}",
                backend.description()
            );
        }
    }
}

/// Behind a wholly opaque volume nothing is left; beside it, everything.
#[test]
fn an_opaque_volume_casts_a_full_shadow_and_nothing_beside_it() {
    let mut opaque = scene(volume([4; 3], unit_cube(), |_| 1.0), 1e4);
    opaque.lights[0].kind = LightKind::Directional { direction: DVec3::NEG_Y };
    for backend in every_backend() {
        let map =
            backend.map(&opaque.only_beam().unwrap(), &settings(32, [8, 8]), &Silent).unwrap();
        let shadow = |p: DVec3| {
            let light = map.view().coordinates(p).unwrap().as_vec3();
            map.lookup(0, light.x, light.y, light.z)
        };
        for x in [-0.49, 0.0, 0.3, 0.49] {
            assert!(shadow(DVec3::new(x, -2.0, 0.1)) < 1e-5, "behind, at {x}");
            assert!(shadow(DVec3::new(x, 0.6, 0.1)) > 1.0 - 1e-5, "in front, at {x}");
        }
        assert_eq!(shadow(DVec3::new(0.51, -2.0, 0.1)), 1.0, "beside");
    }
}
