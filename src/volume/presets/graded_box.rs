//! Box: a cube whose density increases towards its centre.

use ndarray::Array3;

/// One minus the Chebyshev distance from the centre.
pub(super) fn voxels(n: usize) -> Array3<f32> {
    super::cube(n, |[x, y, z]| 1.0 - x.abs().max(y.abs()).max(z.abs()))
}
