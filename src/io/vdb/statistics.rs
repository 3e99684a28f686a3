//! Smallest, largest and mean value over the active voxels. The sums run in the order of the
//! leaves, so that the result does not depend on the number of threads.

use super::mask;
use super::topology::Topology;
use super::value::Value;

/// Statistics of one component of the active values. A tile counts as many times as it has voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The smallest value; NaN if all are.
    pub min: f64,
    /// The largest value; NaN if all are.
    pub max: f64,
    /// The mean of the values that are not NaN; NaN if all are.
    pub mean: f64,
    /// Number of values that are NaN.
    pub nan_count: u64,
}

/// What a statistic is made from.
#[derive(Clone, Copy)]
pub(super) struct Tally {
    min: f64,
    max: f64,
    sum: f64,
    count: u64,
    nan_count: u64,
}

/// One tally for each component; the second and third are used by vectors only.
pub(super) type Tallies = [Tally; 3];

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

/// The tallies of a leaf's active values.
pub(super) fn of_leaf<T: Value>(values: &[T], active: &[u64]) -> Tallies {
    let mut tallies = [NOTHING; 3];
    for (component, tally) in tallies.iter_mut().enumerate().take(T::COMPONENTS) {
        for voxel in mask::set_bits(active) {
            tally.add(values[voxel].component(component), 1);
        }
    }
    tallies
}

/// The statistics of a tree from its tiles and its leaves' tallies.
pub(super) fn combine<T: Value>(
    topology: &Topology<T>,
    leaves: impl IntoIterator<Item = Tallies>,
) -> Vec<Statistics> {
    let mut all = [NOTHING; 3];
    for tile in topology.tiles().filter(|tile| tile.active) {
        for (component, tally) in all.iter_mut().enumerate() {
            tally.add(tile.value.component(component), tile.voxels());
        }
    }
    for leaf in leaves {
        for (tally, more) in all.iter_mut().zip(&leaf) {
            tally.merge(more);
        }
    }
    if all[0].count == 0 && all[0].nan_count == 0 {
        return Vec::new();
    }
    all[..T::COMPONENTS].iter().map(Tally::statistics).collect()
}
