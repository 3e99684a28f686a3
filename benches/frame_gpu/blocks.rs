//! The same scenes with their volumes in blocks, as sparse grids are stored: the cost of reading
//! the table.

use std::sync::Arc;

use deepshadow::gpu::GpuShadow;
use deepshadow::scene::Media;
use deepshadow::volume::Volume;

use crate::bench::Bench;
use crate::clock::Clock;
use crate::device::Gpu;
use crate::frame::fitted;
use crate::scenes::close;

/// Prints the table of blocks.
pub fn table(gpu: &Gpu) {
    let clock = Clock::new(gpu);
    println!("\nVolumes in blocks, ms (as one texture); {}", clock.method());
    println!("| volume | threshold map | threshold view | fragment map | fragment view |");
    println!("|---|---|---|---|---|");
    for make in close() {
        let whole = make(&gpu.renderer);
        let body = whole.scene.media.first().unwrap();
        let mut scene = whole.scene.clone();
        let volume = Volume::clone(&body.volume).sparse();
        scene.media = Media::of(Arc::new(volume), body.medium.clone());
        let blocks = Bench::new(&gpu.renderer, whole.name.clone(), scene, &whole.settings);
        let (a, b) = (times(&clock, &blocks), times(&clock, &whole));
        let cells: Vec<String> =
            a.iter().zip(b).map(|(blocks, whole)| format!("{blocks:.3} ({whole:.3})")).collect();
        println!("| {} | {} |", whole.name, cells.join(" | "));
    }
}

/// Milliseconds of the map's and the view's pass, for threshold and fragment maps.
fn times(clock: &Clock<'_>, bench: &Bench<'_>) -> [f64; 4] {
    let gpu = bench.gpu;
    let frame = bench.frame(&bench.settings, |_| ());
    let map = gpu.map(bench.settings.map.size).unwrap();
    let lists = fitted(bench, &frame);
    let (media, image) = (&bench.volume, &bench.image);
    let traces =
        [gpu.prepare_threshold(media, &frame, &map), gpu.prepare_slices(media, &frame, &lists)];
    let views = [GpuShadow::Threshold(&map), GpuShadow::Fragments(&lists)]
        .map(|shadow| gpu.prepare_view(media, &frame, shadow, image));
    clock.interleaved([
        &|encoder| traces[0].record(encoder).unwrap(),
        &|encoder| views[0].record(encoder).unwrap(),
        &|encoder| traces[1].record(encoder).unwrap(),
        &|encoder| views[1].record(encoder).unwrap(),
    ])
}
