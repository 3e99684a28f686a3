//! One channel of a picture, and its filters.

use rayon::prelude::*;

/// `width` x `height` numbers, row 0 on top.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub width: usize,
    pub values: Vec<f64>,
}

impl Plane {
    pub(super) fn new(width: usize, values: Vec<f64>) -> Self {
        Self { width, values }
    }

    /// The correlation with the product of an `across` and a `down` kernel, each centred and of odd
    /// length. Beyond its border the picture is extended with the border's values.
    pub(super) fn filtered(&self, across: &[f64], down: &[f64]) -> Self {
        let width = self.width;
        let height = self.values.len() / width.max(1);
        let mut rows = vec![0.0; self.values.len()];
        let clamped =
            |i: usize, k: usize, radius: usize, n: usize| (i + k).saturating_sub(radius).min(n - 1);
        let radius = across.len() / 2;
        rows.par_chunks_mut(width).zip(self.values.par_chunks(width)).for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                let taps = across.iter().enumerate();
                *out = taps.map(|(k, w)| w * row[clamped(x, k, radius, width)]).sum();
            }
        });
        let radius = down.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (k, w) in down.iter().enumerate() {
                let row = clamped(y, k, radius, height) * width;
                for (out, value) in out.iter_mut().zip(&rows[row..row + width]) {
                    *out += w * value;
                }
            }
        });
        Self { width, values }
    }

    /// This plane plus another one.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a += b;
        }
        self
    }
}

/// exp(-x^2 / (2 `deviation`^2)) at integers x from -`radius` to `radius`, not normalised.
pub(super) fn gaussian(deviation: f64, radius: usize) -> Vec<f64> {
    let at = |i: usize| i as f64 - radius as f64;
    (0..=2 * radius).map(|i| (-0.5 * (at(i) / deviation).powi(2)).exp()).collect()
}
