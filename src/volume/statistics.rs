//! What a volume's values look like as a whole, for automatic choices and for people.

use glam::DVec3;
use ndarray::{Array3, ArrayView2, Axis};

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

/// The corners (voxel index x, y, z) where rows along x begin and end to be above `least`, half a
/// voxel outside; of about `most` rows along y and z each.
pub(super) fn row_ends_above(values: &Array3<f32>, least: f32, most: usize) -> Vec<DVec3> {
    let (nz, ny, _) = values.dim();
    let stride = |n: usize| n.div_ceil(most);
    let mut ends = Vec::new();
    for z in (0..nz).step_by(stride(nz)) {
        let plane = values.index_axis(Axis(0), z);
        for y in (0..ny).step_by(stride(ny)) {
            let row = plane.row(y);
            let Some(first) = row.iter().position(|&v| v > least) else { continue };
            let last = row.iter().rposition(|&v| v > least).unwrap_or(first);
            for x in [first as f64 - 0.5, last as f64 + 0.5] {
                ends.push(DVec3::new(x, y as f64, z as f64));
            }
        }
    }
    ends
}
