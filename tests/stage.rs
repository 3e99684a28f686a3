//! Tests of pictures one after another: what a stage keeps equals what would be made anew, and a
//! GPU reads back only pictures.

use std::sync::Arc;

use deepshadow::backend::{Passes, ShadowCatcher, Stage};
use deepshadow::image::Image;
use deepshadow::progress::Silent;
use deepshadow::scene::transfer::TransferPoint;
use deepshadow::scene::{Emission, Ground, Light, LightKind, Media, Scene, TransferFunction};
use deepshadow::settings::{Coding, Filter, MapKind, Settings, Shading};
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::backends::every_backend;
use crate::support::scenes::{anchor_scene, settings};

/// A sequence of scenes and settings: the camera moves, the light moves, a medium gets denser, a
/// light is added, extinction becomes coloured, and everything returns to the start.
fn shots() -> Vec<(Scene, Settings)> {
    let usual = settings(24, [20, 16]).with(|s| s.map.kind = Some(MapKind::Fragments));
    let first = anchor_scene(Preset::Bucky, 4.0, 24);
    let mut turned = first.clone();
    turned.camera.position = DVec3::new(1.5, 0.4, -1.2);
    let mut relit = turned.clone();
    relit.lights[0].kind = LightKind::Directional { direction: DVec3::new(0.2, -1.0, 0.3) };
    let mut thicker = relit.clone();
    thicker.media.medium_mut().density_scale *= 2.0;
    let mut two = thicker.clone();
    let position = DVec3::new(1.5, 1.0, 1.0);
    two.lights.push(Light::new(LightKind::Point { position }, two.lights[0].irradiance));
    let mut tinted = two.clone();
    tinted.media.medium_mut().tint = DVec3::new(0.5, 1.0, 1.5);
    let threshold = usual.with(|s| s.map.kind = Some(MapKind::Threshold));
    let nested = usual.with(|s| s.map.kind = Some(MapKind::Coded(Coding::Nested)));
    let wide = usual.with(|s| s.map.filter = Filter::Pcf3);
    let finer = usual.with(|s| s.map.size = 40);
    let paper = threshold.with(|s| s.view.shading = Shading::Paper);
    let larger = usual.with(|s| s.image.size = [24, 24]);
    vec![
        (first.clone(), usual.clone()),
        (turned, usual.clone()),
        (relit, usual.clone()),
        (thicker, usual.clone()),
        (two, usual.clone()),
        (tinted.clone(), usual.clone()),
        (tinted.clone(), threshold.clone()),
        (tinted, nested.clone()),
        (first.clone(), nested),
        (first.clone(), threshold),
        (first.clone(), paper),
        (first.clone(), wide),
        (first.clone(), finer),
        (first.clone(), larger),
        (first, usual),
    ]
}

#[test]
fn a_stage_makes_the_pictures_that_are_made_alone() {
    for backend in every_backend() {
        let mut stage = backend.stage();
        for (i, (scene, settings)) in shots().iter().enumerate() {
            let kept = stage.render(scene, settings, &Silent).unwrap();
            let again = stage.render(scene, settings, &Silent).unwrap();
            let alone = backend.render(scene, settings, &Silent).unwrap();
            assert!(kept == alone, "picture {i} on {}", backend.description());
            assert!(again == alone, "picture {i} again on {}", backend.description());
        }
    }
}

/// The sum of the beams' pictures equals the host's sum, up to rounding.
#[test]
fn pictures_of_beams_add_up() {
    for backend in every_backend() {
        for (scene, settings) in shots() {
            let [width, height] = settings.image.size;
            let mut sum = Image::filled(width, height, [0.0; 4]);
            for beam in scene.beams_for(&settings).unwrap() {
                let map = backend.map(&beam, &settings, &Silent).unwrap();
                beam.add(&backend.view(&beam, &settings, &map, &Silent).unwrap(), &mut sum);
            }
            let picture = backend.render(&scene, &settings, &Silent).unwrap();
            let pairs = picture.pixels.iter().flatten().zip(sum.pixels.iter().flatten());
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 2e-6, "{}: {worst}", backend.description());
        }
    }
}

#[cfg(feature = "gpu")]
mod gpu {
    use deepshadow::backend::Backend;
    use deepshadow::gpu::{AdapterChoice, GpuBackend};

    use super::*;
    use crate::support::scenes::{scene, unit_cube, volume};

    fn device() -> Option<GpuBackend> {
        crate::support::backends::gpu()?;
        Some(GpuBackend::open(AdapterChoice::Any).unwrap())
    }

    #[test]
    fn one_readback_a_picture() {
        let Some(backend) = device() else { return };
        let mut stage = backend.stage();
        for (i, (scene, settings)) in shots().iter().enumerate() {
            let before = backend.renderer().readbacks();
            stage.render(scene, settings, &Silent).unwrap();
            assert_eq!(backend.renderer().readbacks() - before, 1, "picture {i}");
        }
    }

