//! Pictures of surfaces on a GPU are those of the CPU.
#![cfg(feature = "gpu")]

use deepshadow::image::Image;
use deepshadow::scene::{Ground, Projection, Scene};
use deepshadow::{Backend, CpuBackend, Settings, Silent};
use glam::DVec3;

use crate::support::backends::gpu;
use crate::surface_lists::scenes;
use crate::surfaces::fragments;

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
        let settings = base.with(|s| {
            if i % 2 == 1 {
                s.image.tolerance = 0.0
            }
        });
        all.push((name.to_owned(), scene, settings));
    }
    all
}

fn worst(a: &Image, b: &Image) -> (f32, f64) {
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let (most, sum) = pairs.fold((0.0_f32, 0.0), |(most, sum), (a, b)| {
        ((a - b).abs().max(most), sum + f64::from(a - b).powi(2))
    });
    (most, (sum / (4 * a.pixels.len()) as f64).sqrt())
}

#[test]
fn a_gpu_sees_surfaces_as_the_cpu_does_and_one_percent_is_noticed() {
    let Some(gpu) = gpu() else { return };
    for bent in [1.0, 1.01] {
        for ((name, scene, settings), (.., right, _)) in
            pictures(bent).into_iter().zip(pictures(1.0))
        {
            let cpu = CpuBackend.render(&right, &settings, &Silent).unwrap();
            let own = gpu.render(&scene, &settings, &Silent).unwrap();
            let found = worst(&cpu, &own);
            let bright = cpu.pixels.iter().flatten().fold(0.0_f32, |most, &c| most.max(c));
            eprintln!("{name}, {bent}: {found:?}, brightest {bright}");
        }
    }
}
