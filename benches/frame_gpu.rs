//! The GPU backend: every pass on the presets, 512 x 512 each, as milliseconds a pass from many passes
//! in one submission. Prints the tables named as arguments (maps, drawn, views, filters), or all;
//! `DEEPSHADOW_BENCH_SIZE` makes maps and pictures smaller.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::time::Instant;

use deepshadow::backend::Backend;
use deepshadow::frame::Frame;
use deepshadow::gpu::{
    AdapterChoice, GpuBackend, GpuFragments, GpuFrame, GpuImage, GpuMedia, GpuShadow, Renderer,
    Tile,
};
use deepshadow::io::load_volume;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{LightView, Scene, descriptor};
use deepshadow::settings::{Filter, Lookup, MapKind, Settings, Slices};
use deepshadow::volume::presets::Preset;

/// Slabs a ray of the map's table, and steps of the naive threshold map beside it.
const SLABS: u32 = 256;
const NAIVE_STEPS: u32 = 512;
/// Steps of a picture that counts as converged.
const CONVERGED: u32 = 4096;

/// Prints one table.
type Table = fn(&[Bench<'_>]);

struct Bench<'a> {
    gpu: &'a Renderer,
    name: &'static str,
    scene: Scene,
    view: LightView,
    volume: GpuMedia,
    settings: Settings,
    image: GpuImage,
}

fn main() {
    let backend = GpuBackend::open(AdapterChoice::Any).unwrap();
    println!("{}", backend.description());
    let benches: Vec<Bench<'_>> =
        Preset::ALL.into_iter().map(|preset| Bench::new(backend.renderer(), preset)).collect();
    // Clocks rise with work.
    for bench in &benches {
        bench.threshold_ms(&bench.frame(&bench.settings, |_| ()));
    }
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let tables: [(&str, Table); 4] =
        [("maps", maps), ("drawn", drawn), ("views", views), ("filters", filters)];
    for (name, table) in tables {
        if asked.is_empty() || asked.iter().any(|one| one == name) {
            table(&benches);
        }
    }
}

/// What it takes to build each kind of map.
fn maps(benches: &[Bench<'_>]) {
    println!("\nMap, ms: naive = threshold map of {NAIVE_STEPS} steps; the rest {SLABS} slabs");
    println!(
        "| volume | naive | threshold | raw | fitted | fitted, default slabs | nodes a texel |"
    );
    println!("|---|---|---|---|---|---|---|");
    for bench in benches {
        let paper = Settings { lookup: Lookup::Paper, ..bench.settings.clone() };
        let naive = bench.threshold_ms(&bench.frame(&paper, |f| {
            f.steps = [NAIVE_STEPS, NAIVE_STEPS, f.steps[2], f.steps[3]];
        }));
        let threshold = bench.threshold_ms(&bench.frame(&bench.settings, |_| ()));
        let exact = Settings { tolerance: 0.0, ..bench.settings.clone() };
        let slabs = |f: &mut Frame| f.steps = [SLABS, SLABS, f.steps[2], f.steps[3]];
        let raw = bench.slices(&bench.frame(&exact, slabs), SLABS + 1);
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

/// The same planes drawn as geometry, and sorted.
fn drawn(benches: &[Bench<'_>]) {
    println!("\nDrawn and sorted, ms: {SLABS} planes");
    println!("| volume | raw | fitted | fragments a texel |\n|---|---|---|---|");
    for bench in benches {
        let drawn = |tolerance: f64| {
            let settings = Settings {
                slices: Slices::Raster,
                steps: SLABS,
                tolerance,
                ..bench.settings.clone()
            };
            bench.drawn(&bench.frame(&settings, |_| ()))
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

/// The camera march with the fitted map, in both layouts, and with the threshold map.
fn views(benches: &[Bench<'_>]) {
    println!("\nView, ms, lit through the fitted map; difference from {CONVERGED} steps in 1/255");
    println!(
        "| volume | steps | interleaved | contiguous | difference | pixels above 1 | threshold map |"
    );
    println!("|---|---|---|---|---|---|---|");
    for bench in benches {
        let parameters = bench.frame(&bench.settings, |_| ());
        let Some((_, map)) = bench.slices(&parameters, 64) else { continue };
        let runs = bench.gpu.read_fragments(&map).unwrap();
        let contiguous = bench.gpu.upload_fragments(&runs, bench.settings.map_size).unwrap();
        let threshold = bench.gpu.map(bench.settings.map_size).unwrap();
        bench
            .gpu
            .submit(|encoder| {
                bench.gpu.trace_threshold(encoder, &bench.volume, &parameters, &threshold);
            })
            .unwrap();
        let steps = |n: u32| move |f: &mut Frame| f.steps = [f.steps[0], f.steps[1], n, n];
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
            let differences = picture.iter().zip(&truth).map(|(a, b)| {
                let channels = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                255.0 * channels.fold(0.0, f32::max)
            });
            let (most, above) = differences
                .fold((0.0_f32, 0), |(most, above), d| (most.max(d), above + u32::from(d > 1.0)));
            let steps = if n == 0 { "default".to_owned() } else { n.to_string() };
            println!(
                "| {} | {steps} | {a:.3} | {b:.3} | {most:.2} | {above} | {c:.3} |",
                bench.name
            );
        }
    }
}

/// Wide filters over raw lists, along links and by brute force.
fn filters(benches: &[Bench<'_>]) {
    println!("\nView with n x n filters over raw lists, ms: links / brute force");
    println!("| volume | pcf3 | pcf5 | pcf7 | ratio at 7 |\n|---|---|---|---|---|");
    for bench in benches {
        let exact = Settings { tolerance: 0.0, truncation: 0.0, ..bench.settings.clone() };
        let parameters = bench.frame(&exact, |f| f.steps = [SLABS, SLABS, f.steps[2], f.steps[3]]);
        let Some((_, map)) = bench.slices(&parameters, SLABS + 1) else { continue };
        let mut linked = None;
        bench.gpu.submit(|encoder| linked = Some(bench.gpu.link_neighbors(encoder, map))).unwrap();
        let linked = linked.unwrap();
        let times = [Filter::Pcf3, Filter::Pcf5, Filter::Pcf7].map(|filter| {
            let [by_links, brute] = [1, 0].map(|links| {
                let settings = Settings { filter, ..exact.clone() };
                let parameters = bench.frame(&settings, |f| f.counts[2] = links);
                bench.view_ms(&parameters, GpuShadow::Fragments(&linked))
            });
            (by_links, brute)
        });
        let cells = times.map(|(by_links, brute)| format!("{by_links:.2} / {brute:.2}"));
        println!("| {} | {} | {:.2} |", bench.name, cells.join(" | "), times[2].1 / times[2].0);
    }
}

impl<'a> Bench<'a> {
    fn new(gpu: &'a Renderer, preset: Preset) -> Self {
        let size = std::env::var("DEEPSHADOW_BENCH_SIZE").ok().and_then(|n| n.parse().ok());
        let size = size.unwrap_or(512);
        let file = descriptor(preset).unwrap();
        let volume = load_volume(file.volume.first()).unwrap();
        let (scene, settings, _) =
            complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let settings = Settings {
            map: Some(MapKind::Fragments),
            map_size: size,
            image_size: [size; 2],
            ..settings
        };
        let view = LightView::fit(scene.light(), &scene.media).unwrap();
        let volume = gpu.upload(&scene.media).unwrap();
        let image = gpu.image(size, size).unwrap();
        Self { gpu, name: preset.name(), scene, view, volume, settings, image }
    }

    fn frame(&self, settings: &Settings, change: impl FnOnce(&mut Frame)) -> GpuFrame {
        let mut frame = Frame::with_light_view(&self.scene, settings, &self.view).unwrap();
        frame.counts[2] = 0;
        change(&mut frame);
        self.gpu.frame(&frame, &self.volume).unwrap()
    }

    fn threshold_ms(&self, frame: &GpuFrame) -> f64 {
        let map = self.gpu.map(self.settings.map_size).unwrap();
        milliseconds(|passes| {
            self.gpu
                .submit(|encoder| {
                    for _ in 0..passes {
                        self.gpu.trace_threshold(encoder, &self.volume, frame, &map);
                    }
                })
                .unwrap();
        })
    }

    /// Pass `trace_slices` with room for a number of nodes a texel, if the device has as much.
    fn slices(&self, frame: &GpuFrame, nodes: u32) -> Option<(f64, GpuFragments)> {
        let size = self.settings.map_size;
        let map = self.gpu.fragments(Tile::rows(size, 0, size, nodes)).ok()?;
        let ms = milliseconds(|passes| {
            self.gpu
                .submit(|encoder| {
                    for _ in 0..passes {
                        self.gpu.trace_slices(encoder, &self.volume, frame, &map);
                    }
                })
                .unwrap();
        });
        assert_eq!(self.gpu.nodes_missing(&map).unwrap(), None, "nodes were lost");
        Some((ms, map))
    }

    /// Mean and largest number of nodes a texel.
    fn nodes(&self, map: &GpuFragments) -> String {
        let runs = self.gpu.read_fragments(map).unwrap();
        let most = runs.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
        format!("{:.1}, at most {most}", runs.nodes().len() as f64 / runs.texels() as f64)
    }

    /// Passes `raster_slices` and `sort_fragments`, one submission each, as their buffers are large:
    /// milliseconds and fragments a texel.
    fn drawn(&self, frame: &GpuFrame) -> Option<(f64, f64)> {
        let size = self.settings.map_size;
        let lists = |capacity: u32| self.gpu.lists(Tile::rows(size, 0, size, capacity));
        let draw = |encoder: &mut _, lists: &_| {
            self.gpu.raster_slices(encoder, &self.volume, frame, SLABS, lists);
        };
        let none = lists(0);
        self.gpu.submit(|encoder| draw(encoder, &none)).unwrap();
        let drawn = self.gpu.fragments_drawn(&none).unwrap();
        if u64::from(drawn) * 16 > 2 << 30 {
            return None;
        }
        let room = lists(drawn);
        let mut times: Vec<f64> = (0..5)
            .map(|_| {
                let begun = Instant::now();
                self.gpu
                    .submit(|encoder| {
                        draw(encoder, &room);
                        self.gpu.sort_fragments(encoder, frame, &room, drawn).unwrap();
                    })
                    .unwrap();
                begun.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        Some((times[2], f64::from(drawn) / f64::from(size * size)))
    }

    fn march(&self, frame: &GpuFrame, shadow: GpuShadow<'_>, passes: u32) {
        self.gpu
            .submit(|encoder| {
                for _ in 0..passes {
                    self.gpu.march_view(encoder, &self.volume, frame, shadow, &self.image);
                }
            })
            .unwrap();
    }

    fn view_ms(&self, frame: &GpuFrame, shadow: GpuShadow<'_>) -> f64 {
        milliseconds(|passes| self.march(frame, shadow, passes))
    }

    fn picture(&self, frame: &GpuFrame, shadow: GpuShadow<'_>) -> Vec<[f32; 4]> {
        self.march(frame, shadow, 1);
        self.gpu.read(self.image.texture()).unwrap()
    }
}

fn shown(ms: Option<f64>) -> String {
    ms.map_or("-".to_owned(), |ms| format!("{ms:.3}"))
}

/// Milliseconds a pass: the median of five submissions of as many passes as fill 30 ms.
fn milliseconds(mut submit: impl FnMut(u32)) -> f64 {
    let mut timed = |passes: u32| {
        let begun = Instant::now();
        submit(passes);
        begun.elapsed().as_secs_f64() * 1e3
    };
    timed(1);
    let passes = (30.0 / timed(1)).ceil().clamp(1.0, 300.0) as u32;
    let mut times: Vec<f64> = (0..5).map(|_| timed(passes) / f64::from(passes)).collect();
    times.sort_by(f64::total_cmp);
    times[2]
}
