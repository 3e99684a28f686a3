//! Exponentials of negative optical depths, fast enough for the innermost loops: four at a time by
//! the vector unit, where the standard library calls a function for each.

use glam::Vec4;

use crate::math::Each;

/// 1.5 times 2^23: a number added to it is rounded to the nearest integer, which then stands in its
/// lowest bits.
pub const INTEGERS: f32 = 12_582_912.0;
/// The smallest argument; its exponential is close to the smallest normal f32.
const LEAST: f32 = -87.0;
/// The logarithm of 2 in two parts, the first of which has so few bits that products with small
/// integers are exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
/// Coefficients of exp(r) = 1 + r + r^2 (c0 + c1 r + ...) for |r| <= ln(2) / 2: the Taylor series,
/// whose first term left out is below 1e-7 of the result.
const SERIES: [f32; 5] = [0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0];

/// exp(-tau) of four optical depths tau >= 0, each with a relative error below 3e-7. Above 87 the
/// result stays at exp(-87).
#[inline]
pub fn four_transmitted(taus: Vec4) -> Vec4 {
    let x = (-taus).max(Vec4::splat(LEAST));
    let shifted = x * std::f32::consts::LOG2_E + INTEGERS;
    let n = shifted - INTEGERS;
    let r = x - n * LN_2[0] - n * LN_2[1];
    let [a, b, c, d, e] = SERIES;
    let series = (((e * r + d) * r + c) * r + b) * r + a;
    let fraction = series * r * r + r + 1.0;
    fraction * Vec4::from_array(shifted.to_array().each(power_of_two))
}

/// [`four_transmitted`] of one optical depth.
#[inline]
pub fn transmitted(tau: f32) -> f32 {
    four_transmitted(Vec4::splat(tau)).x
}

/// 2 to the power of the integer that was added to [`INTEGERS`], -126 to 127: it becomes the
/// exponent.
#[inline]
fn power_of_two(shifted: f32) -> f32 {
    f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_those_of_f64() {
        let mut worst = 0.0_f64;
        for i in 0..400_000 {
            let tau = i as f32 * 87.0 / 400_000.0;
            let four = four_transmitted(Vec4::new(tau, 0.0, 2.0 * tau, 87.0));
            assert_eq!(four.x.to_bits(), transmitted(tau).to_bits());
            assert_eq!(four.y, 1.0);
            let exact = (-f64::from(tau)).exp();
            worst = worst.max((f64::from(four.x) / exact - 1.0).abs());
        }
        assert!(worst < 3e-7, "{worst:e}");
        for tau in [88.0, 1e9, f32::INFINITY] {
            assert!(transmitted(tau) < 2e-38 && transmitted(tau) >= 0.0);
        }
    }
}
