//! Tests of the threshold map's errors against the exact integral, on the four presets: the
//! published figures, with bounds.

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::progress::Silent;
use deepshadow::reference::Extinction;
use deepshadow::scene::Scene;
use deepshadow::settings::{Crossing, Lookup, MapKind, Settings};
use deepshadow::shadow::{Map, Shadow};
use deepshadow::volume::presets::Preset;
use glam::DVec3;
use rayon::prelude::*;

use crate::support::scenes::{anchor_scene, settings as all_settings};
use crate::support::{Random, rms};

pub const MAP: u32 = 256;
const POINTS: usize = 40_000;

/// Random points in the volume, with the exact transmittance from the light.
pub fn points(scene: &Scene) -> Vec<(DVec3, f64)> {
    let bounds = scene.media.world_bounds();
    let mut random = Random(42);
    let points: Vec<DVec3> = (0..POINTS)
        .map(|_| {
            let unit = DVec3::new(random.unit(), random.unit(), random.unit());
            bounds.min + unit * bounds.size()
        })
        .collect();
    let exact = Extinction::of(&scene.media);
    points.into_par_iter().map(|p| (p, exact.light_transmittance(&scene.lights[0], p))).collect()
}

pub fn error(map: &Map, points: &[(DVec3, f64)]) -> f64 {
    rms(points.iter().map(|&(point, truth)| {
        let light = map.view().coordinates(point).unwrap().as_vec3();
        f64::from(map.lookup(0, light.x, light.y, light.z)) - truth
    }))
}

/// RMS errors of box, bucky, rods, clouds.
fn errors(largest: f64, changed: &Settings) -> [f64; 4] {
    Preset::ALL.map(|preset| {
        let scene = anchor_scene(preset, largest, MAP);
        let map = CpuBackend.map(&scene.only_beam().unwrap(), changed, &Silent).unwrap();
        error(&map, &points(&scene))
    })
}

fn settings(map_size: u32, image_size: [u32; 2]) -> Settings {
    all_settings(map_size, image_size).with(|s| s.map.kind = Some(MapKind::Threshold))
}

pub fn average(errors: [f64; 4]) -> f64 {
    errors.iter().sum::<f64>() / 4.0
}

fn paper() -> Settings {
    settings(MAP, [1, 1]).with(|s| {
        s.map.threshold.lookup = Lookup::Paper;
        s.map.threshold.crossing = Crossing::Smoothstep;
    })
}

#[test]
fn the_papers_lookup_errs_as_published() {
    for (largest, published, rods) in [(4.0, 0.0546, 0.0141), (16.0, 0.0360, 0.0092)] {
        let found = errors(largest, &paper());
        eprintln!("paper, depth {largest}: {found:.4?}, average {:.4}", average(found));
        assert!((average(found) / published - 1.0).abs() < 0.1, "{found:?}");
        assert!((found[2] / rods - 1.0).abs() < 0.1, "{found:?}");
    }
}

#[test]
fn the_default_lookup_beats_the_papers_on_every_preset() {
    // Bounds on the average and on rods: the shipped values plus 5 %. The first published targets
    // were .029 and .021 on average, .016 and .012 on rods.
    for (largest, most, most_on_rods) in [(4.0, 0.0113, 0.0021), (16.0, 0.0128, 0.0033)] {
        let found = errors(largest, &settings(MAP, [1, 1]));
        let papers = errors(largest, &paper());
        eprintln!("default, depth {largest}: {found:.4?}, average {:.4}", average(found));
        assert!(average(found) <= most, "{found:?}");
        assert!(found[2] <= most_on_rods, "{found:?}");
        for (ours, papers) in found.iter().zip(papers) {
            assert!(*ours < papers, "{found:?} against {papers:?}");
        }
    }
}

#[test]
fn the_bucket_variant_errs_little_more_than_the_exact_crossing() {
    let exact = errors(4.0, &settings(MAP, [1, 1]));
    let bucket =
        errors(4.0, &settings(MAP, [1, 1]).with(|s| s.map.threshold.crossing = Crossing::Bucket));
    eprintln!("bucket, depth 4: {bucket:.4?}, exact {exact:.4?}");
    assert!(average(bucket) > average(exact), "a coarser crossing cannot be better on average");
    assert!(average(bucket) < 1.5 * average(exact), "{bucket:?} against {exact:?}");
}
