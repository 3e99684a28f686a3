//! The accuracy of shadow maps: their error against the exact line integral, their size and their
//! speed. Knows neither how maps are built nor who uses the numbers.
//!
//! All maps are looked up at the same seeded points ([`Points`]), whose true transmittances are
//! integrated once in f64 by [`crate::reference`]. The measurement is a sample, so the largest
//! error found is not a bound.

mod errors;
mod exact;
mod picture;
mod points;
mod random;
mod surface_points;

use std::hint::black_box;

use rayon::prelude::*;
use web_time::Instant;

use crate::reference::Extinction;
use crate::scene::Beam;
use crate::shadow::Shadow;
pub use errors::{Errors, VISIBLE};
pub use exact::{ExactPoints, ExactTexels};
pub use picture::{Difference, PIXELS_PER_DEGREE, TruePicture};
pub use points::{Place, Points, Sample};
pub(crate) use random::Random;

/// Number of lookups that are timed together, and number of repetitions; the fastest one counts.
const TIMED_LOOKUPS: usize = 8_192;
const TIMED_RUNS: usize = 16;

/// The largest optical depth along the central rays of a map of `beam` with `map_size` squared
/// texels, exact to rounding.
pub fn largest_optical_depth(beam: &Beam, map_size: u32) -> f64 {
    let extinction = Extinction::of(&beam.media);
    let n = map_size as usize;
    let depth = |texel: usize| {
        let at = |i: usize| (i as f64 + 0.5) / n as f64;
        let (origin, direction) = beam.view.ray(at(texel % n), at(texel / n));
        extinction.optical_depth(origin, direction, [0.0, f64::INFINITY])
    };
    (0..n * n).into_par_iter().map(depth).reduce(|| 0.0, f64::max)
}

/// Time of a lookup in `map` on one CPU thread in nanoseconds, filtered by `window` as in
/// [`Points::errors`], at random points of the volume in random order, so that few are in a cache.
/// 0 if there are no points.
pub fn lookup_time(map: &dyn Shadow, points: &Points, window: u32) -> f64 {
    let samples = points.of(Place::Volume);
    let samples = &samples[..samples.len().min(TIMED_LOOKUPS)];
    let run = || {
        let begun = Instant::now();
        for sample in samples {
            let [u, v, depth] = black_box(sample.place);
            black_box(map.lookup(window, u, v, depth));
        }
        begun.elapsed().as_secs_f64()
    };
    let fastest = (0..TIMED_RUNS).map(|_| run()).fold(f64::INFINITY, f64::min);
    fastest * 1e9 / samples.len().max(1) as f64
}
