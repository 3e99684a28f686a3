//! Power moments of extinction over depth: moment shadow mapping (Peters and Klein 2015), for media
//! as in moment-based order-independent transparency (Muenstermann, Krumpen, Klein and Peters
//! 2018).
//!
//! Depth is mapped to -1..1 over the ray's way through the volume, without their logarithm, since
//! that way is all there is. A moment is the mean of a power of it, weighted with extinction. A
//! lookup has the lowest and the highest optical depth that distributions of these moments have in
//! front of a depth, and takes one between: the lowest and [`OVERESTIMATION`] of their difference.

use rustfft::num_complex::Complex64;

use super::bytes::{f32_at, put_f32};
use super::canonical::representation;
use super::{Codec, TexelRay, optical, share, through};

/// Which part of the way from the lowest to the highest bound is taken: the authors' value.
pub(super) const OVERESTIMATION: f64 = 0.25;

/// Moments are mixed with those of [`bias`] so that rounding to f32 leaves them the moments of some
/// distribution: how much of these, for 4 and for 6 moments, as the authors have it.
const BIAS: [f64; 2] = [5e-7, 5e-6];

/// Numbers of a texel (f32): the optical depth of the whole ray (b0), then moments 1 to 2 `half`,
/// each -1..1: 20 bytes for 4 moments, 28 for 6.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    pub half: usize,
}

/// The even moments 2, 4, 6 to which the odd ones of 0 belong, as the authors have them.
fn bias(half: usize) -> [f64; 3] {
    if half == 2 { [0.375, 0.375, 0.0] } else { [0.48, 0.451, 0.45] }
}

impl Codec for Moments {
    fn stride(&self) -> usize {
        4 * (1 + 2 * self.half)
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let total: f64 = ray.slabs().map(|(_, thickness)| thickness).sum();
        put_f32(texel, 0, ray.total());
        for k in 1..=2 * self.half {
            let powers = ray.slabs().map(|(slab, thickness)| thickness * mean_power(k, slab));
            put_f32(texel, k, (powers.sum::<f64>() / total.max(f64::MIN_POSITIVE)) as f32);
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let total = optical(f32_at(texel, 0));
        let place = share(extent, depth);
        if place == 0.0 || place == 1.0 {
            return through(total * place);
        }
        let amount = BIAS[self.half - 2];
        let bias = bias(self.half);
        let moment = |k: usize| match k {
            0 => 1.0,
            _ => {
                let biased = if k.is_multiple_of(2) { bias[k / 2 - 1] } else { 0.0 };
                f64::from(f32_at(texel, k)) * (1.0 - amount) + biased * amount
            }
        };
        let z0 = 2.0 * f64::from(place) - 1.0;
        let element = |i: usize, j: usize| moment(i + j).into();
        let points = representation(self.half, element, Complex64::from(z0));
        let others = points[1..].iter().filter(|(z, _)| z.re < z0).map(|(_, mass)| mass);
        let in_front = others.sum::<f64>() + OVERESTIMATION * points[0].1;
        through(total * in_front.min(1.0) as f32)
    }
}

/// Mean of power `k` of a depth mapped to -1..1, over the shares `a` to `b` of 0..1.
fn mean_power(k: usize, slab: [f64; 2]) -> f64 {
    let [a, b] = slab.map(|share| 2.0 * share - 1.0);
    // (b^(k+1) - a^(k+1)) / (b - a), divided out.
    let terms = (0..=k).map(|i| a.powi(i as i32) * b.powi((k - i) as i32));
    terms.sum::<f64>() / (k + 1) as f64
}