    /// Lists that exceed their capacity are built again, completely.
    #[test]
    fn lists_of_any_length_are_whole() {
        let Some(backend) = device() else { return };
        let noise = |[x, y, z]: [usize; 3]| ((x * 7 + y * 13 + z * 31) % 5) as f32;
        let scene = scene(volume([9, 11, 48], unit_cube(), noise), 1.5);
        let beam = scene.only_beam().unwrap();
        let mut stage = backend.stage();
        for (tolerance, quality) in [(1e-6, 1.0), (0.0, 2.0)] {
            let settings = settings(24, [20, 16]).with(|s| {
                s.map.kind = Some(MapKind::Fragments);
                s.map.fragments.tolerance = tolerance;
                s.quality = quality;
            });
            let map = backend.map(&beam, &settings, &Silent).unwrap();
            let runs = map.as_fragments().unwrap().runs();
            let longest = (0..runs.texels()).map(|texel| runs.of(texel).len()).max().unwrap();
            assert!(longest > 40, "{longest} nodes are few");
            let expected = backend.view(&beam, &settings, &map, &Silent).unwrap();
            // A picture that cannot be made leaves nothing behind that affects the next one.
            let coded = Some(MapKind::Coded(Coding::Relative));
            let unbuilt = settings.with(|s| s.map.kind = coded);
            assert!(stage.render(&scene, &unbuilt, &Silent).is_err());
            assert!(stage.render(&scene, &settings, &Silent).unwrap() == expected, "{tolerance}");
            assert!(backend.render(&scene, &settings, &Silent).unwrap() == expected, "{tolerance}");
        }
    }
}

/// One march for all channels sees what one march a channel sees. Each map errs by at most its
/// tolerance, which quality 4 divides by 16, and a channel with half of another's extinction by a
/// part of that.
#[test]
fn channels_may_share_maps_and_rays() {
    let usual = settings(48, [40, 32]).with(|s| s.quality = 4.0);
    let mut scene = anchor_scene(Preset::Bucky, 3.0, 24);
    scene.ground = Some(Ground::new(-0.6, 0.4));
    scene.ambient = DVec3::splat(0.2);
    scene.media.medium_mut().tint = DVec3::new(0.6, 1.0, 1.9);
    let mut glowing = scene.clone();
    let points = [(0.0, DVec3::ZERO, 0.0), (1.0, DVec3::new(1.0, 0.6, 0.2), 1.0)];
    let points = points.map(|(value, color, opacity)| TransferPoint { value, color, opacity });
    let ramp = Arc::new(TransferFunction::new(points.to_vec()).unwrap());
    glowing.media.medium_mut().emission = Some(Emission::new(ramp, 2.0));
    let octaves = usual.with(|s| s.view.octaves = 2);
    let mut bent = scene.clone();
    bent.media.medium_mut().density_scale *= 1.01;
    let apart = |backend: &dyn Passes, scene: &Scene, settings: &Settings| {
        let [width, height] = settings.image.size;
        let mut sum = Image::filled(width, height, [0.0; 4]);
        for beam in scene.beams().unwrap() {
            let map = backend.map(&beam, settings, &Silent).unwrap();
            beam.add(&backend.view(&beam, settings, &map, &Silent).unwrap(), &mut sum);
        }
        sum
    };
    let worst = |a: &Image, b: &Image| {
        let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    for backend in every_backend() {
        for (scene, settings) in [(&scene, &usual), (&glowing, &usual), (&scene, &octaves)] {
            assert_eq!(scene.beams_for(settings).unwrap().len(), 1);
            let together = backend.render(scene, settings, &Silent).unwrap();
            let found = worst(&together, &apart(&*backend, scene, settings));
            assert!(found < 1e-3, "{}: {found}", backend.description());
        }
        let bent = backend.render(&bent, &usual, &Silent).unwrap();
        let found = worst(&bent, &apart(&*backend, &scene, &usual));
        assert!(found > 2e-3, "one percent of density makes {found}");
    }
    // Tints that differ, and extreme ones, have a beam for each channel.
    scene.media.medium_mut().tint = DVec3::new(0.01, 1.0, 1.0);
    assert_eq!(scene.beams_for(&usual).unwrap().len(), 3);
    scene.media.medium_mut().tint = DVec3::new(0.0, 1.0, 1.0);
    assert_eq!(scene.beams_for(&usual).unwrap().len(), 3);
}

/// A picture with a caught shadow, in front of a picture of the ground without media, is the
/// picture with both.
#[test]
fn a_caught_shadow_in_front_of_the_ground_is_the_ground_in_shadow() {
    let usual = settings(48, [40, 32]).with(|s| s.map.kind = Some(MapKind::Fragments));
    let mut scene = anchor_scene(Preset::Bucky, 3.0, 24);
    scene.ground = Some(Ground::new(-0.6, 0.4).within(2.5));
    scene.background = None;
    scene.ambient = DVec3::splat(0.2);
    let mut two = scene.clone();
    let position = DVec3::new(1.5, 2.0, 1.0);
    two.lights.push(Light::new(LightKind::Point { position }, two.lights[0].irradiance));
    for (i, backend) in every_backend().iter().enumerate() {
        // The second scene's pipelines take software GPUs a minute to compile.
        for scene in [&scene, &two].into_iter().take(2 - i) {
            let mut catcher = ShadowCatcher::new(&**backend);
            let caught = catcher.render(scene, &usual, &Silent).unwrap();
            let both = backend.render(scene, &usual, &Silent).unwrap();
            let mut alone = scene.clone();
            alone.media = Media::none();
            let alone = backend.render(&alone, &usual, &Silent).unwrap();
            let (mut shadows, mut worst) = (0, 0.0_f32);
            for ((front, behind), both) in caught.pixels.iter().zip(&alone.pixels).zip(&both.pixels)
            {
                for channel in 0..3 {
                    let composed = front[channel] + (1.0 - front[3]) * behind[channel];
                    worst = worst.max((composed - both[channel]).abs());
                }
                shadows += usize::from(front[3] > 0.1 && front[0] < 1e-3 * front[3]);
            }
            assert!(worst < 1e-4, "{worst} on {}", backend.description());
            assert!(shadows > 20, "{shadows} pixels in shadow on {}", backend.description());
            // What is kept between pictures makes the same one.
            assert!(catcher.render(scene, &usual, &Silent).unwrap() == caught);
        }
    }
}
