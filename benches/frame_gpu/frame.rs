//! The main result: the shipped frame, which is a map and a picture, against brute force on the
//! same scene.

use deepshadow::frame::Frame;
use deepshadow::gpu::{GpuFragments, GpuFrame, GpuShadow, Tile, frame_of_nested};
use deepshadow::settings::{Filter, Lookup};

use crate::bench::{Bench, CONVERGED, difference, map_size, size};
use crate::brute_force::{BruteForce, FETCHES, STEPS};
use crate::clock::Clock;
use crate::device::Gpu;
use crate::scenes::{close, map_rays, picture_rays};

/// Initial capacity of fragment maps, in nodes per texel, as in the crate.
const NODES: u32 = 32;

/// The measurements of a scene.
struct Row {
    name: String,
    texture: String,
    /// Rays of the map and of the picture that hit the volume's box.
    covered: [u32; 2],
    /// Milliseconds of a frame: by brute force, with a threshold map, with a fragment map, with a map
    /// of nested knots.
    frames: [f64; 4],
    /// Milliseconds of the view alone, with each of the three maps.
    views: [f64; 3],
    /// Milliseconds of coding lists in nested knots.
    coding: f64,
    /// Fetches per millisecond.
    fetch_rate: f64,
    /// Largest difference, and number of pixels above 1/255: of the threshold frame and the
    /// fragment frame from their converged pictures, of the nested frame from that of fragments, and
    /// of the brute-force picture from the crate's converged picture of the same kind.
    differences: [(f32, u32); 4],
}

/// Prints the tables of the frame.
pub fn table(gpu: &Gpu) {
    let clock = Clock::new(gpu);
    let rows: Vec<Row> =
        close().iter().map(|make| row(gpu, &clock, &make(&gpu.renderer))).collect();
    let (side, map) = (size(), map_size());
    println!(
        "\nFrame = map of {map} x {map} and picture of {side} x {side}, one camera ray a pixel. Times: \
         medians in turns, {}",
        clock.method()
    );
    println!("\n| volume | texture | map covered | picture covered | fetches, G/s |");
    println!("|---|---|---|---|---|");
    for row in &rows {
        let [map, picture] = [map, side].map(|edge| 100.0 / f64::from(edge * edge));
        let [map, picture] = [map * f64::from(row.covered[0]), picture * f64::from(row.covered[1])];
        let rate = row.fetch_rate * 1e-6;
        println!("| {} | {} | {map:.0} % | {picture:.0} % | {rate:.3} |", row.name, row.texture);
    }
    println!("\nms; brute force: {STEPS} steps on every ray of the map and of the picture");
    println!(
        "| volume | brute force | threshold frame | fragment frame | nested frame | threshold view | \
         fragment view | nested view | code_nested | brute force's fetches alone |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for row in &rows {
        let times = [&row.frames[..], &row.views[..], &[row.coding, row.fetches_ms()]].concat();
        println!("| {} | {} |", row.name, cells(&times, 3));
    }
    println!(
        "\n| volume | brute force / threshold frame | brute force / fragment frame | threshold frame / \
         fetches alone | fragment frame / fetches alone | threshold views a second | fragment views a \
         second |"
    );
    println!("|---|---|---|---|---|---|---|");
    for row in &rows {
        let [brute, threshold, fragments, _] = row.frames;
        let fetches = row.fetches_ms();
        let ratios =
            [brute / threshold, brute / fragments, threshold / fetches, fragments / fetches];
        let [a, b, _] = row.views.map(|ms| 1e3 / ms);
        println!("| {} | {} | {a:.0} | {b:.0} |", row.name, cells(&ratios, 2));
    }
    println!("\nLargest difference, 1/255 (pixels above 1), from {CONVERGED} steps");
    println!("| volume | threshold frame | fragment frame | nested frame | brute force |");
    println!("|---|---|---|---|---|");
    for row in &rows {
        let shown = row.differences.map(|(most, above)| format!("{most:.2} ({above})"));
        println!("| {} | {} |", row.name, shown.join(" | "));
    }
}

impl Row {
    /// Milliseconds that a brute-force frame's fetches take at the measured rate.
    fn fetches_ms(&self) -> f64 {
        let rays: f64 = self.covered.map(f64::from).iter().sum();
        rays * f64::from(STEPS) / self.fetch_rate
    }
}

fn cells(numbers: &[f64], digits: usize) -> String {
    let shown: Vec<String> = numbers.iter().map(|n| format!("{n:.digits$}")).collect();
    shown.join(" | ")
}

