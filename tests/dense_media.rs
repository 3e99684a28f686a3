//! Tests of media of any density: the closed form of single scattering with the light behind the
//! camera, and the f64 truth under oblique light.

use std::sync::Arc;

use deepshadow::backend::Backend;
use deepshadow::cpu::{CpuBackend, DeepView};
use deepshadow::frame::Frame;
use deepshadow::progress::Silent;
use deepshadow::reference::{Extinction, brute_force_image};
use deepshadow::scene::transfer::TransferPoint;
use deepshadow::scene::{Emission, LightKind, Projection, Scene, TransferFunction};
use deepshadow::settings::{MapKind, Settings};
use glam::DVec3;
use rayon::prelude::*;

use crate::support::scenes::{scene, settings as all_settings, unit_cube, volume};

/// Voxels along an edge.
const VOXELS: usize = 16;
/// Pixels along an edge of the pictures.
const PIXELS: u32 = 47;

/// The shape of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// Constant, up to the box's faces.
    Full,
    /// Constant, surrounded by empty voxels.
    Bordered,
    /// Falls with the square of the radius.
    SmoothBall,
    HardBall,
    /// Every other voxel is filled.
    Checks,
}

use Shape::{Bordered, Checks, Full, HardBall, SmoothBall};

const SHAPES: [Shape; 5] = [Full, Bordered, SmoothBall, HardBall, Checks];

impl Shape {
    fn density(self, voxel: [usize; 3]) -> f32 {
        let radius: f64 = voxel
            .iter()
            .map(|&c| ((c as f64 + 0.5) / VOXELS as f64 * 2.0 - 1.0).powi(2))
            .sum::<f64>()
            .sqrt();
        match self {
            Full => 1.0,
            Bordered => f32::from(u8::from(voxel.iter().all(|c| (3..VOXELS - 3).contains(c)))),
            SmoothBall => (1.0 - (radius / 0.8).powi(2)).max(0.0) as f32,
            HardBall => f32::from(u8::from(radius < 0.7)),
            Checks => f32::from(u8::from(voxel.iter().sum::<usize>() % 2 == 0)),
        }
    }

    /// A cube of this shape with edges of length 1, seen and lit from the front; `depth` is the
    /// optical depth per voxel where density is 1.
    fn scene(self, depth: f64) -> Scene {
        let volume = volume([VOXELS; 3], unit_cube(), |voxel| self.density(voxel));
        let mut scene = scene(volume, depth * VOXELS as f64);
        scene.lights[0].kind = LightKind::Directional { direction: DVec3::NEG_Z };
        scene.camera.position = DVec3::new(0.0, 0.0, 2.0);
        scene.camera.target = DVec3::ZERO;
        // Slightly less than the cube, so that no pixel misses it, and so that pixels do not
        // coincide with the texels' centres.
        scene.camera.projection = Projection::Orthographic { height: 0.97 };
        scene
    }
}

fn settings(kind: MapKind) -> Settings {
    all_settings(512, [PIXELS; 2]).with(|s| s.map.kind = Some(kind))
}

