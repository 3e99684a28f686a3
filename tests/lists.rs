//! Tests that fragment lists are the same however they are built: drawn or marched, on CPU or GPU,
//! with large or small capacity, in one tile or many.

use deepshadow::backend::{Backend, Passes};
use deepshadow::cpu::CpuBackend;
use deepshadow::frame::Frame;
use deepshadow::progress::Silent;
use deepshadow::scene::{LightKind, Scene};
use deepshadow::settings::{MapKind, Slices};
use deepshadow::shadow::Runs;
use deepshadow::volume::presets::Preset;
use glam::DVec3;

use crate::support::backends::every_backend;
use crate::support::scenes::{anchor_scene, scene, settings as all_settings, unit_cube, volume};

/// Bytes for lists that are never filled, and the smallest number allowed.
const MEMORIES: [u64; 2] = [1 << 30, 1 << 20];

fn frame(scene: &Scene, slices: Slices, size: u32, steps: u32, tolerance: f64) -> Frame {
    let settings = all_settings(size, [8, 8]).with(|s| {
        s.map.kind = Some(MapKind::Fragments);
        s.map.fragments.slices = slices;
        s.map.steps = steps;
        s.map.fragments.tolerance = tolerance;
        s.map.fragments.truncation = 0.0;
    });
    Frame::new(&scene.only_beam().unwrap(), &settings).unwrap()
}

/// Lists that a backend marches or draws.
fn lists(backend: &dyn Passes, scene: &Scene, frame: &Frame, drawn: bool, memory: u64) -> Runs {
    let volume = &scene.media;
    let built = if drawn {
        backend.raster_slices(volume, frame, memory, &Silent)
    } else {
        backend.trace_slices(volume.into(), frame, memory, &Silent)
    };
    built.unwrap()
}

/// Checks that both have the same counts, except where rounding adds or removes a thin slab at a
/// volume's edge, and the same numbers up to the errors of f32 sums and, on graphics hardware, of
/// 8-bit texture weights.
fn assert_same(ours: &Runs, truth: &Runs, what: &str, exact: bool) {
    assert_eq!(ours.texels(), truth.texels(), "{what}");
    let (mut slivers, mut worst_depth, mut worst_tau) = (0, 0.0_f32, 0.0_f32);
    for texel in 0..truth.texels() {
        let (a, b) = (ours.of(texel), truth.of(texel));
        if a.len() != b.len() {
            slivers += 1;
            continue;
        }
        for (a, b) in a.iter().zip(b) {
            worst_depth = worst_depth.max((a.depth - b.depth).abs());
            let tau = (a.optical_depth - b.optical_depth).abs() / (1.0 + b.optical_depth);
            worst_tau = worst_tau.max(tau);
        }
    }
    eprintln!("{what}: {slivers} slivers, depth {worst_depth:.1e}, optical depth {worst_tau:.1e}");
    assert!(slivers * 500 <= truth.texels(), "{what}: {slivers} texels have other counts");
    assert!(worst_depth < 5e-6, "{what}: depths differ by {worst_depth}");
    let allowed = if exact { 1e-5 } else { 6e-3 };
    assert!(worst_tau < allowed, "{what}: optical depths differ by {worst_tau}");
}

fn exact(backend: &dyn Backend) -> bool {
    ["cpu", "llvmpipe"].iter().any(|name| backend.description().contains(name))
}

#[test]
fn lists_are_the_same_whoever_builds_them() {
    let directional = anchor_scene(Preset::Box, 6.0, 32);
    let mut point = anchor_scene(Preset::Box, 6.0, 32);
    point.lights[0].kind = LightKind::Point { position: DVec3::new(0.9, 1.6, 0.7) };
    for (name, scene) in [("directional", directional), ("point", point)] {
        let planes = frame(&scene, Slices::Planes, 40, 200, 0.0);
        let truth = lists(&CpuBackend, &scene, &planes, false, MEMORIES[0]);
        assert!(truth.nodes().len() > 50_000);
        for backend in every_backend() {
            for (drawn, memory) in [(true, 0), (true, 1), (false, 0), (false, 1)] {
                let ours = lists(&*backend, &scene, &planes, drawn, MEMORIES[memory]);
                let way = if drawn { "drawn" } else { "marched" };
                let what =
                    format!("{name}, {way}, {} bytes, {}", MEMORIES[memory], backend.description());
                assert_same(&ours, &truth, &what, exact(&*backend));
            }
        }
    }
}

/// A busy texel needs more nodes than the initial capacity of a fit, and a row of planes needs more
/// elements.
#[test]
fn nothing_is_lost_where_there_was_too_little_room() {
    let stripes = volume([4, 4, 400], unit_cube(), |[_, _, z]| (z / 2 % 2) as f32);
    let mut busy = scene(stripes, 4.0);
    busy.lights[0].kind = LightKind::Directional { direction: DVec3::Z };
    for tolerance in [0.0005, 0.0] {
        let ray = frame(&busy, Slices::Ray, 12, 1600, tolerance);
        let truth = lists(&CpuBackend, &busy, &ray, false, MEMORIES[0]);
        let most = truth.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
        assert!(most > 64, "{most} nodes");
        for backend in every_backend() {
            for memory in MEMORIES {
                let ours = lists(&*backend, &busy, &ray, false, memory);
                let what = format!("{tolerance}, {memory} bytes, {}", backend.description());
                if tolerance == 0.0 {
                    assert_same(&ours, &truth, &what, exact(&*backend));
                }
                let last = |runs: &Runs, i: usize| runs.of(i).last().unwrap().optical_depth;
                for texel in 0..144 {
                    let (a, b) = (last(&ours, texel), last(&truth, texel));
                    assert!((a - b).abs() < 0.02, "{what}: {a}, not {b}");
                }
            }
        }
    }
    let drawn = frame(&busy, Slices::Raster, 12, 1024, 0.0);
    let truth = lists(&CpuBackend, &busy, &drawn, true, MEMORIES[0]);
    for backend in every_backend() {
        for memory in MEMORIES {
            let ours = lists(&*backend, &busy, &drawn, true, memory);
            let what = format!("1024 planes, {memory} bytes, {}", backend.description());
            assert_same(&ours, &truth, &what, exact(&*backend));
        }
    }
}
