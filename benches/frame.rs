//! Benchmarks of the CPU backend: map and camera march of the presets, 512 x 512 each.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use deepshadow::backend::{Backend, Passes};
use deepshadow::cpu::CpuBackend;
use deepshadow::frame::Frame;
use deepshadow::io::load_volume;
use deepshadow::progress::Silent;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::descriptor;
use deepshadow::volume::presets::Preset;

fn frame(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cpu");
    group.sample_size(10);
    for preset in Preset::ALL {
        let file = descriptor(preset).unwrap();
        let volume = load_volume(&file.volume[0]).unwrap();
        let (scene, settings, _) =
            complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let (beam, name) = (scene.only_beam().unwrap(), preset.name());
        group.bench_function(format!("map {name}"), |bencher| {
            bencher.iter(|| CpuBackend.map(&beam, &settings, &Silent).unwrap());
        });
        let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
        let frame = Frame::new(&beam, &settings).unwrap();
        group.bench_function(format!("view {name}"), |bencher| {
            bencher.iter(|| {
                CpuBackend.march_view((&scene.media).into(), &frame, &map, &Silent).unwrap()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, frame);
criterion_main!(benches);
