//! Power moments of extinction over depth: moment shadow mapping (Peters and Klein 2015), applied
//! to media as in moment-based order-independent transparency (Muenstermann, Krumpen, Klein and
//! Peters 2018).
//!
//! Depth is mapped to -1..1 over the ray's length in the volume, without the authors' logarithm,
//! since no other depths occur. A moment is the mean of a power of that depth, weighted with
//! extinction. Distributions with these moments have a lowest and a highest possible optical depth
//! in front of a given depth; a lookup takes the lowest plus [`OVERESTIMATION`] times their
//! difference.

use rustfft::num_complex::Complex64;

use super::bytes::{f32_at, put_f32};
use super::canonical::representation;
use super::{Codec, TexelRay, optical, share, through};

/// Where between the lowest and the highest bound a lookup lies: the authors' value.
pub(super) const OVERESTIMATION: f64 = 0.25;

/// How much of the moments of [`bias`] is mixed into a texel's, for 4 and for 6 moments (the
/// authors' values). It keeps them the moments of some distribution after rounding to f32.
const BIAS: [f64; 2] = [5e-7, 5e-6];

/// A texel holds f32 numbers: the optical depth of the whole ray (b0), then moments 1 to 2 `half`,
/// each in -1..1: 20 bytes for 4 moments, 28 for 6.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    pub half: usize,
}

/// The even moments 2, 4, 6 of the bias (the authors' values); its odd moments are 0.
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

/// Mean of the `k`-th power of depth, mapped from 0..1 to -1..1, over the slab from share `a` to
/// share `b`.
fn mean_power(k: usize, slab: [f64; 2]) -> f64 {
    let [a, b] = slab.map(|share| 2.0 * share - 1.0);
    // (b^(k+1) - a^(k+1)) / (b - a), with the division carried out.
    let terms = (0..=k).map(|i| a.powi(i as i32) * b.powi((k - i) as i32));
    terms.sum::<f64>() / (k + 1) as f64
}
