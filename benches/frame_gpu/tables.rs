//! The tables of single passes: maps, drawn maps, views and wide filters.

use deepshadow::frame::Frame;
use deepshadow::gpu::GpuShadow;
use deepshadow::settings::{Filter, Lookup, Slices};

use crate::bench::{Bench, CONVERGED, difference};

/// Slabs per ray in the table of maps, and steps of the naive threshold map beside it.
const SLABS: u32 = 256;
const NAIVE_STEPS: u32 = 512;

/// The time to build each kind of map.
pub fn maps(benches: &[Bench<'_>]) {
    println!("\nMap, ms: naive = threshold map of {NAIVE_STEPS} steps; the rest {SLABS} slabs");
    println!(
        "| volume | naive | threshold | raw | fitted | fitted, default slabs | nodes a texel |"
    );
    println!("|---|---|---|---|---|---|---|");
    for bench in benches {
        let paper = bench.settings.with(|s| s.map.threshold.lookup = Lookup::Paper);
        let naive = bench.threshold_ms(&bench.frame(&paper, |f| {
            f.take_light_steps(NAIVE_STEPS);
        }));
        let threshold = bench.threshold_ms(&bench.frame(&bench.settings, |_| ()));
        let exact = bench.settings.with(|s| s.map.fragments.tolerance = 0.0);
        let slabs = |f: &mut Frame| f.take_light_steps(SLABS);
        let raw = bench.slices(&bench.frame(&exact, slabs), SLABS + 5);
        let fitted = bench.slices(&bench.frame(&bench.settings, slabs), 64);
        let default = bench.slices(&bench.frame(&bench.settings, |_| ()), 64);
        let nodes = default.as_ref().map_or("-".to_owned(), |(_, map)| bench.nodes(map));
        println!(
            "| {} | {naive:.3} | {threshold:.3} | {} | {} | {} | {nodes} |",
            bench.name,
            shown(raw.map(|(ms, _)| ms)),
            shown(fitted.map(|(ms, _)| ms)),
            shown(default.map(|(ms, _)| ms)),
        );
    }
}

/// The same planes, drawn as geometry and sorted.
pub fn drawn(benches: &[Bench<'_>]) {
    println!("\nDrawn and sorted, ms: {SLABS} planes");
    println!("| volume | raw | fitted | fragments a texel |\n|---|---|---|---|");
    for bench in benches {
        let drawn = |tolerance: f64| {
            let settings = bench.settings.with(|s| {
                s.map.fragments.slices = Slices::Raster;
                s.map.steps = SLABS;
                s.map.fragments.tolerance = tolerance;
            });
            bench.drawn(&bench.frame(&settings, |_| ()), SLABS)
        };
        let (raw, fitted) = (drawn(0.0), drawn(0.002));
        println!(
            "| {} | {} | {} | {:.1} |",
            bench.name,
            shown(raw.map(|(ms, _)| ms)),
            shown(fitted.map(|(ms, _)| ms)),
            raw.map_or(0.0, |(_, fragments)| fragments),
        );
    }
}

/// The camera march through the fitted map, in both layouts, and through the threshold map.
pub fn views(benches: &[Bench<'_>]) {
    println!("\nView, ms, lit through the fitted map; difference from {CONVERGED} steps in 1/255");
    println!(
        "| volume | steps | interleaved | contiguous | difference | pixels above 1 | threshold map |"
    );
    println!("|---|---|---|---|---|---|---|");
    for bench in benches {
        let parameters = bench.frame(&bench.settings, |_| ());
        let Some((_, map)) = bench.slices(&parameters, 64) else { continue };
        let runs = bench.gpu.read_fragments(&map).unwrap();
        let contiguous = bench.gpu.upload_fragments(&runs, bench.settings.map.size).unwrap();
        let threshold = bench.gpu.map(bench.settings.map.size).unwrap();
        bench
            .gpu
            .submit(|encoder| {
                bench.gpu.trace_threshold(encoder, &bench.volume, &parameters, &threshold)
            })
            .unwrap();
        let steps = |n: u32| move |f: &mut Frame| f.take_view_steps(n);
        let converged = bench.frame(&bench.settings, steps(CONVERGED));
        let truth = bench.picture(&converged, GpuShadow::Fragments(&map));
        for n in [0, 32, 48, 64, 96, 128] {
            let parameters = match n {
                0 => bench.frame(&bench.settings, |_| ()),
                n => bench.frame(&bench.settings, steps(n)),
            };
            let [a, b, c] = [
                GpuShadow::Fragments(&map),
                GpuShadow::Fragments(&contiguous),
                GpuShadow::Threshold(&threshold),
            ]
            .map(|shadow| bench.view_ms(&parameters, shadow));
            let picture = bench.picture(&parameters, GpuShadow::Fragments(&map));
            let (most, above) = difference(&picture, &truth);
            let steps = if n == 0 { "default".to_owned() } else { n.to_string() };
            println!(
                "| {} | {steps} | {a:.3} | {b:.3} | {most:.2} | {above} | {c:.3} |",
                bench.name
            );
        }
    }
}

/// Wide filters on raw lists, along links and with a search in each list.
pub fn filters(benches: &[Bench<'_>]) {
    println!("\nView with n x n filters over raw lists, ms: along links / by search");
    println!("| volume | pcf3 | pcf5 | pcf7 | ratio at 7 |\n|---|---|---|---|---|");
    for bench in benches {
        let exact = bench.settings.with(|s| {
            s.map.fragments.tolerance = 0.0;
            s.map.fragments.truncation = 0.0;
        });
        let parameters = bench.frame(&exact, |f| f.take_light_steps(SLABS));
        let Some((_, map)) = bench.slices(&parameters, SLABS + 5) else { continue };
        let mut linked = None;
        let record = |encoder: &mut _| {
            linked = Some(bench.gpu.link_neighbors(encoder, map)?);
            Ok(())
        };
        bench.gpu.submit(record).unwrap();
        let linked = linked.unwrap();
        let times = [Filter::Pcf3, Filter::Pcf5, Filter::Pcf7].map(|filter| {
            let [by_links, searched] = [1, 0].map(|links| {
                let settings = exact.with(|s| s.map.filter = filter);
                let parameters = bench.frame(&settings, |f| f.map.follows_links = links);
                bench.view_ms(&parameters, GpuShadow::Fragments(&linked))
            });
            (by_links, searched)
        });
        let cells = times.map(|(by_links, searched)| format!("{by_links:.2} / {searched:.2}"));
        println!("| {} | {} | {:.2} |", bench.name, cells.join(" | "), times[2].1 / times[2].0);
    }
}

fn shown(ms: Option<f64>) -> String {
    ms.map_or("-".to_owned(), |ms| format!("{ms:.3}"))
}
