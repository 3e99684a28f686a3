//! Histograms of voxels by value. Knows no format.

/// Numbers of voxels by value, in bins of equal width.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// The smallest value, where the first bin begins.
    pub low: f64,
    /// The largest value, where the last bin ends.
    pub high: f64,
    /// Number of voxels in each bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// An empty histogram with `bins` bins from the smallest to the largest value, or with a single
    /// bin if they are equal.
    pub fn new([low, high]: [f64; 2], bins: usize) -> Self {
        Self { low, high, counts: vec![0; if low < high { bins.max(1) } else { 1 }] }
    }

    /// Counts `voxels` voxels of the same value; a value that is not finite is ignored.
    pub fn add(&mut self, value: f32, voxels: u64) {
        if value.is_finite() {
            let last = self.counts.len() - 1;
            let scale = self.counts.len() as f64 / (self.high - self.low);
            // A range of a single value gives 0 times infinity, which is NaN and becomes bin 0.
            let bin = (((f64::from(value) - self.low) * scale) as usize).min(last);
            self.counts[bin] = self.counts[bin].saturating_add(voxels);
        }
    }

    /// Adds the counts of `other`, which must have the same bins.
    pub(super) fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count = count.saturating_add(*more);
        }
    }
}

/// The smallest and the largest of finite values; `None` as long as there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FiniteRange(pub Option<[f64; 2]>);

impl FiniteRange {
    /// Extends the range by a value, if it is finite.
    pub fn add(&mut self, value: f32) {
        if value.is_finite() {
            let value = f64::from(value);
            let [low, high] = self.0.unwrap_or([value; 2]);
            self.0 = Some([low.min(value), high.max(value)]);
        }
    }

    /// Extends the range by that of `other`.
    pub(super) fn merge(&mut self, other: Self) {
        if let (Some([low, high]), Some([least, most])) = (self.0, other.0) {
            self.0 = Some([low.min(least), high.max(most)]);
        }
        self.0 = self.0.or(other.0);
    }
}
