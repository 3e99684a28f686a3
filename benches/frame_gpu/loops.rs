//! A program that draws frame after frame: wall-clock time including all work of the host, with
//! prepared passes or with passes that are recorded anew.

use std::collections::VecDeque;
use std::time::Instant;

use deepshadow::frame::Frame;
use deepshadow::gpu::GpuShadow;
use deepshadow::scene::{LightKind, Scene};
use glam::DQuat;

use crate::bench::Bench;
use crate::device::Gpu;
use crate::scenes::close;

/// Number of frames drawn for a measurement: on hardware, and on software.
const FRAMES: u32 = 1000;
const SOFTWARE_FRAMES: u32 = 8;
/// Number of frames in flight before the host waits for the first of them.
const AHEAD: usize = 8;
/// Angle in radians by which the camera or the light turns about the vertical between two frames.
const TURN: f64 = 1e-3;

/// Prints the table of loops.
pub fn table(gpu: &Gpu) {
    println!("\nFrames a second, drawn one after another (wall clock, threshold maps)");
    println!(
        "| volume | camera moves | the same, recorded anew | light moves | the same, recorded anew |"
    );
    println!("|---|---|---|---|---|");
    for make in close() {
        let bench = make(&gpu.renderer);
        let rates = [(false, true), (false, false), (true, true), (true, false)]
            .map(|(light, prepared)| format!("{:.0}", rate(gpu, &bench, light, prepared)));
        println!("| {} | {} |", bench.name, rates.join(" | "));
    }
}

/// Frames per second while the camera moves, or the light.
fn rate(gpu: &Gpu, bench: &Bench<'_>, light: bool, prepared: bool) -> f64 {
    let renderer = bench.gpu;
    let map = renderer.map(bench.settings.map.size).unwrap();
    let shadow = GpuShadow::Threshold(&map);
    let held = bench.frame(&bench.settings, |_| ());
    let trace = renderer.prepare_threshold(&bench.volume, &held, &map);
    let view = renderer.prepare_view(&bench.volume, &held, shadow, &bench.image);
    let mut scene = bench.scene.clone();
    renderer.submit(|encoder| trace.record(encoder)).unwrap();
    let frames = if gpu.is_software() { SOFTWARE_FRAMES } else { FRAMES };
    let mut under_way = VecDeque::new();
    let begun = Instant::now();
    for _ in 0..frames {
        if light {
            turn_light(&mut scene);
        } else {
            let turned =
                DQuat::from_rotation_y(TURN) * (scene.camera.position - scene.camera.target);
            scene.camera.position = scene.camera.target + turned;
        }
        let frame = Frame::new(&scene.only_beam().unwrap(), &bench.settings).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if prepared {
            renderer.update(&held, &frame, &bench.volume).unwrap();
            if light {
                trace.record(&mut encoder).unwrap();
            }
            view.record(&mut encoder).unwrap();
        } else {
            let held = renderer.frame(&frame, &bench.volume).unwrap();
            if light {
                renderer.trace_threshold(&mut encoder, &bench.volume, &held, &map).unwrap();
            }
            renderer.march_view(&mut encoder, &bench.volume, &held, shadow, &bench.image).unwrap();
        }
        under_way.push_back(gpu.queue.submit([encoder.finish()]));
        if under_way.len() > AHEAD {
            let submission_index = under_way.pop_front();
            gpu.device.poll(wgpu::PollType::Wait { submission_index, timeout: None }).unwrap();
        }
    }
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    f64::from(frames) / begun.elapsed().as_secs_f64()
}

fn turn_light(scene: &mut Scene) {
    if let LightKind::Directional { direction } = &mut scene.lights[0].kind {
        *direction = DQuat::from_rotation_y(TURN) * *direction;
    }
}
