//! A Fourier series of extinction: Fourier opacity mapping (Jansen and Bavoil 2010).
//!
//! Extinction over depth, with the ray's length in the volume as its period, is kept as its mean
//! and some cosines and sines; optical depth is the series integrated term by term. The series
//! rings where extinction is steep. Two things bound that: optical depth is clamped between 0 and
//! that of the whole ray, which the mean gives, and behind the volume it is exactly the latter.

use std::f32::consts::TAU;

use super::bytes::{f32_at, put_f32};
use super::trigonometric::mean_wave;
use super::{Codec, TexelRay, optical, share, through};

/// A texel holds f32 numbers, all of them optical depths over the ray's length; they are
/// coefficients of extinction over depth d in 0..1:
///
/// ```text
/// number 0        a0, the mean: optical depth of the whole ray
/// number 2 k - 1  a_k, of cos(2 pi k d)
/// number 2 k      b_k, of sin(2 pi k d)
/// ```
///
/// Zeros fill a texel up to whole RGBA f32 texels of a texture, 16 bytes each: 3 coefficients take
/// 16 bytes, 7 take 32.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fourier {
    pub pairs: usize,
}

impl Codec for Fourier {
    fn stride(&self) -> usize {
        (1 + 2 * self.pairs).div_ceil(4) * 16
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        put_f32(texel, 0, ray.total());
        for k in 1..=self.pairs {
            let turn = std::f64::consts::TAU * k as f64;
            let wave = ray.slabs().map(|(slab, thickness)| mean_wave(turn, slab) * thickness);
            let sum: rustfft::num_complex::Complex64 = wave.sum();
            put_f32(texel, 2 * k - 1, (2.0 * sum.re) as f32);
            put_f32(texel, 2 * k, (2.0 * sum.im) as f32);
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let total = optical(f32_at(texel, 0));
        let place = share(extent, depth);
        if place == 0.0 || place == 1.0 {
            return through(total * place);
        }
        let mut optical_depth = total * place;
        for k in 1..=self.pairs {
            let turn = TAU * k as f32;
            let (sin, cos) = (turn * place).sin_cos();
            let [a, b] = [2 * k - 1, 2 * k].map(|i| f32_at(texel, i));
            optical_depth += (a * sin + b * (1.0 - cos)) / turn;
        }
        through(optical_depth.min(total))
    }
}
