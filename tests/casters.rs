//! Tests of scenes without volumes, and of lights among the media.

use deepshadow::image::Image;
use deepshadow::progress::Silent;
use deepshadow::reference::brute_force_image;
use deepshadow::scene::{Ground, Light, LightKind, Media, Projection, Scene};
use deepshadow::settings::{MapKind, Shading};
use glam::DVec3;

use crate::support::backends::{every_backend, interpolates_in_f32};
use crate::support::scenes::{scene, settings, unit_cube, volume};

/// The mean of a picture relative to that of the true picture, minus one.
fn mean_error(image: &Image, truth: &Image) -> f64 {
    let mean = |image: &Image| image.pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>();
    mean(image) / mean(truth) - 1.0
}

/// The largest error of a picture, relative to the brightest pixel of the true picture.
fn worst(image: &Image, truth: &Image) -> f64 {
    let brightest = truth.pixels.iter().map(|pixel| f64::from(pixel[1])).fold(0.0, f64::max);
    let pairs = image.pixels.iter().zip(&truth.pixels);
    let errors = pairs.map(|(a, b)| f64::from(a[1] - b[1]).abs());
    errors.fold(0.0, f64::max) / brightest
}

/// A light in a medium of varying density, not at the centre of anything.
fn lamp(kind: LightKind) -> Scene {
    let density = |[x, y, z]: [usize; 3]| ((x * 5 + y * 3 + z * 7) % 11) as f32 / 10.0;
    let mut lit = scene(volume([16; 3], unit_cube(), density), 4.0);
    lit.lights[0] = Light::new(kind, DVec3::splat(0.5));
    lit.ground = Some(Ground::new(-0.6, 0.5));
    lit
}

const INSIDE: DVec3 = DVec3::new(0.07, 0.11, -0.05);

#[test]
fn a_light_in_a_volume_is_what_brute_force_says() {
    let spot = LightKind::Spot {
        position: INSIDE,
        direction: DVec3::new(0.3, -1.0, 0.2),
        cone_degrees: 35.0,
        cone_softness: 0.4,
    };
    let near = LightKind::Point { position: DVec3::new(0.1, 0.51, 0.0) };
    for kind in [LightKind::Point { position: INSIDE }, spot, near] {
        let scene = lamp(kind);
        let size = [40, 32];
        let truth = brute_force_image(&scene, size, 1).unwrap();
        for map in [MapKind::Fragments, MapKind::Threshold] {
            let settings = settings(128, size).with(|s| s.map.kind = Some(map));
            for backend in every_backend() {
                let image = backend.render(&scene, &settings, &Silent).unwrap();
                let (mean, worst) = (mean_error(&image, &truth), worst(&image, &truth));
                let name = backend.description();
                eprintln!("{kind:?}, {map} on {name}: mean {mean:.1e}, worst {worst:.1e}");
                let allowed = if map == MapKind::Fragments { 0.01 } else { 0.02 };
                assert!(mean.abs() < allowed, "{kind:?}, {map} on {name}: {mean}");
            }
        }
    }
}

/// The paper's shading ignores a light's position, so a light among the media would be added six
/// times.
#[test]
fn the_papers_shading_refuses_a_light_in_a_volume() {
    let settings = settings(16, [8, 8]).with(|s| {
        s.map.kind = Some(MapKind::Threshold);
        s.view.shading = Shading::Paper;
    });
    for backend in every_backend() {
        let lamp = lamp(LightKind::Point { position: INSIDE });
        let error = backend.render(&lamp, &settings, &Silent).unwrap_err().to_string();
        assert!(error.starts_with("light: the paper's shading"), "{error}");
    }
}

/// In a medium that is the same in every direction from the light, borders between faces of the
/// cube must not be visible: pixels at equal distances from the light's image are equally bright.
#[test]
fn no_seam_shows_between_faces() {
    let mut scene = scene(volume([24; 3], unit_cube(), |_| 1.0), 3.0);
    let light = LightKind::Point { position: DVec3::ZERO };
    scene.lights[0] = Light::new(light, DVec3::splat(0.3));
    scene.camera.position = DVec3::new(0.0, 0.0, 3.0);
    scene.camera.target = DVec3::ZERO;
    scene.camera.projection = Projection::Orthographic { height: 0.9 };
    // No pixel's centre lies exactly on the light.
    let size = [64, 64];
    let truth = brute_force_image(&scene, size, 1).unwrap();
    for backend in every_backend() {
        let settings = settings(128, size).with(|s| s.map.kind = Some(MapKind::Fragments));
        let image = backend.render(&scene, &settings, &Silent).unwrap();
        let ratio = |x: u32, y: u32| f64::from(image.pixel(x, y)[1] / truth.pixel(x, y)[1]);
        // Across the diagonals, where faces meet, away from the light itself.
        for along in 3..28 {
            for [left, above] in [[false, false], [false, true], [true, false], [true, true]] {
                let along_axis = |back: bool, d: u32| if back { 31 - d } else { 32 + d };
                let at = |d: u32, e: u32| (along_axis(left, d), along_axis(above, e));
                let here = at(along, along);
                for there in [at(along + 1, along), at(along, along + 1), at(along + 2, along)] {
                    let brightness = f64::from(truth.pixel(here.0, here.1)[1]);
                    let step = (ratio(here.0, here.1) - ratio(there.0, there.1)).abs();
                    let name = backend.description();
                    assert!(step * brightness < 1.0 / 255.0, "{here:?} on {name}: {step}");
                }
            }
        }
        let mean = mean_error(&image, &truth);
        eprintln!("{}: mean {mean:.1e}", backend.description());
        assert!(mean.abs() < 0.01, "{}: {mean}", backend.description());
    }
}

