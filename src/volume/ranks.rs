//! Values by rank: finds what is typical of a volume, whatever a few of its voxels hold. Knows no
//! light and no transfer function.

use super::Voxels;
use crate::parallel;

/// Number of classes of values; a class is given by the sign, the exponent and the first seven bits
/// of an f32's fraction.
const CLASSES: usize = 1 << 16;
/// One in this many voxels may be an outlier.
const APART: u64 = 10_000;
/// At least this many voxels may be outliers, but no more than one in [`FEWER`].
const FEW: u64 = 4;
const FEWER: u64 = 64;
/// Outliers are larger than the next value by more than this factor.
const GAP: f32 = 1.5;

/// Values that are looked at together.
const RUN: usize = 32;

/// Finite values, counted by class, in rising order.
#[derive(Clone, Debug)]
pub(super) struct Ranks {
    /// For each class: the number of values, and the smallest and the largest of them.
    classes: Vec<(u64, f32, f32)>,
}

impl Ranks {
    pub(super) fn of(voxels: &Voxels) -> Self {
        let nothing = || vec![(0_u64, f32::INFINITY, f32::NEG_INFINITY); CLASSES];
        let add = |classes: &mut Vec<(u64, f32, f32)>, value: f32, count: u64| {
            if value.is_finite() {
                let (all, least, most) = &mut classes[class(value)];
                *all += count;
                // Comparisons, since values are finite: minima of numbers that may be NaN take longer.
                if value < *least {
                    *least = value;
                }
                if value > *most {
                    *most = value;
                }
            }
        };
        let mut classes = match voxels {
            Voxels::Dense(values) => {
                let values = values.as_slice().unwrap_or_default();
                let parts = 2 * rayon::current_num_threads();
                let parts = values.chunks(values.len().div_ceil(parts).max(1 << 20));
                let parts = parallel::map(parts, |part| {
                    let mut classes = nothing();
                    let mut zeros = 0;
                    for run in part.chunks(RUN) {
                        // Much of most volumes is empty.
                        if run.iter().all(|value| value.to_bits() == 0) {
                            zeros += run.len() as u64;
                        } else {
                            for &value in run {
                                add(&mut classes, value, 1);
                            }
                        }
                    }
                    if zeros > 0 {
                        add(&mut classes, 0.0, zeros);
                    }
                    classes
                });
                parts.into_iter().reduce(|mut a, b| {
                    for (a, b) in a.iter_mut().zip(b) {
                        *a = (a.0 + b.0, a.1.min(b.1), a.2.max(b.2));
                    }
                    a
                })
            }
            Voxels::Sparse(_) => {
                let mut classes = nothing();
                let mut held = 0;
                voxels.for_each_held(|part, value| {
                    held += part.voxels() as u64;
                    add(&mut classes, value, part.voxels() as u64);
                });
                let all = voxels.dims().iter().fold(1_u64, |all, &n| all.saturating_mul(n as u64));
                if all > held {
                    add(&mut classes, 0.0, all - held);
                }
                Some(classes)
            }
        }
        .unwrap_or_default();
        classes.retain(|(count, ..)| *count > 0);
        Self { classes }
    }

    /// The smallest value; 0 if there are no values.
    pub(super) fn least(&self) -> f32 {
        self.classes.first().map_or(0.0, |(_, least, _)| *least)
    }

    /// The largest value without a few outliers; 0 if no value is above 0.
    pub(super) fn typical_largest(&self) -> f32 {
        let above: u64 = self.classes.iter().filter(|(.., most)| *most > 0.0).map(|c| c.0).sum();
        let largest = self.classes.last().map_or(0.0, |(.., most)| most.max(0.0));
        let next = self.largest_but(may_stand_apart(above)).max(0.0);
        if largest > GAP * next && next > 0.0 { next } else { largest }
    }

    /// The smallest and the largest value without a few outliers.
    pub(super) fn typical_range(&self) -> [f32; 2] {
        let (Some(first), Some(last)) = (self.classes.first(), self.classes.last()) else {
            return [0.0; 2];
        };
        let all: u64 = self.classes.iter().map(|c| c.0).sum();
        let apart = may_stand_apart(all);
        let [low, high] = [self.smallest_but(apart), self.largest_but(apart)];
        let width = high - low;
        // Widely scattered values have no outliers at their ends.
        let beyond = (GAP - 1.0) * width;
        let low = if width > 0.0 && low - first.1 > beyond { low } else { first.1 };
        let high = if width > 0.0 && last.2 - high > beyond { high } else { last.2 };
        [low, high]
    }

    /// The number of values in `low..=high`, as exactly as the classes tell.
    pub(super) fn between(&self, low: f32, high: f32) -> u64 {
        let within = |(_, least, most): &&(u64, f32, f32)| *most >= low && *least <= high;
        self.classes.iter().filter(within).map(|c| c.0).sum()
    }

    /// The value that at most `count` others exceed, to within its class.
    fn largest_but(&self, count: u64) -> f32 {
        let mut above = 0;
        for (own, _, most) in self.classes.iter().rev() {
            above += own;
            if above > count {
                return *most;
            }
        }
        self.least()
    }

    fn smallest_but(&self, count: u64) -> f32 {
        let mut below = 0;
        for (own, least, _) in &self.classes {
            below += own;
            if below > count {
                return *least;
            }
        }
        self.least()
    }
}

/// How many of `count` values may be left out as outliers.
fn may_stand_apart(count: u64) -> u64 {
    (count / APART).max(FEW).min(count / FEWER)
}

/// The class of a finite value; classes rise with values.
fn class(value: f32) -> usize {
    let bits = value.to_bits();
    let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    (ordered >> 16) as usize
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;

    fn ranks(values: impl Fn(usize) -> f32) -> Ranks {
        let values = Array3::from_shape_fn((20, 20, 20), |(z, y, x)| values((z * 20 + y) * 20 + x));
        let dense = Voxels::Dense(values);
        let sparse = Ranks::of(&Voxels::Sparse(dense.to_sparse().into_owned()));
        let dense = Ranks::of(&dense);
        assert_eq!(dense.classes, sparse.classes);
        dense
    }

    #[test]
    fn a_few_voxels_that_stand_apart_are_not_typical() {
        // Values from 0 to 7.999 at equal distances, and two far above.
        let even = |i: usize| i as f32 * 1e-3;
        assert_eq!(ranks(even).typical_largest(), even(7999));
        assert_eq!(ranks(even).typical_range(), [0.0, even(7999)]);
        let hot = |i: usize| if i == 5 || i == 77 { 1e6 } else { even(i) };
        let typical = ranks(hot).typical_largest();
        assert!((typical - 8.0).abs() < 0.04, "{typical}");
        let cold = |i: usize| if i == 5 { f32::MIN } else { hot(i) - 4.0 };
        let [low, high] = ranks(cold).typical_range();
        assert!((low + 4.0).abs() < 0.04 && (high - 4.0).abs() < 0.04, "{low} {high}");
        // A peak that rises gradually is no outlier, and neither are the only voxels that hold
        // anything.
        let peak = |i: usize| 1.0 / (1.0 + (7999 - i) as f32 * 0.01);
        assert_eq!(ranks(peak).typical_largest(), 1.0);
        let dots = |i: usize| [0.0, 1.0, 5.0][if i < 3 { i } else { 0 }];
        assert_eq!(ranks(dots).typical_largest(), 5.0);
        let nothing = |i: usize| if i == 9 { f32::NAN } else { 0.0 };
        assert_eq!(ranks(nothing).typical_largest(), 0.0);
    }
}
