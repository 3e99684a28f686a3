//! Tests of colour on every backend, against closed forms: transfer functions, coloured media and
//! shadows, several volumes and lights.

use std::sync::Arc;

use deepshadow::backend::Backend;
use deepshadow::image::Image;
use deepshadow::math::Aabb;
use deepshadow::progress::Silent;
use deepshadow::reference::Extinction;
use deepshadow::scene::transfer::{TransferFunction, TransferPoint, preset};
use deepshadow::scene::{Body, Camera, Emission, Ground, Light, LightKind, Media, Medium, Scene};
use deepshadow::settings::{MapKind, Settings};
use deepshadow::shadow::Shadow;
use deepshadow::volume::Volume;
use deepshadow::volume::presets::Preset;
use glam::{DMat4, DVec3};

use crate::support::Random;
use crate::support::backends::{every_backend, interpolates_in_f32};
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};

const KINDS: [MapKind; 2] = [MapKind::Threshold, MapKind::Fragments];
/// The largest error of 8-bit texture weights, slabs and tolerances where a map is otherwise exact.
const EXACT: f32 = 2e-3;
const GROUND: f64 = -2.0;

fn uniform(bounds: Aabb) -> Volume {
    volume([8; 3], bounds, |_| 1.0)
}

fn boxed(center: DVec3, size: f64) -> Aabb {
    Aabb { min: center - 0.5 * size, max: center + 0.5 * size }
}

fn body(volume: Volume, medium: Medium) -> Body {
    Body::new(Arc::new(volume), medium)
}

fn medium(density_scale: f64) -> Medium {
    Medium::new(density_scale)
}

/// Light from above on a white ground, seen by a camera below the volumes.
fn ground_scene(bodies: Vec<Body>) -> Scene {
    let mut scene = scene(uniform(unit_cube()), 1.0);
    scene.media = Media::new(bodies);
    let kind = LightKind::Directional { direction: DVec3::NEG_Y };
    scene.lights[0] = Light::new(kind, DVec3::splat(std::f64::consts::PI));
    scene.ground = Some(Ground::new(GROUND, 1.0));
    let (below, middle) = (DVec3::new(0.0, -1.5, 0.0), DVec3::new(0.0, GROUND, 0.0));
    scene.camera = Camera::orthographic(below, middle, 2.0);
    scene.camera.up = DVec3::NEG_Z;
    scene
}

