//! Benchmarks of the GPU backend: the shipped frame against brute force (table frame), frames drawn
//! one after another (loops), volumes in blocks (blocks), the race of the paper (paper), coloured
//! media (colours), hair in maps and in pictures (hair, hair_view), and each pass on the presets in
//! milliseconds per pass, from many passes in one submission (maps, drawn, views, filters). Prints
//! the tables named as arguments, or all. Maps and pictures are 512 x 512, unless
//! `DEEPSHADOW_BENCH_SIZE` makes them smaller; `DEEPSHADOW_BENCH_MAP` is the size of maps alone.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

mod bench;
mod blocks;
mod brute_force;
mod clock;
mod cloud;
mod colours;
mod device;
mod frame;
mod hair;
mod hair_view;
mod loops;
mod paper;
mod scenes;
mod tables;

use deepshadow::volume::presets::Preset;

use bench::Bench;
use device::Gpu;

/// A function that prints one table.
type Table = fn(&[Bench<'_>]);

fn main() {
    let gpu = Gpu::open();
    println!("{}", gpu.description);
    let names: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let asked = |name: &str| names.is_empty() || names.iter().any(|one| one == name);
    if asked("frame") {
        frame::table(&gpu);
    }
    for (name, table) in [
        ("loops", loops::table as fn(&Gpu)),
        ("blocks", blocks::table),
        ("paper", paper::table),
        ("colours", colours::table),
        ("hair", hair::table),
        ("hair_view", hair_view::table),
    ] {
        if asked(name) {
            table(&gpu);
        }
    }
    let tables: [(&str, Table); 4] = [
        ("maps", tables::maps),
        ("drawn", tables::drawn),
        ("views", tables::views),
        ("filters", tables::filters),
    ];
    if !tables.iter().any(|(name, _)| asked(name)) {
        return;
    }
    let benches = Preset::ALL.map(|preset| scenes::preset(&gpu.renderer, preset));
    // Clock rates rise under load, so warm up first.
    for bench in &benches {
        bench.threshold_ms(&bench.frame(&bench.settings, |_| ()));
    }
    for (name, table) in tables {
        if asked(name) {
            table(&benches);
        }
    }
}
