//! Smallest, largest and mean value over the active voxels. Sums are formed in the order of the
//! leaves, so that the result does not depend on the number of threads.

use super::mask;
use super::topology::Topology;
use super::value::Value;
use crate::io::{FiniteRange, Histogram};

/// Statistics of one component of the active values. A tile's value counts once per voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The smallest value; NaN if all values are NaN.
    pub min: f64,
    /// The largest value; NaN if all values are NaN.
    pub max: f64,
    /// The mean of the values that are not NaN; NaN if all are.
    pub mean: f64,
    /// Number of values that are NaN.
    pub nan_count: u64,
}

/// Accumulates one statistic.
#[derive(Clone, Copy)]
struct Tally {
    min: f64,
    max: f64,
    sum: f64,
    count: u64,
    nan_count: u64,
}

/// One per component; the second and third are used for vectors only.
type Tallies = [Tally; 3];

const NOTHING: Tally =
    Tally { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0, count: 0, nan_count: 0 };

impl Tally {
    fn add(&mut self, value: f64, times: u64) {
        if value.is_nan() {
            self.nan_count = self.nan_count.saturating_add(times);
            return;
        }
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.sum += value * times as f64;
        self.count = self.count.saturating_add(times);
    }

    fn merge(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.sum += other.sum;
        self.count = self.count.saturating_add(other.count);
        self.nan_count = self.nan_count.saturating_add(other.nan_count);
    }

    fn statistics(&self) -> Statistics {
        let Self { min, max, sum, count, nan_count } = *self;
        if count == 0 {
            return Statistics { min: f64::NAN, max: f64::NAN, mean: f64::NAN, nan_count };
        }
        Statistics { min, max, mean: sum / count as f64, nan_count }
    }
}

/// Measurements of the active values of a leaf or of a larger part.
#[derive(Clone, Copy)]
pub(super) struct Findings {
    tallies: Tallies,
    /// The range of the values as numbers for rendering.
    range: FiniteRange,
}

impl Findings {
    /// Measures a leaf.
    pub(super) fn of_leaf<T: Value>(values: &[T], active: &[u64]) -> Self {
        let mut findings = Self { tallies: [NOTHING; 3], range: FiniteRange::default() };
        for (component, tally) in findings.tallies.iter_mut().enumerate().take(T::COMPONENTS) {
            for voxel in mask::set_bits(active) {
                tally.add(values[voxel].component(component), 1);
            }
        }
        for voxel in mask::set_bits(active) {
            findings.range.add(values[voxel].to_f32());
        }
        findings
    }

    /// Measures a tree's tiles; the leaves are then merged into it one by one, in their order.
    pub(super) fn of_tiles<T: Value>(topology: &Topology<T>) -> Self {
        let mut findings = Self { tallies: [NOTHING; 3], range: FiniteRange::default() };
        for tile in topology.tiles().filter(|tile| tile.active) {
            for (component, tally) in findings.tallies.iter_mut().enumerate() {
                tally.add(tile.value.component(component), tile.voxels());
            }
            findings.range.add(tile.value.to_f32());
        }
        findings
    }

    /// Adds the measurements of another part.
    pub(super) fn merge(&mut self, other: &Self) {
        for (tally, more) in self.tallies.iter_mut().zip(&other.tallies) {
            tally.merge(more);
        }
        self.range.merge(other.range);
    }

    /// One for each of `components`; empty without active voxels.
    pub(super) fn statistics(&self, components: usize) -> Vec<Statistics> {
        if self.tallies[0].count == 0 && self.tallies[0].nan_count == 0 {
            return Vec::new();
        }
        self.tallies[..components].iter().map(Tally::statistics).collect()
    }

    /// The smallest and the largest finite value.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        self.range.0
    }
}

/// A histogram of the active tiles' values; leaves are added later.
pub(super) fn tile_histogram<T: Value>(
    topology: &Topology<T>,
    range: [f64; 2],
    bins: usize,
) -> Histogram {
    let mut histogram = Histogram::new(range, bins);
    for tile in topology.tiles().filter(|tile| tile.active) {
        histogram.add(tile.value.to_f32(), tile.voxels());
    }
    histogram
}