fn row(gpu: &Gpu, clock: &Clock<'_>, bench: &Bench<'_>) -> Row {
    let (renderer, side) = (bench.gpu, bench.settings.map.size);
    let volume = bench.scene.media.plain().unwrap();
    let shipped = Frame::new(&bench.beam, &bench.settings).unwrap();
    let rays = 2 * side;
    let brute_force = BruteForce::new(gpu, volume, &shipped, rays);

    let frame = bench.frame(&bench.settings, |_| ());
    let threshold = renderer.map(side).unwrap();
    let fragments = fitted(bench, &frame);
    let to_code = bench.frame(&bench.settings, |frame| *frame = frame_of_nested(frame));
    let lists = fitted(bench, &to_code);
    let nested = renderer.nested(side).unwrap();
    let code = renderer.prepare_nested(&to_code, &lists, &nested);
    renderer
        .submit(|encoder| {
            renderer.trace_threshold(encoder, &bench.volume, &frame, &threshold)?;
            code.record(encoder)
        })
        .unwrap();
    let view = |encoder: &mut _, shadow| {
        renderer.march_view(encoder, &bench.volume, &frame, shadow, &bench.image).unwrap();
    };
    let by_threshold = GpuShadow::Threshold(&threshold);
    let by_fragments = GpuShadow::Fragments(&fragments);
    let by_nested = GpuShadow::Nested(&nested);
    let truth = converged(bench, true);
    let differences = [
        difference(&bench.picture(&frame, by_threshold), &converged(bench, false)),
        difference(&bench.picture(&frame, by_fragments), &truth),
        difference(&bench.picture(&frame, by_nested), &truth),
        difference_of_brute_force(gpu, bench, &shipped),
    ];
    let [brute, a, b, c, d, e, f, coding, fetches] = clock.interleaved([
        &|encoder| brute_force.record_frame(encoder),
        &|encoder| {
            renderer.trace_threshold(encoder, &bench.volume, &frame, &threshold).unwrap();
            view(encoder, by_threshold);
        },
        &|encoder| {
            renderer.trace_slices(encoder, &bench.volume, &frame, &fragments).unwrap();
            view(encoder, by_fragments);
        },
        &|encoder| {
            renderer.trace_slices(encoder, &bench.volume, &to_code, &lists).unwrap();
            code.record(encoder).unwrap();
            view(encoder, by_nested);
        },
        &|encoder| view(encoder, by_threshold),
        &|encoder| view(encoder, by_fragments),
        &|encoder| view(encoder, by_nested),
        &|encoder| code.record(encoder).unwrap(),
        &|encoder| brute_force.record_fetches(encoder),
    ]);
    let dims = volume.dims().map(|n| n.to_string()).join(" x ");
    Row {
        name: bench.name.clone(),
        texture: format!("{dims} {:?}", brute_force.format),
        covered: [
            map_rays(&bench.scene, &bench.beam.view, side),
            picture_rays(&bench.scene, size()),
        ],
        frames: [brute, a, b, c],
        views: [d, e, f],
        coding,
        fetch_rate: f64::from(rays * rays) * f64::from(FETCHES) / fetches,
        differences,
    }
}

/// The fragment map of a frame, with enough room for all nodes.
pub fn fitted(bench: &Bench<'_>, frame: &GpuFrame) -> GpuFragments {
    let (gpu, size) = (bench.gpu, bench.settings.map.size);
    let mut nodes = NODES;
    loop {
        let map = gpu.fragments(Tile::rows(size, 0, size, nodes)).unwrap();
        gpu.submit(|encoder| gpu.trace_slices(encoder, &bench.volume, frame, &map)).unwrap();
        match gpu.nodes_missing(&map).unwrap() {
            Some(needed) => nodes = needed,
            None => return map,
        }
    }
}

fn many_steps(frame: &mut Frame) {
    frame.take_light_steps(CONVERGED);
    frame.take_view_steps(CONVERGED);
}

/// The picture with many steps, through a map with as many.
fn converged(bench: &Bench<'_>, fragments: bool) -> Vec<[f32; 4]> {
    let frame = bench.frame(&bench.settings, many_steps);
    if fragments {
        return bench.picture(&frame, GpuShadow::Fragments(&fitted(bench, &frame)));
    }
    through_threshold_map(bench, &frame)
}

fn through_threshold_map(bench: &Bench<'_>, frame: &GpuFrame) -> Vec<[f32; 4]> {
    let gpu = bench.gpu;
    let map = gpu.map(bench.settings.map.size).unwrap();
    gpu.submit(|encoder| gpu.trace_threshold(encoder, &bench.volume, frame, &map)).unwrap();
    bench.picture(frame, GpuShadow::Threshold(&map))
}

/// The difference of the brute-force picture from the crate's own picture with many steps and the
/// paper's lookup in the nearest texel, both without ground. It shows that the brute-force picture
/// is right.
fn difference_of_brute_force(gpu: &Gpu, bench: &Bench<'_>, shipped: &Frame) -> (f32, u32) {
    let settings = bench.settings.with(|s| {
        s.map.threshold.lookup = Lookup::Paper;
        s.map.filter = Filter::Nearest;
    });
    let frame = bench.frame(&settings, |frame| {
        many_steps(frame);
        frame.view.ground.exists = 0;
    });
    let truth = through_threshold_map(bench, &frame);
    let volume = bench.scene.media.plain().unwrap();
    difference(&BruteForce::new(gpu, volume, shipped, 8).picture(gpu), &truth)
}
