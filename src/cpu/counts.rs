//! Tests of how many density samples the passes take, which determines their speed on any machine.
//! Other backends take the same steps.
#![allow(clippy::unwrap_used)]

use super::{march_view, trace_slices, trace_threshold};
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::frame::Frame;
use crate::kernel::density::counted::SAMPLES;
use crate::progress::Silent;
use crate::scene::automatic::{Surroundings, complete};
use crate::scene::descriptor;
use crate::volume::Axis;
use crate::volume::presets::Preset;

/// Samples per ray of (threshold map, fragment map, picture) at 64 x 64; rays that miss count too.
const EXPECTED: [(Preset, [f64; 3]); 4] = [
    (Preset::Box, [20.6, 92.9, 16.8]),
    (Preset::Bucky, [78.8, 129.4, 41.6]),
    (Preset::Rods, [15.1, 32.8, 14.7]),
    (Preset::Clouds, [46.1, 112.1, 16.0]),
];

/// Number of samples that some work takes on a thread of its own.
fn samples(work: impl FnOnce() + Send) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let count = pool.install(|| {
        SAMPLES.set(0);
        work();
        SAMPLES.get()
    });
    count as f64 / (64.0 * 64.0)
}

#[test]
fn passes_take_no_more_samples_than_they_did() {
    let mut found = Vec::new();
    let mut same = true;
    for (preset, expected) in EXPECTED {
        let file = descriptor(preset).unwrap();
        let up: Option<&str> = file.volume[0].up.as_deref();
        let volume = preset.volume(up.map_or(Axis::default(), |up| up.parse().unwrap())).unwrap();
        let (scene, settings, _) =
            complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let settings = settings.with(|s| {
            s.map.size = 64;
            s.image.size = [64, 64];
            // All pixels are marched.
            s.image.tolerance = 0.0;
        });
        let (media, frame) =
            (&scene.media, Frame::new(&scene.only_beam().unwrap(), &settings).unwrap());
        let map = CpuBackend.map(&scene.only_beam().unwrap(), &settings, &Silent).unwrap();
        let counts = [
            samples(|| drop(trace_threshold::trace_threshold(media.into(), &frame, &Silent))),
            samples(|| drop(trace_slices::trace_slices(media.into(), &frame, &Silent))),
            samples(|| drop(march_view::march_view(media.into(), &frame, &map, &Silent))),
        ];
        found.push(format!("{preset:?} {counts:.1?}"));
        // Fewer samples fail too, because the table would then be too loose a bound.
        same &= counts.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 0.02 * b);
    }
    assert!(same, "samples a ray are now {found:#?}");
}
