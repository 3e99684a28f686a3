//! The race that the paper "Volumetric Deep Shadow Maps" reports: 180 to 330 frames a second on a
//! GeForce GTX 465, for its four volumes, with at most 512 steps for the map and for the picture and
//! 128 lookups along a camera ray. It does not say how large its pictures are.

use deepshadow::gpu::GpuShadow;
use deepshadow::settings::{Crossing, Lookup, MapKind, Shading};
use deepshadow::volume::presets::Preset;

use crate::bench::size;
use crate::clock::Clock;
use crate::device::Gpu;
use crate::scenes::preset;

/// The paper's steps along a light ray and along a camera ray.
const STEPS: u32 = 512;
/// Its lookups along a camera ray.
const LOOKUPS: u32 = 128;

/// Prints the table of the race.
pub fn table(gpu: &Gpu) {
    let clock = Clock::new(gpu);
    println!(
        "\nThe paper's settings, {STEPS} equal steps and {LOOKUPS} lookups, a map of {0}x{0}: frames \
         a second; {1}",
        size(),
        clock.method()
    );
    println!("| volume | picture | map and picture | picture alone |");
    println!("|---|---|---|---|");
    for of in Preset::ALL {
        let mut bench = preset(&gpu.renderer, of);
        for shape in [[size(), size()], [size() * 5 / 2, size() * 45 / 32]] {
            bench.settings.image.size = shape;
            bench.image = gpu.renderer.image(shape[0], shape[1]).unwrap();
            let settings = bench.settings.with(|s| {
                s.map.kind = Some(MapKind::Threshold);
                s.map.threshold.lookup = Lookup::Paper;
                s.map.threshold.crossing = Crossing::Smoothstep;
                s.view.shading = Shading::Paper;
                s.view.light_samples = LOOKUPS;
            });
            let frame = bench.frame(&settings, |frame| {
                frame.take_light_steps(STEPS);
                frame.take_view_steps(STEPS);
            });
            let map = gpu.renderer.map(settings.map.size).unwrap();
            let trace = gpu.renderer.prepare_threshold(&bench.volume, &frame, &map);
            let shadow = GpuShadow::Threshold(&map);
            let view = gpu.renderer.prepare_view(&bench.volume, &frame, shadow, &bench.image);
            let [both, alone] = clock.interleaved([
                &|encoder| {
                    trace.record(encoder).unwrap();
                    view.record(encoder).unwrap();
                },
                &|encoder| view.record(encoder).unwrap(),
            ]);
            let [width, height] = shape;
            println!(
                "| {} | {width}x{height} | {:.0} | {:.0} |",
                bench.name,
                1e3 / both,
                1e3 / alone
            );
        }
    }
}
