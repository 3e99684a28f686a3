//! Pictures of surfaces on a GPU are those of the CPU.
#![cfg(feature = "gpu")]

use deepshadow::image::Image;
use deepshadow::scene::{Ground, Projection, Scene, Shape, Surface};
use deepshadow::settings::Filter;
use deepshadow::surface::Strands;
use deepshadow::volume::presets::Preset;
use deepshadow::{Backend, CpuBackend, Settings, Silent};
use glam::{DMat4, DVec3};

use crate::support::backends::gpu;
use crate::support::scenes::anchor_scene;
use crate::surface_lists::scenes;
use crate::surfaces::{bare, fragments, tangle};

/// Largest difference of a pixel, as a share of the brightest: lookups in lists that differ by
/// roundings of places (2e-5 in each of some ten fragments).
const ALLOWED: f32 = 2e-4;
/// Of all pixels, so many may differ by more: those where a flank of a strand or an edge of a
/// triangle passes a cell's middle or a ray within roundings. A pixel of 56 across has some 5e-5
/// roundings of place, 8 x 8 middles and, in these scenes, at most ten flanks: 4 % of them, of which
/// most see more than one strand.
const AT_EDGES: f64 = 0.04;

/// Scenes with ground, ambient light, and both kinds of camera, whose surfaces are `bent`.
fn pictures(bent: f64) -> Vec<(String, Scene, Settings)> {
    let base = fragments(64).with(|s| {
        s.image.size = [56, 40];
        s.image.samples = 5;
    });
    let mut all = Vec::new();
    for (i, (name, mut scene)) in scenes(bent).into_iter().enumerate() {
        scene.ground = Some(Ground::new(-1.2, 0.3));
        scene.ambient = DVec3::new(0.1, 0.2, 0.3);
        if i % 3 == 1 {
            scene.camera.projection = Projection::Orthographic { height: 2.5 };
        }
        let filter = [Filter::Bilinear, Filter::Pcf3, Filter::Bilinear, Filter::Edsm3][i % 4];
        let settings = base.with(|s| {
            s.map.filter = filter;
            // All rays of every pixel, or only where pictures bend, on both.
            s.image.tolerance = if i % 2 == 1 { 0.0 } else { 0.002 };
        });
        all.push((name.to_owned(), scene, settings));
    }
    all
}

/// The share of pixels that differ by more than [`ALLOWED`].
fn share_that_differs(a: &Image, b: &Image) -> f64 {
    let brightest = a.pixels.iter().flatten().fold(0.0_f32, |most, &c| most.max(c));
    let differs = |(a, b): &(&[f32; 4], &[f32; 4])| {
        let off = a.iter().zip(*b).map(|(a, b)| (a - b).abs());
        // What is not a number differs.
        !off.fold(0.0_f32, f32::max).le(&(ALLOWED * brightest))
    };
    let count = a.pixels.iter().zip(&b.pixels).filter(differs).count();
    count as f64 / a.pixels.len() as f64
}

#[test]
fn a_gpu_sees_surfaces_as_the_cpu_does_and_one_percent_is_noticed() {
    let Some(gpu) = gpu() else { return };
    let bent = pictures(1.01).into_iter();
    for ((name, scene, settings), (_, bent, _)) in pictures(1.0).into_iter().zip(bent) {
        let cpu = CpuBackend.render(&scene, &settings, &Silent).unwrap();
        let [own, bent] = [&scene, &bent]
            .map(|scene| share_that_differs(&cpu, &gpu.render(scene, &settings, &Silent).unwrap()));
        eprintln!("{name}: {own:.4} of the pixels differ, {bent:.4} if bent");
        assert!(own <= AT_EDGES, "{name}: {own}");
        assert!(bent > AT_EDGES, "{name}: {bent}");
    }
}

/// Thousands of faint strands, of which a pixel sees hundreds.
fn faint_tangle() -> Scene {
    let mut dense = bare(Vec::new(), DVec3::new(0.3, -1.0, 0.2));
    let faint = |strands: &Strands| strands.clone().with_values(None, Some(0.03), None).unwrap();
    let Shape::Strands(strands) = &tangle(4000)[0].shape else { panic!() };
    let shape = Shape::Strands(faint(strands).into());
    dense.surfaces = vec![Surface::new(shape, DMat4::IDENTITY).unwrap()].into();
    dense
}

/// However many strands a pixel sees: software drivers end loops after 65,535 turns.
#[test]
fn a_gpu_sees_through_hundreds_of_strands() {
    let Some(gpu) = gpu() else { return };
    let dense = faint_tangle();
    let settings = fragments(32).with(|s| {
        s.image.size = [20, 16];
        s.image.samples = 8;
    });
    let cpu = CpuBackend.render(&dense, &settings, &Silent).unwrap();
    let own = gpu.render(&dense, &settings, &Silent).unwrap();
    let found = share_that_differs(&cpu, &own);
    assert!(found <= AT_EDGES, "{found}");
}

/// With memory for some rows at a time, of the picture and of the map, pictures are the same.
#[test]
fn a_gpu_sees_the_same_with_any_memory() {
    let Some(gpu) = gpu() else { return };
    let (_, scene, settings) = pictures(1.0).swap_remove(0);
    let with = |(scene, tolerance, change): Case<'_>, memory: u64| {
        let settings = settings.with(|s| {
            s.image.size = [150, 110];
            s.map.fragments.memory = memory;
            s.map.fragments.tolerance = tolerance;
            change(s);
        });
        gpu.render(scene, &settings, &Silent).unwrap()
    };
    let (dense, cloud) = (faint_tangle(), anchor_scene(Preset::Bucky, 4.0, 24));
    let few = settings.map.fragments.tolerance;
    // Of the second scene's hundred fragments in every texel not all rows fit. Room for 32 nodes of
    // every texel is more than half of the least memory, so that lists are packed; those of tolerance
    // .004 outgrow it. Without a tolerance the second scene's do not fit either way, and the map of
    // 40 x 40 texels is made in parts of the same buffers.
    let cases: [Case<'_>; 9] = [
        (&scene, few, |_| {}),
        (&dense, 0.02, |_| {}),
        (&scene, few, |s| enlarge(s, 100)),
        (&scene, 0.0, |s| enlarge(s, 84)),
        (&cloud, 0.01, |s| enlarge(s, 100)),
        (&dense, 0.012, |s| enlarge(s, 72)),
        (&dense, 0.004, |s| enlarge(s, 48)),
        (&dense, 0.0, |s| enlarge(s, 72)),
        (&dense, 0.02, |s| enlarge(s, 40)),
    ];
    for (i, case) in cases.into_iter().enumerate() {
        assert_eq!(share_that_differs(&with(case, 1 << 30), &with(case, 1 << 20)), 0.0, "{i}");
    }
}

/// A scene, its tolerance, and further settings.
type Case<'a> = (&'a Scene, f64, fn(&mut Settings));

fn enlarge(settings: &mut Settings, map: u32) {
    (settings.map.size, settings.image.size) = (map, [60, 44]);
}
