//! Trigonometric moments of extinction over depth: moment-based order-independent transparency
//! (Muenstermann, Krumpen, Klein and Peters 2018).
//!
//! Depth over the ray's length in the volume is mapped to the angles of a circle except for its
//! last part, [`FREE`]. Moment k is the mean of exp(i k angle), weighted with extinction. A lookup
//! bounds optical depth as for power moments (see `moments`). Mass that the bound puts into the
//! free part lies between the end of the ray and its beginning; the nearer to the beginning, the
//! more of it counts.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex64;

use super::bytes::{f32_at, put_f32};
use super::canonical::representation;
use super::moments::OVERESTIMATION;
use super::{Codec, TexelRay, optical, share, through};

/// The part of the circle that no depth is mapped to, in radians: the authors' value.
const FREE: f64 = 0.1 * PI;

/// How much of the uniform distribution, whose moments are 0, is mixed in, for 2, 3 and 4 moments
/// (the authors' values). It keeps the moments those of some distribution after rounding to f32.
const BIAS: [f64; 3] = [4e-7, 8e-7, 1.5e-6];

/// A texel holds f32 numbers: the optical depth of the whole ray (b0), then the real and the
/// imaginary part of each of `count` moments, each in -1..1: 20 bytes for 2 moments, 28 for 3, 36
/// for 4.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trigonometric {
    pub count: usize,
}

impl Codec for Trigonometric {
    fn stride(&self) -> usize {
        4 * (1 + 2 * self.count)
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let total: f64 = ray.slabs().map(|(_, thickness)| thickness).sum();
        put_f32(texel, 0, ray.total());
        for k in 1..=self.count {
            let turn = (TAU - FREE) * k as f64;
            let waves = ray.slabs().map(|(slab, thickness)| mean_wave(turn, slab) * thickness);
            let mean = waves.sum::<Complex64>() / total.max(f64::MIN_POSITIVE);
            put_f32(texel, 2 * k - 1, mean.re as f32);
            put_f32(texel, 2 * k, mean.im as f32);
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let total = optical(f32_at(texel, 0));
        let place = share(extent, depth);
        if place == 0.0 || place == 1.0 {
            return through(total * place);
        }
        let keep = 1.0 - BIAS[self.count - 2];
        let moment = |k: usize| match k {
            0 => Complex64::ONE,
            _ => {
                let [re, im] = [2 * k - 1, 2 * k].map(|i| f64::from(f32_at(texel, i)));
                Complex64::new(re, im) * keep
            }
        };
        let element = |i: usize, j: usize| if i < j { moment(j - i).conj() } else { moment(i - j) };
        let angle = (TAU - FREE) * f64::from(place);
        let points = representation(self.count, element, Complex64::cis(angle));
        let counted = |&(z, mass): &(Complex64, f64)| {
            let other = z.arg().rem_euclid(TAU);
            let wrapped = ((other - (TAU - FREE)) / FREE).max(0.0);
            mass * if other < angle { 1.0 } else { wrapped }
        };
        let in_front = points[1..].iter().map(counted).sum::<f64>() + OVERESTIMATION * points[0].1;
        through(total * in_front.min(1.0) as f32)
    }
}

/// Mean of exp(i `turn` share) over the shares `a` to `b`.
pub(super) fn mean_wave(turn: f64, [a, b]: [f64; 2]) -> Complex64 {
    let half = 0.5 * turn * (b - a);
    let mean = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    Complex64::cis(0.5 * turn * (a + b)) * mean
}
