//! Detects numbers that look like signed distances to a surface, which would render inside out if
//! they were taken for densities. Knows no format.

use ndarray::ArrayView3;

/// The least number of voxels beside the surface for a decision.
const FEWEST: usize = 32;
/// Slopes in this range, as shares of the median slope, count as equal to it.
const SAME: std::ops::Range<f64> = 0.7..1.3;
/// How many of ten slopes must be equal.
const MOST: usize = 8;

/// The slope, per world length, of `values` of shape (z, y, x) beside their zero crossing, if they
/// look like distances: positive all around and of one slope. `steps` are the voxels' lengths along
/// x, y, z; for distances in the same unit the slope is 1.
pub(super) fn slope_of_distances(values: &ArrayView3<'_, f32>, steps: [f64; 3]) -> Option<f64> {
    let (nz, ny, nx) = values.dim();
    if nx.min(ny).min(nz) < 3 {
        return None;
    }
    let at = |[x, y, z]: [usize; 3]| f64::from(values[[z, y, x]]);
    let mut slopes = Vec::new();
    for ((z, y, x), &value) in values.indexed_iter() {
        let border = [(x, nx), (y, ny), (z, nz)].iter().any(|&(i, n)| i == 0 || i + 1 == n);
        if border {
            if value <= 0.0 || value.is_nan() {
                return None;
            }
            continue;
        }
        if value > 0.0 {
            continue;
        }
        let around = |axis: usize| {
            let (mut low, mut high) = ([x, y, z], [x, y, z]);
            low[axis] -= 1;
            high[axis] += 1;
            [at(low), at(high)]
        };
        let around = [0, 1, 2].map(around);
        if around.as_flattened().iter().any(|&next| next > 0.0) {
            let change = |axis: usize| (around[axis][1] - around[axis][0]) / (2.0 * steps[axis]);
            slopes.push((0..3).map(|axis| change(axis).powi(2)).sum::<f64>().sqrt());
        }
    }
    slopes.sort_unstable_by(f64::total_cmp);
    let middle = *slopes.get(slopes.len() / 2)?;
    let alike = slopes.iter().filter(|&&slope| SAME.contains(&(slope / middle))).count();
    (slopes.len() >= FEWEST && alike * 10 >= slopes.len() * MOST).then_some(middle)
}
