//! Benchmarks of the CPU's small functions, each over many calls at positions that a march would
//! visit: density samples, walks over bricks, fits, lookups; and ways to sort a texel's list.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::frame::Frame;
use deepshadow::io::load_volume;
use deepshadow::kernel::density::{Density, sample_density};
use deepshadow::kernel::fitting::Fitter;
use deepshadow::kernel::occupancy::{BATCH, Walk};
use deepshadow::kernel::slices::slabs_of;
use deepshadow::progress::Silent;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{Scene, descriptor};
use deepshadow::settings::{MapKind, Settings};
use deepshadow::shadow::{Map, Shadow};
use deepshadow::volume::presets::Preset;

/// Rays along each edge of the map that the benchmarks follow.
const RAYS: u32 = 32;
/// Number of density samples, and of lookups, on each ray.
const SAMPLES: u32 = 128;

struct Bench {
    scene: Scene,
    settings: Settings,
    frame: Frame,
}

impl Bench {
    fn new(preset: Preset) -> Self {
        let file = descriptor(preset).unwrap();
        let volume = load_volume(&file.volume[0]).unwrap();
        let (scene, settings, _) =
            complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let settings = settings.with(|s| s.map.size = 256);
        let frame = Frame::new(&scene.only_beam().unwrap(), &settings).unwrap();
        Self { scene, settings, frame }
    }

    /// Map positions of the rays.
    fn places() -> impl Iterator<Item = [f32; 2]> {
        let at = |i: u32| (i as f32 + 0.5) / RAYS as f32;
        (0..RAYS * RAYS).map(move |i| [at(i % RAYS), at(i / RAYS)])
    }

    fn map(&self, kind: MapKind) -> Map {
        let settings = self.settings.with(|s| s.map.kind = Some(kind));
        CpuBackend.map(&self.scene.only_beam().unwrap(), &settings, &Silent).unwrap()
    }
}

fn kernels(criterion: &mut Criterion) {
    let bench = Bench::new(Preset::Clouds);
    let frame = &bench.frame;
    let mut group = criterion.benchmark_group("kernels");
    group.throughput(Throughput::Elements(u64::from(RAYS * RAYS * SAMPLES)));

    let volume = bench.scene.media.plain().unwrap();
    let density = Density::of(volume);
    group.bench_function("sample_density", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            for [u, v] in Bench::places() {
                let slabs = slabs_of(frame, u, v);
                let step = (slabs.exit - slabs.enter) / SAMPLES as f32;
                for i in 0..SAMPLES {
                    sum += sample_density(&density, slabs.ray.at(slabs.enter + i as f32 * step));
                }
            }
            black_box(sum)
        });
    });

    for kind in [MapKind::Threshold, MapKind::Fragments] {
        let map = bench.map(kind);
        group.bench_function(format!("lookup {kind}"), |bencher| {
            bencher.iter(|| {
                let mut sum = 0.0;
                for [u, v] in Bench::places() {
                    let slabs = slabs_of(frame, u, v);
                    let step = (slabs.exit - slabs.enter) / SAMPLES as f32;
                    for i in 0..SAMPLES {
                        sum += map.lookup(0, u, v, slabs.enter + i as f32 * step);
                    }
                }
                black_box(sum)
            });
        });
    }

    group.bench_function("fit", |bencher| {
        bencher.iter(|| {
            let mut nodes = 0;
            for [u, _] in Bench::places() {
                let mut fitter = Fitter::new(0.002);
                for i in 0..SAMPLES {
                    let front = i as f32 / SAMPLES as f32;
                    let optical_depth = 0.05 * (1.0 + (20.0 * (u + front)).sin());
                    let bounds = [front, front + 1.0 / SAMPLES as f32];
                    fitter.add(bounds, optical_depth, &mut |_| nodes += 1);
                }
            }
            black_box(nodes)
        });
    });

    group.throughput(Throughput::Elements(u64::from(RAYS * RAYS)));
    group.bench_function("walk", |bencher| {
        bencher.iter(|| {
            let mut batches = 0;
            for [u, v] in Bench::places() {
                let slabs = slabs_of(frame, u, v);
                let occupancy = bench.scene.media.occupancy();
                let lengths = [slabs.step, frame.map.slabs.rough, frame.map.slabs.longest];
                let mut walk = Walk::new(occupancy, &slabs.ray, slabs.exit, lengths);
                let mut t = walk.next_place(slabs.enter);
                while t < slabs.exit {
                    t = walk.next_place(t + BATCH as f32 * walk.step_from(t));
                    batches += 1;
                }
            }
            black_box(batches)
        });
    });
    group.finish();
}

/// Numbers in no order, as fronts of a texel's list.
fn fronts(count: usize) -> Vec<f32> {
    (0..count).map(|i| (i as f32 * 0.618_034).fract()).collect()
}

fn insertion_sort(list: &mut [f32]) {
    for i in 1..list.len() {
        let own = list[i];
        let mut place = i;
        while place > 0 && list[place - 1] > own {
            list[place] = list[place - 1];
            place -= 1;
        }
        list[place] = own;
    }
}

/// Without recursion, as shaders need it: parts that are still to be sorted wait on a stack.
fn quicksort(list: &mut [f32]) {
    let mut waiting = vec![[0, list.len()]];
    while let Some([start, end]) = waiting.pop() {
        if end - start < 2 {
            continue;
        }
        let pivot = list[start + (end - start) / 2];
        let (mut low, mut high) = (start, end - 1);
        loop {
            while list[low] < pivot {
                low += 1;
            }
            while list[high] > pivot {
                high -= 1;
            }
            if low >= high {
                break;
            }
            list.swap(low, high);
            (low, high) = (low + 1, high - 1);
        }
        waiting.push([start, low]);
        waiting.push([low.max(start + 1), end]);
    }
}

/// Ways to sort a texel's list, by its length.
fn sorting(criterion: &mut Criterion) {
    type Sort = fn(&mut [f32]);
    let mut group = criterion.benchmark_group("sorting");
    let library: Sort = |list| list.sort_by(f32::total_cmp);
    for count in [8, 16, 32, 64, 250] {
        group.throughput(Throughput::Elements(count as u64));
        let mut due = fronts(count);
        due.sort_by(f32::total_cmp);
        for (name, sort) in
            [("insertion", insertion_sort as Sort), ("quicksort", quicksort), ("library", library)]
        {
            let mut list = fronts(count);
            sort(&mut list);
            assert_eq!(list, due, "{name}");
            group.bench_function(format!("{name} {count}"), |bencher| {
                bencher.iter_batched(
                    || fronts(count),
                    |mut list| {
                        sort(&mut list);
                        list
                    },
                    BatchSize::SmallInput,
                );
            });
        }
    }
    group.finish();
}

criterion_group!(benches, kernels, sorting);
criterion_main!(benches);