fn render(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> Image {
    backend.render(scene, settings, &Silent).unwrap()
}

fn pixel(image: &Image, [x, z]: [f64; 2]) -> [f32; 4] {
    let at = |c: f64, n: u32| ((c / 2.0 + 0.5) * f64::from(n)) as usize;
    image.pixels[at(z, image.height) * image.width as usize + at(x, image.width)]
}

fn largest_difference(a: &Image, b: &Image) -> f32 {
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let differences = pairs.map(|(a, b)| (a - b).abs());
    differences.map(|d| if d.is_nan() { f32::INFINITY } else { d }).fold(0.0, f32::max)
}

#[test]
fn a_coloured_slab_over_a_white_ground_lets_through_exp_minus_tau_of_each_channel() {
    let tint = DVec3::new(1.0, 0.25, 0.0);
    let slab = body(uniform(unit_cube()), medium(1.5).with(|medium| medium.tint = tint));
    let scene = ground_scene(vec![slab]);
    for backend in every_backend() {
        for kind in KINDS {
            let settings = settings(32, [32, 32]).with(|s| s.map.kind = Some(kind));
            let image = render(&*backend, &scene, &settings);
            let lit = pixel(&image, [0.05, -0.1]);
            for c in 0..3 {
                let truth = (-1.5 * tint[c]).exp() as f32;
                let what = format!("{kind}, channel {c}, {}", backend.description());
                assert!((lit[c] - truth).abs() < EXACT, "{what}: {}, not {truth}", lit[c]);
            }
            assert!((pixel(&image, [0.8, 0.8])[0] - 1.0).abs() < 1e-5, "beside it is light");
        }
    }
}

/// Bodies may overlap anywhere, and one is rotated: transmittances multiply.
#[test]
fn overlapping_boxes_multiply_their_transmittances() {
    let (a, b) = (boxed(DVec3::new(-0.17, 0.1, 0.0), 0.8), boxed(DVec3::new(0.2, 0.23, 0.1), 0.7));
    let turned = uniform(b);
    let turn = DMat4::from_rotation_y(0.6) * *turned.world_from_index();
    let bodies = vec![
        body(uniform(a), medium(0.9)),
        body(
            turned.placed(turn).unwrap(),
            medium(1.3).with(|medium| medium.tint = DVec3::new(0.2, 1.0, 2.0)),
        ),
    ];
    let scene = ground_scene(bodies);
    let under_a = (-0.9_f64 * 0.8).exp();
    let under_b = DVec3::new(0.2, 1.0, 2.0).to_array().map(|t| (-1.3 * 0.7 * t).exp());
    for backend in every_backend() {
        for kind in KINDS {
            let settings = settings(64, [64, 64]).with(|s| s.map.kind = Some(kind));
            let image = render(&*backend, &scene, &settings);
            let places = [([-0.5, -0.3], true, false), ([0.05, 0.1], true, true)];
            for (place, in_a, in_b) in places {
                let lit = pixel(&image, place);
                for c in 0..3 {
                    let mut truth = if in_a { under_a } else { 1.0 };
                    truth *= if in_b { under_b[c] } else { 1.0 };
                    let what = format!("{kind} at {place:?}, {}", backend.description());
                    let error = (f64::from(lit[c]) - truth).abs();
                    // A mean over three channels' maps of 64 texels, with edges that are a texel
                    // wide.
                    assert!(error < f64::from(EXACT) * 2.0, "{what}: {}, not {truth}", lit[c]);
                }
            }
        }
    }
}

fn two_clouds() -> Vec<Body> {
    let mut random = Random(5);
    let mut blob = |center: DVec3| {
        let noise: Vec<f32> = (0..12 * 12 * 12).map(|_| random.unit() as f32).collect();
        volume([12; 3], boxed(center, 0.8), |[x, y, z]| {
            let p = DVec3::new(x as f64, y as f64, z as f64) / 11.0 - 0.5;
            (1.0 - 2.0 * p.length()).max(0.0) as f32 * noise[(z * 12 + y) * 12 + x]
        })
    };
    let warm = medium(9.0).with(|medium| {
        medium.albedo = DVec3::new(1.0, 0.6, 0.3);
        medium.phase_g = 0.4;
    });
    let red = medium(7.0).with(|medium| medium.tint = DVec3::new(0.3, 1.0, 1.4));
    vec![body(blob(DVec3::new(-0.15, 0.0, 0.0)), warm), body(blob(DVec3::new(0.2, 0.1, 0.1)), red)]
}

#[test]
fn the_order_of_volumes_means_nothing() {
    let (forward, mut bodies) = (two_clouds(), two_clouds());
    bodies.reverse();
    let mut one = scene(uniform(unit_cube()), 1.0);
    one.ambient = DVec3::splat(0.1);
    let mut other = one.clone();
    one.media = Media::new(forward);
    other.media = Media::new(bodies);
    for backend in every_backend() {
        let settings = settings(64, [48, 40]);
        let difference = largest_difference(
            &render(&*backend, &one, &settings),
            &render(&*backend, &other, &settings),
        );
        assert!(difference < 1e-4, "{difference} on {}", backend.description());
    }
}

/// A grid cut into two random parts whose sum it is.
#[test]
fn a_volume_split_into_two_renders_as_one() {
    let mut whole = anchor_scene(Preset::Bucky, 8.0, 32);
    whole.ground = Some(Ground::new(-0.6, 0.4));
    let Body { volume, medium, .. } = whole.media.first().unwrap().clone();
    let mut random = Random(3);
    let shares: Vec<f32> = volume.values().iter().map(|_| random.unit() as f32).collect();
    let part = |keep: &dyn Fn(f32) -> f32| {
        let mut values = volume.values().into_owned();
        for (value, share) in values.iter_mut().zip(&shares) {
            *value *= keep(*share);
        }
        let part = Volume::new("part", values, *volume.world_from_index()).unwrap();
        body(part, medium.clone())
    };
    let mut split = whole.clone();
    split.media = Media::new(vec![part(&|share| share), part(&|share| 1.0 - share)]);
    for backend in every_backend() {
        for kind in KINDS {
            let settings = settings(64, [48, 40]).with(|s| s.map.kind = Some(kind));
            let difference = largest_difference(
                &render(&*backend, &whole, &settings),
                &render(&*backend, &split, &settings),
            );
            eprintln!("{kind}: {:.2} / 255 on {}", difference * 255.0, backend.description());
            assert!(difference < 1.0 / 255.0, "{kind}: {difference}, {}", backend.description());
        }
    }
}

fn function(points: &[(f64, [f64; 3], f64)]) -> Arc<TransferFunction> {
    let point = |&(value, color, opacity): &(f64, [f64; 3], f64)| TransferPoint {
        value,
        color: DVec3::from_array(color),
        opacity,
    };
    Arc::new(TransferFunction::new(points.iter().map(point).collect()).unwrap())
}

/// Density rises evenly along x, and a band of it is opaque. The integral is the band's width times
/// the mean of its opacity, however thin the band is.
#[test]
fn bands_of_a_transfer_function_are_never_stepped_over() {
    let ramp = volume([16, 4, 4], unit_cube(), |[x, _, _]| x as f32 / 15.0);
    let white = [1.0; 3];
    for width in [0.2, 0.02, 0.004] {
        let (low, high) = (0.48, 0.48 + width);
        let band = function(&[
            (0.0, white, 0.0),
            (low, white, 0.0),
            (low, white, 1.0),
            (high, white, 0.5),
            (high, white, 0.0),
            (1.0, white, 0.0),
        ]);
        // 15 of 16 voxel lengths contain the change from 0 to 1.
        let truth = 40.0 / width * 0.03 * (0.75 * width * 15.0 / 16.0);
        let mut across = scene(ramp.clone(), 1.0);
        across.media = Media::new(vec![body(
            ramp.clone(),
            medium(40.0 / width * 0.03).with(|medium| medium.transfer = Some(band)),
        )]);
        let exact = Extinction::of(&across.media);
        let found = exact.optical_depth(DVec3::new(-2.0, 0.1, 0.2), DVec3::X, [0.0, 9.0]);
        assert!((found - truth).abs() < 1e-6, "the reference: {found}, not {truth}");
        across.lights[0].kind = LightKind::Directional { direction: DVec3::X };
        for backend in every_backend() {
            for kind in KINDS {
                let settings = settings(8, [8, 8]).with(|s| s.map.kind = Some(kind));
                let map = backend.map(&across.only_beam().unwrap(), &settings, &Silent).unwrap();
                let through = map.lookup(1, 0.5, 0.5, 5.0);
                let error = (f64::from(through) - (-truth).exp()).abs();
                let what = format!("{width}, {kind}, {}", backend.description());
                // Hardware moves each edge of the band by up to 1/512 of a voxel, which is 1/16
                // long.
                let moved = if interpolates_in_f32(&*backend) { 0.0 } else { 2.0 / 512.0 / 16.0 };
                let bound = 4e-3 + (-truth).exp() * (40.0 / width * 0.03 * moved).exp_m1();
                assert!(error < bound, "{what}: {through}, not {}", (-truth).exp());
            }
        }
    }
}

/// A transfer function that is the identity changes nothing.
#[test]
fn a_straight_transfer_function_is_none() {
    let plain = anchor_scene(Preset::Bucky, 6.0, 32);
    let mut classified = plain.clone();
    classified.media.medium_mut().transfer =
        Some(function(&[(0.0, [1.0; 3], 0.0), (1.0, [1.0; 3], 1.0)]));
    // Media are classified as plain or not when passes begin.
    assert!(classified.media.plain().is_none() && plain.media.plain().is_some());
    for backend in every_backend() {
        let settings = settings(64, [48, 40]);
        let difference = largest_difference(
            &render(&*backend, &plain, &settings),
            &render(&*backend, &classified, &settings),
        );
        eprintln!("{:.2} / 255 on {}", difference * 255.0, backend.description());
        assert!(difference < 3.0 / 255.0, "{difference} on {}", backend.description());
    }
}

/// Emission of a uniform box: j l without extinction, j (1 - exp(-x l)) / x with extinction x.
#[test]
fn emission_has_its_closed_form() {
    let glowing = function(&[(0.0, [0.5, 0.25, 1.0], 1.0), (1.0, [0.5, 0.25, 1.0], 1.0)]);
    for extinction in [0.0, 3.0] {
        let emission = Emission::new(glowing.clone(), 0.8);
        let dark = medium(extinction).with(|medium| {
            medium.albedo = DVec3::ZERO;
            medium.emission = Some(emission);
        });
        let mut scene = scene(uniform(unit_cube()), 1.0);
        scene.media = Media::new(vec![body(uniform(unit_cube()), dark)]);
        scene.camera = Camera::orthographic(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.5);
        let length =
            if extinction > 0.0 { (1.0 - f64::exp(-extinction)) / extinction } else { 1.0 };
        let truth = DVec3::new(0.5, 0.25, 1.0) * 0.8 * length;
        for backend in every_backend() {
            let image = render(&*backend, &scene, &settings(16, [8, 8]));
            let seen = image.pixels[36];
            for c in 0..3 {
                let error = (f64::from(seen[c]) - truth[c]).abs();
                assert!(error < 1e-3, "{}: {seen:?}, not {truth}", backend.description());
            }
        }
    }
}

#[test]
fn the_picture_of_two_lights_is_the_sum_of_theirs() {
    let mut both = scene(uniform(unit_cube()), 1.0);
    both.media = Media::new(two_clouds());
    both.ground = Some(Ground::new(-0.6, 0.4));
    let kind = LightKind::Point { position: DVec3::new(-1.4, 1.2, 0.9) };
    let blue = Light::new(kind, DVec3::new(2.0, 4.0, 9.0));
    let mut second = both.clone();
    second.lights = vec![blue];
    let first = both.clone();
    both.lights.push(blue);
    for backend in every_backend() {
        let settings = settings(48, [40, 32]);
        let [both, first, second] =
            [&both, &first, &second].map(|scene| render(&*backend, scene, &settings));
        for (i, pixel) in both.pixels.iter().enumerate() {
            for c in 0..3 {
                let sum = first.pixels[i][c] + second.pixels[i][c];
                assert!((pixel[c] - sum).abs() < 1e-5, "{pixel:?} on {}", backend.description());
            }
            assert!((pixel[3] - first.pixels[i][3]).abs() < 1e-5, "opacity is one light's");
        }
    }
}

/// A grid of a single colour is equivalent to an albedo.
#[test]
fn a_grid_of_colours_is_a_factor_on_the_albedo() {
    let color = DVec3::new(0.9, 0.5, 0.2);
    let mut plain = anchor_scene(Preset::Rods, 6.0, 32);
    let mut colored = plain.clone();
    plain.media.medium_mut().albedo = color;
    let grids =
        color.to_array().map(|c| Arc::new(volume([3; 3], boxed(DVec3::ZERO, 4.0), |_| c as f32)));
    colored.media.medium_mut().color = Some(grids);
    for backend in every_backend() {
        let settings = settings(48, [40, 32]);
        let difference = largest_difference(
            &render(&*backend, &plain, &settings),
            &render(&*backend, &colored, &settings),
        );
        // With 8-bit weights, positions that differ by rounding give values that differ by more.
        let name = backend.description();
        let exact = name.starts_with("cpu") || name.contains("llvmpipe");
        assert!(difference < if exact { 2e-3 } else { 1e-2 }, "{difference} on {name}");
    }
}

/// Octaves add light in shadow; without octaves nothing changes.
#[test]
fn octaves_brighten_what_lies_in_the_shadow() {
    let scene = anchor_scene(Preset::Box, 8.0, 32);
    for backend in every_backend() {
        let octaves = |octaves| {
            let settings = settings(48, [24, 24]).with(|s| s.view.octaves = octaves);
            render(&*backend, &scene, &settings)
        };
        let [none, some, more] = [0, 1, 3].map(octaves);
        let sum = |image: &Image| image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>();
        let what = backend.description();
        assert!(sum(&some) > 1.05 * sum(&none) && sum(&more) > 1.02 * sum(&some), "{what}");
        // Fully lit parts keep their brightness.
        let brightest = |image: &Image| image.pixels.iter().map(|p| p[1]).fold(0.0, f32::max);
        assert!(brightest(&more) < 1.2 * brightest(&none), "{what}");
    }
}

/// A function of the gradient: where density is constant, opacity becomes 0.
#[test]
fn a_modulation_multiplies_extinction() {
    let mut plain = ground_scene(vec![body(uniform(unit_cube()), medium(2.0))]);
    let half = Arc::new(volume([4; 3], unit_cube(), |_| 0.5));
    plain.media.medium_mut().modulation = Some(half);
    let exact = Extinction::of(&plain.media);
    let found = exact.optical_depth(DVec3::new(0.1, 2.0, 0.1), DVec3::NEG_Y, [0.0, 9.0]);
    assert!((found - 1.0).abs() < 1e-6, "the reference: {found}");
    for backend in every_backend() {
        let image = render(&*backend, &plain, &settings(32, [32, 32]));
        let lit = pixel(&image, [0.05, -0.1])[0];
        assert!((lit - f32::exp(-1.0)).abs() < EXACT, "{lit} on {}", backend.description());
    }
}

#[test]
fn presets_of_transfer_functions_render_in_colour() {
    let mut scene = anchor_scene(Preset::Bucky, 6.0, 32);
    scene.media.medium_mut().transfer = Some(Arc::new(preset("viridis").unwrap()));
    for backend in every_backend() {
        let image = render(&*backend, &scene, &settings(48, [40, 32]));
        let spread = image.pixels.iter().map(|p| (p[0] - p[2]).abs()).fold(0.0, f32::max);
        assert!(spread > 0.05, "{spread} on {}", backend.description());
    }
}