/// Radiance of every pixel.
fn radiance(scene: &Scene, settings: &Settings) -> Vec<f64> {
    let image = CpuBackend.render(scene, settings, &Silent).unwrap();
    image.pixels.iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// The closed form of every pixel for a white, isotropic medium with the light along the view,
/// divided by E / 4 pi, which is 1: half of 1 - T^2, where T is the ray's transmittance.
fn closed_form(scene: &Scene, pixels: u32) -> Vec<f64> {
    let extinction = Extinction::of(&scene.media);
    let rays = scene.camera.rays(1.0);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(pixels);
    let pixel = |i: u32| {
        let (origin, direction) = rays.ray(at(i % pixels), at(i / pixels));
        let depth = extinction.optical_depth(origin, direction, [0.0, f64::INFINITY]);
        0.5 * -(-2.0 * depth).exp_m1()
    };
    (0..pixels * pixels).map(pixel).collect()
}

/// Error of the mean, relative to the exact mean.
fn mean_error(found: &[f64], exact: &[f64]) -> f64 {
    (found.iter().sum::<f64>() / exact.iter().sum::<f64>() - 1.0).abs()
}

/// Optical depths per voxel.
const DEPTHS: [f64; 7] = [0.05, 0.5, 1.5, 5.0, 15.0, 50.0, 500.0];

/// Descriptions of all shapes and depths for which `error` is too large.
fn complaints(
    shapes: &[Shape],
    error: impl Fn(Shape, f64) -> f64 + Sync,
    allowed: f64,
) -> Vec<String> {
    let cases: Vec<(Shape, f64)> =
        shapes.iter().flat_map(|&shape| DEPTHS.map(|depth| (shape, depth))).collect();
    let found = cases.into_par_iter().map(|(shape, depth)| {
        let error = error(shape, depth);
        eprintln!("{shape:?} {depth}: {error:.5}");
        (error.is_nan() || error > allowed).then(|| format!("{shape:?}, {depth} a voxel: {error}"))
    });
    found.flatten().collect()
}

#[test]
fn the_truth_converges_and_meets_the_closed_form() {
    let error = |shape: Shape, depth: f64| {
        let scene = shape.scene(depth);
        let exact = closed_form(&scene, 7);
        let [one, two] = [1, 2].map(|cuts| brute_force_image(&scene, [7; 2], cuts).unwrap());
        let pixels = one.pixels.iter().zip(&two.pixels).zip(exact);
        pixels
            .map(|((one, two), exact)| {
                (f64::from(one[0]) - exact).abs().max(f64::from(one[0] - two[0]).abs())
            })
            .fold(0.0, f64::max)
    };
    let complaints = complaints(&SHAPES, error, 2e-6);
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn light_along_the_view_is_half_of_one_less_the_square_of_transmittance() {
    for kind in [MapKind::Fragments, MapKind::Threshold] {
        eprintln!("{kind}");
        let error = |shape: Shape, depth: f64| {
            mean_error(
                &radiance(&shape.scene(depth), &settings(kind)),
                &closed_form(&shape.scene(depth), PIXELS),
            )
        };
        let complaints = complaints(&SHAPES, error, 0.01);
        assert!(complaints.is_empty(), "{kind}: {complaints:#?}");
    }
}

#[test]
fn eight_times_the_quality_leaves_a_fifth_of_a_percent() {
    let error = |shape: Shape, depth: f64| {
        let settings = settings(MapKind::Fragments).with(|s| {
            s.quality = 8.0;
            s.image.size = [9; 2];
        });
        mean_error(&radiance(&shape.scene(depth), &settings), &closed_form(&shape.scene(depth), 9))
    };
    let complaints = complaints(&[Full, Checks], error, 0.002);
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn slanted_light_is_what_the_truth_says() {
    for direction in [DVec3::new(0.6, -0.7, -0.4), DVec3::new(0.3, -0.2, -0.9)] {
        eprintln!("{direction}");
        let error = |shape: Shape, depth: f64| {
            let mut scene = shape.scene(depth);
            scene.lights[0].kind = LightKind::Directional { direction };
            let truth = brute_force_image(&scene, [13; 2], 1).unwrap();
            let settings = settings(MapKind::Fragments).with(|s| s.image.size = [13; 2]);
            let truth: Vec<f64> = truth.pixels.iter().map(|pixel| f64::from(pixel[0])).collect();
            mean_error(&radiance(&scene, &settings), &truth)
        };
        let complaints = complaints(&[Full, Checks], error, 0.01);
        assert!(complaints.is_empty(), "{direction}: {complaints:#?}");
    }
}

/// With a transfer function and emission, the same steps are taken. A dense emitting medium is seen
/// only to a certain depth, so its radiance is emission over extinction.
#[test]
fn emission_of_a_dense_medium_is_that_over_its_extinction() {
    for depth in [0.5, 5.0, 50.0, 500.0] {
        let mut scene = Full.scene(depth);
        scene.lights[0].irradiance = DVec3::ZERO;
        let extinction = depth * VOXELS as f64;
        let ramp = TransferFunction::new(vec![point(0.0), point(2.0)]).unwrap();
        let emission = Emission::new(Arc::new(ramp), 3.0 * extinction);
        scene.media.medium_mut().emission = Some(emission);
        let found = radiance(&scene, &settings(MapKind::Fragments));
        let exact: Vec<f64> = vec![3.0 * -(-extinction).exp_m1(); found.len()];
        let error = mean_error(&found, &exact);
        eprintln!("{depth}: {error:.5}");
        assert!(error < 0.002, "{error} at {depth} a voxel");
    }
}

fn point(value: f64) -> TransferPoint {
    TransferPoint { value, color: DVec3::ONE, opacity: 1.0 }
}

/// The deep image's samples, composited, give the picture.
#[test]
fn deep_images_of_dense_media_are_the_picture() {
    let scene = HardBall.scene(50.0);
    let settings = settings(MapKind::Fragments).with(|s| s.image.size = [9; 2]);
    let beam = scene.only_beam().unwrap();
    let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
    let frame = Frame::new(&beam, &settings).unwrap();
    let view = DeepView::new(&scene.media, &frame, &map).unwrap();
    let rows: Vec<_> = (0..9).map(|y| view.row(y)).collect();
    let picture = radiance(&scene, &settings);
    for (i, exact) in picture.into_iter().enumerate() {
        let (mut light, mut through) = (0.0, 1.0);
        for sample in &rows[i / 9][i % 9] {
            light += through * f64::from(sample.radiance.x);
            through *= 1.0 - f64::from(sample.alpha);
        }
        assert!((light - exact).abs() < 2e-3, "pixel {i}: {light}, not {exact}");
    }
}
