//! What a volume's values look like as a whole, for automatic choices and for people.

use glam::DVec3;
use ndarray::{Array3, ArrayView2, Axis};

use crate::math::Aabb;

/// Range, mean and border level of a volume's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Mean over all voxels.
    pub mean: f64,
    /// Share of the voxels above 0, in 0..1.
    pub nonempty: f64,
    /// The value below which 90 % of the voxels on the six faces lie: what the surroundings of a
    /// scanned object look like, even where the object itself touches a face. 0 where the medium
    /// lies free in empty space.
    pub border: f32,
}

impl Statistics {
    /// Statistics of `values`, shape (z, y, x), finite, not empty.
    pub fn of(values: &Array3<f32>) -> Self {
        let (mut min, mut max, mut sum, mut nonempty) = (f32::INFINITY, 0.0_f32, 0.0_f64, 0_usize);
        for &v in values {
            min = min.min(v);
            max = max.max(v);
            sum += f64::from(v);
            nonempty += usize::from(v > 0.0);
        }
        let count = values.len().max(1) as f64;
        Self {
            min,
            max,
            mean: sum / count,
            nonempty: nonempty as f64 / count,
            border: border(values),
        }
    }
}

fn border(values: &Array3<f32>) -> f32 {
    let mut shell: Vec<f32> = Vec::new();
    for axis in (0..3).map(Axis) {
        // Along a flat axis every voxel is a face; it says nothing of the surroundings.
        if values.len_of(axis) < 3 {
            continue;
        }
        let face = |index| -> ArrayView2<'_, f32> { values.index_axis(axis, index) };
        shell.extend(face(0).iter().chain(face(values.len_of(axis) - 1)));
    }
    if shell.is_empty() {
        return 0.0;
    }
    let rank = (shell.len() - 1) * 9 / 10;
    *shell.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// Sums of `values` (shape (z, y, x)) along `axis` (0 = x, 1 = y, 2 = z), of all columns that hold
/// anything, rising.
pub(super) fn nonempty_column_sums(values: &Array3<f32>, axis: usize) -> Vec<f64> {
    let mut sums: Vec<f64> = values
        .lanes(Axis(2 - axis))
        .into_iter()
        .map(|lane| lane.iter().map(|&v| f64::from(v)).sum())
        .filter(|&sum| sum > 0.0)
        .collect();
    sums.sort_unstable_by(f64::total_cmp);
    sums
}

/// The box of voxel indices (x, y, z), inclusive, around all voxels above `least`.
pub(super) fn box_above(values: &Array3<f32>, least: f32) -> Option<Aabb> {
    let mut found: Option<Aabb> = None;
    for ((z, y), row) in values
        .rows()
        .into_iter()
        .enumerate()
        .map(|(i, row)| ((i / values.dim().1, i % values.dim().1), row))
    {
        let Some(first) = row.iter().position(|&v| v > least) else { continue };
        let last = row.iter().rposition(|&v| v > least).unwrap_or(first);
        let ends = [first, last].map(|x| DVec3::new(x as f64, y as f64, z as f64));
        let known = found.map_or([ends[0]; 2], |b| [b.min, b.max]);
        found = Aabb::around(ends.into_iter().chain(known));
    }
    found
}
