//! Tests that pictures from fewer rays stay within their tolerance of those from all rays.

use deepshadow::backend::Passes;
use deepshadow::cpu::CpuBackend;
use deepshadow::image::Image;
use deepshadow::progress::Silent;
use deepshadow::scene::{Ground, Scene};
use deepshadow::settings::Settings;
use glam::DVec3;

use crate::support::backends::gpu;
use crate::support::rms;
use crate::support::scenes::{scene, settings, unit_cube, volume};

const TOLERANCE: f64 = 0.004;

/// A ball with a hollow, above a ground on which its shadow falls.
fn lit() -> Scene {
    let ball = volume([24, 24, 24], unit_cube(), |place| {
        let from = |middle: [f64; 3]| {
            let away = DVec3::from(place.map(|i| i as f64)) - DVec3::from(middle);
            away.length()
        };
        let inside = from([11.5; 3]) < 10.0 && from([15.0, 15.0, 14.0]) > 5.0;
        f32::from(u8::from(inside))
    });
    let mut scene = scene(ball, 60.0);
    scene.ground = Some(Ground::new(-0.5, 0.5));
    scene
}

fn made(backend: &dyn Passes, samples: u32, tolerance: f64) -> Image {
    let settings: Settings = settings(96, [180, 140]);
    let settings = settings.with(|s| {
        (s.image.samples, s.image.tolerance) = (samples, tolerance);
    });
    backend.render(&lit(), &settings, &Silent).unwrap()
}

/// RMS and 99.8th percentile of the differences of two pictures, as shares of the 99.9th percentile
/// of the second one's radiance.
fn differences(found: &Image, expected: &Image) -> [f64; 2] {
    let mut radiance: Vec<f32> = expected.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    radiance.sort_by(f32::total_cmp);
    let unit = f64::from(radiance[radiance.len() * 999 / 1000]);
    let both = found.pixels.iter().zip(&expected.pixels);
    let off = both.flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).abs() / unit));
    let mut off: Vec<f64> = off.collect();
    off.sort_by(f64::total_cmp);
    [rms(off.iter().copied()), off[off.len() * 998 / 1000]]
}

#[test]
fn interpolated_pixels_keep_the_tolerance() {
    let all = made(&CpuBackend, 1, 0.0);
    let few = made(&CpuBackend, 1, TOLERANCE);
    let [rms, most] = differences(&few, &all);
    assert!(rms > 0.0, "every pixel was marched");
    assert!(rms <= 0.25 * TOLERANCE && most <= 4.0 * TOLERANCE, "{rms}, {most}");
    // Without any pixels between those of the lattice, edges are wrong.
    let [rms, most] = differences(&made(&CpuBackend, 1, 0.5), &all);
    assert!(rms > 0.25 * TOLERANCE && most > 4.0 * TOLERANCE, "{rms}, {most}");
}

/// Where the picture does not bend one ray is as good as all; elsewhere all are taken.
fn several_rays_keep_the_tolerance(backend: &dyn Passes) {
    let all = made(backend, 8, 0.0);
    let [rms, most] = differences(&made(backend, 8, TOLERANCE), &all);
    assert!(rms > 0.0, "every pixel got all rays");
    // A step of eight tolerances between two pixels is not noticed; half of it may be missing.
    assert!(rms <= 0.25 * TOLERANCE && most <= 4.0 * TOLERANCE, "{rms}, {most}");
    let [rms, most] = differences(&made(backend, 1, 0.0), &all);
    assert!(rms > 0.5 * TOLERANCE && most > 4.0 * TOLERANCE, "{rms}, {most}");
}

#[test]
fn several_rays_keep_the_tolerance_on_the_processor() {
    several_rays_keep_the_tolerance(&CpuBackend);
}

#[test]
fn several_rays_keep_the_tolerance_on_a_device() {
    let Some(gpu) = gpu() else { return };
    several_rays_keep_the_tolerance(&*gpu);
    // Both give all rays to the same pixels, up to those that are just at the tolerance.
    let [rms, _] = differences(&made(&*gpu, 8, TOLERANCE), &made(&CpuBackend, 8, TOLERANCE));
    assert!(rms <= 0.25 * TOLERANCE, "{rms}");
}