/// Ground and background, with light that nothing blocks.
#[test]
fn a_scene_without_volumes_is_its_ground() {
    let mut bare = scene(volume([2; 3], unit_cube(), |_| 0.0), 0.0);
    bare.media = Media::none();
    bare.ground = Some(Ground::new(-0.6, 0.5).within(1.0));
    bare.background = Some(DVec3::new(0.1, 0.2, 0.3));
    let kinds = [
        LightKind::Directional { direction: DVec3::new(0.3, -1.0, 0.2) },
        LightKind::Point { position: DVec3::new(0.1, 0.2, 0.0) },
        LightKind::Point { position: DVec3::new(0.5, 3.0, 0.0) },
    ];
    for kind in kinds {
        bare.lights[0].kind = kind;
        for map in [MapKind::Threshold, MapKind::Fragments] {
            for backend in every_backend() {
                let settings = settings(16, [24, 24]).with(|s| s.map.kind = Some(map));
                let image = backend.render(&bare, &settings, &Silent).unwrap();
                assert_eq!(image.pixel(12, 0), [0.1, 0.2, 0.3, 1.0], "the sky");
                let rays = bare.camera.rays(1.0);
                let (origin, direction) = rays.ray(12.5 / 24.0, 20.5 / 24.0);
                let point = origin + direction * ((-0.6 - origin.y) / direction.y);
                let light = &bare.lights[0];
                let cosine = -light.direction_at(point).y;
                let lit = 0.5 / std::f64::consts::PI * cosine * light.irradiance_at(point).x;
                let found = f64::from(image.pixel(12, 20)[0]);
                let name = backend.description();
                assert!((found / lit - 1.0).abs() < 1e-4, "{kind:?} on {name}: {found}, not {lit}");
            }
        }
    }
    // Without lights the ground is dark too.
    bare.lights.clear();
    bare.ambient = DVec3::ONE;
    for backend in every_backend() {
        let image = backend.render(&bare, &settings(16, [24, 24]), &Silent).unwrap();
        assert!((image.pixel(12, 20)[0] - 0.5).abs() < 1e-6, "{}", backend.description());
    }
}

/// A bias moves the lookups of surfaces towards the light: then less of the medium in which the
/// ground lies shadows it.
#[test]
fn ground_in_a_medium_is_shadowed_by_what_lies_above_it() {
    let mut buried = scene(volume([16; 3], unit_cube(), |_| 1.0), 3.0);
    buried.lights[0].kind = LightKind::Directional { direction: DVec3::NEG_Y };
    buried.ground = Some(Ground::new(0.1, 0.5));
    buried.camera.position = DVec3::new(0.0, 3.0, 0.0);
    buried.camera.target = DVec3::ZERO;
    buried.camera.up = DVec3::Z;
    buried.camera.projection = Projection::Orthographic { height: 0.5 };
    let truth = brute_force_image(&buried, [9; 2], 1).unwrap();
    for bias in [0.0, 0.1] {
        for map in [MapKind::Threshold, MapKind::Fragments] {
            for backend in every_backend() {
                let settings = settings(64, [9; 2]).with(|s| {
                    s.map.kind = Some(map);
                    s.view.bias = bias;
                });
                let image = backend.render(&buried, &settings, &Silent).unwrap();
                // A length of .4 of the medium lies above the ground, once on the way from the
                // light and once to the camera.
                let ground = 0.5 / std::f32::consts::PI * 4.0 * std::f32::consts::PI;
                let seen = ground * (-3.0_f32 * 0.4).exp();
                let more = seen * ((-3.0 * (0.4 - bias as f32)).exp() - (-1.2_f32).exp());
                let expected = truth.pixel(4, 4)[1] + more;
                let found = image.pixel(4, 4)[1];
                let allowed = if interpolates_in_f32(&*backend) { 2e-3 } else { 4e-3 };
                let name = backend.description();
                assert!((found - expected).abs() < allowed, "{map}, {bias} on {name}: {found}");
            }
        }
    }
}
