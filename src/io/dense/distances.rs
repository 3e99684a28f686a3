//! Whether numbers look like signed distances to a surface, which render inside out where they are taken for
//! densities. Knows no format.

use ndarray::ArrayView3;

/// Distances of as many voxels to the surface are looked at.
const NEAR: f64 = 1.5;
/// Voxels that must lie so near for an answer, and that are looked at for one.
const FEWEST: usize = 32;
const ENOUGH: usize = 100_000;

/// Whether values of shape (z, y, x), of voxels that are `steps` (x, y, z) long, are negative inside, positive all
/// around, and change by what the way changes near where they are 0.
pub(super) fn look_like_distances(values: &ArrayView3<'_, f32>, steps: [f64; 3]) -> bool {
    let (nz, ny, nx) = values.dim();
    if nx.min(ny).min(nz) < 3 {
        return false;
    }
    let at = |[x, y, z]: [usize; 3]| f64::from(values[[z, y, x]]);
    let voxel = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut near, mut sound, mut inside) = (0, 0, false);
    for ((z, y, x), &value) in values.indexed_iter() {
        let border = [(x, nx), (y, ny), (z, nz)].iter().any(|&(i, n)| i == 0 || i + 1 == n);
        if border {
            if value <= 0.0 || value.is_nan() {
                return false;
            }
            continue;
        }
        inside |= value < 0.0;
        if near < ENOUGH && f64::from(value).abs() < NEAR * voxel {
            let change = |axis: usize| {
                let (mut low, mut high) = ([x, y, z], [x, y, z]);
                low[axis] -= 1;
                high[axis] += 1;
                (at(high) - at(low)) / (2.0 * steps[axis])
            };
            let slope = (0..3).map(|axis| change(axis).powi(2)).sum::<f64>().sqrt();
            near += 1;
            sound += usize::from((0.7..1.3).contains(&slope));
        }
    }
    inside && near >= FEWEST && sound * 10 >= near * 8
}
