//! Media whose channels have different extinction: map and picture of all channels together, against
//! a map and a picture of each, and against grey media.

use deepshadow::frame::Frame;
use deepshadow::gpu::{GpuFragments, GpuMedia, GpuShadow, Prepared, Tile};
use deepshadow::scene::Beam;
use deepshadow::settings::Settings;
use deepshadow::volume::presets::Preset;
use glam::DVec3;
use wgpu::CommandEncoder;

use crate::bench::{Bench, size};
use crate::clock::Clock;
use crate::device::Gpu;
use crate::scenes::preset;

/// Factors on the extinction of red, green and blue.
const TINT: DVec3 = DVec3::new(0.5, 1.0, 1.6);
/// Room in lists, in nodes per texel.
const NODES: u32 = 128;

/// Prints the table.
pub fn table(gpu: &Gpu) {
    let clock = Clock::new(gpu);
    println!(
        "\nColoured extinction (factors {TINT}), fragments, map and picture of {0}x{0}: \
         milliseconds; {1}",
        size(),
        clock.method()
    );
    println!("| volume | grey | all channels together | a beam for each |");
    println!("|---|---|---|---|");
    for of in Preset::ALL {
        let mut bench = preset(&gpu.renderer, of);
        let grey = lit(&bench, &bench.scene.beams().unwrap());
        bench.scene.media.medium_mut().tint = TINT;
        let shared = bench.scene.beams_for(&bench.settings).unwrap();
        assert_eq!(shared.len(), 1, "the channels share a beam");
        let together = lit(&bench, &shared);
        let apart = lit(&bench, &bench.scene.beams().unwrap());
        let [grey, together, apart] = clock.interleaved([
            &|encoder| record(&grey, encoder),
            &|encoder| record(&together, encoder),
            &|encoder| record(&apart, encoder),
        ]);
        println!("| {} | {grey:.3} | {together:.3} | {apart:.3} |", bench.name);
    }
}

/// The passes of a beam, and what they work on.
struct Lit {
    trace: Prepared,
    view: Prepared,
    _on_device: (GpuMedia, GpuFragments),
}

/// Prepares map and picture of each beam.
fn lit(bench: &Bench<'_>, beams: &[Beam]) -> Vec<Lit> {
    beams.iter().map(|beam| lit_beam(bench, beam, &bench.settings)).collect()
}

fn lit_beam(bench: &Bench<'_>, beam: &Beam, settings: &Settings) -> Lit {
    let gpu = bench.gpu;
    let media = gpu.upload(&beam.media).unwrap();
    let mut frame = Frame::new(beam, settings).unwrap();
    frame.map.follows_links = 0;
    let frame = gpu.frame(&frame, &media).unwrap();
    let map_size = settings.map.size;
    let map = gpu.fragments(Tile::rows(map_size, 0, map_size, NODES)).unwrap();
    let trace = gpu.prepare_slices(&media, &frame, &map);
    let view = gpu.prepare_view(&media, &frame, GpuShadow::Fragments(&map), &bench.image);
    Lit { trace, view, _on_device: (media, map) }
}

fn record(lit: &[Lit], encoder: &mut CommandEncoder) {
    for one in lit {
        one.trace.record(encoder).unwrap();
        one.view.record(encoder).unwrap();
    }
}
