//! The GPU backend: map and camera march of the presets, 512 x 512 each, as milliseconds a pass from
//! many passes in one submission. Prints one table.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::sync::Arc;
use std::time::Instant;

use deepshadow::backend::Backend;
use deepshadow::frame::Frame;
use deepshadow::gpu::{AdapterChoice, GpuBackend, GpuShadow};
use deepshadow::io::load_volume;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{LightView, descriptor};
use deepshadow::volume::presets::Preset;

fn main() {
    let backend = GpuBackend::open(AdapterChoice::Any).unwrap();
    let gpu = backend.renderer();
    println!("{}", backend.description());
    println!("| volume | map ms | view ms |\n|---|---|---|");
    for preset in Preset::ALL {
        let file = descriptor(preset).unwrap();
        let volume = Arc::new(load_volume(&file.volume).unwrap());
        let (scene, settings, _) = complete(&file, volume, Surroundings::Studio).unwrap();
        let view = LightView::fit(&scene.light, &scene.volume).unwrap();
        let frame = Frame::with_light_view(&scene, &settings, &view).unwrap();
        let volume = gpu.upload(&scene.volume).unwrap();
        let parameters = gpu.frame(&frame, &volume).unwrap();
        let map = gpu.map(settings.map_size).unwrap();
        let image = gpu.image(settings.image_size[0], settings.image_size[1]).unwrap();
        let map_ms = milliseconds(|passes| {
            gpu.submit(|encoder| {
                for _ in 0..passes {
                    gpu.trace_threshold(encoder, &volume, &parameters, &map);
                }
            })
            .unwrap();
        });
        let view_ms = milliseconds(|passes| {
            gpu.submit(|encoder| {
                for _ in 0..passes {
                    let shadow = GpuShadow::Threshold(&map);
                    gpu.march_view(encoder, &volume, &parameters, shadow, &image);
                }
            })
            .unwrap();
        });
        println!("| {} | {map_ms:.3} | {view_ms:.3} |", preset.name());
    }
}

/// Milliseconds a pass: the median of five submissions of as many passes as fill 50 ms.
fn milliseconds(mut submit: impl FnMut(u32)) -> f64 {
    let mut timed = |passes: u32| {
        let begun = Instant::now();
        submit(passes);
        begun.elapsed().as_secs_f64() * 1e3
    };
    timed(1);
    let passes = (50.0 / timed(1)).ceil().clamp(1.0, 500.0) as u32;
    let mut times: Vec<f64> = (0..5).map(|_| timed(passes) / f64::from(passes)).collect();
    times.sort_by(f64::total_cmp);
    times[2]
}
