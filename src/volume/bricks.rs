//! The range of densities in each small brick of a volume: what empty-space skipping and bounds need.

use ndarray::{Array3, Axis};
use rayon::prelude::*;

/// Voxels along each edge of a brick.
pub const BRICK: usize = 4;

/// Smallest and largest density that interpolation reaches in each brick.
///
/// Brick b covers the index space from `BRICK * b - 0.5` to `BRICK * (b + 1) - 0.5` along each axis; as
/// densities are trilinear, its range is that of its own voxels and of the next ones on every side.
#[derive(Clone, Debug)]
pub struct Bricks {
    /// [smallest, largest], shape (z, y, x).
    ranges: Array3<[f32; 2]>,
}

/// Smaller and larger than every density.
const NOTHING: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

fn joined(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The first of the voxels that brick `b` feels, and one past the last of `count`.
fn felt(b: usize, count: usize) -> std::ops::Range<usize> {
    (BRICK * b).saturating_sub(1)..(BRICK * (b + 1) + 1).min(count)
}

impl Bricks {
    /// The bricks of densities of shape (z, y, x), finite, standard layout, not empty.
    pub(super) fn of(values: &Array3<f32>) -> Self {
        let (nz, ny, nx) = values.dim();
        let [bz, by, bx] = [nz, ny, nx].map(|n| n.div_ceil(BRICK));
        let values = values.as_slice().unwrap_or_default();
        let mut ranges = Array3::from_elem((bz, by, bx), NOTHING);
        let layers: Vec<_> = ranges.axis_iter_mut(Axis(0)).collect();
        layers.into_par_iter().enumerate().for_each(|(b, mut layer)| {
            // Rows of the layer's voxels, from above to below, as one.
            let mut row = vec![NOTHING; nx];
            for j in 0..by {
                row.fill(NOTHING);
                for z in felt(b, nz) {
                    for y in felt(j, ny) {
                        let own = &values[(z * ny + y) * nx..][..nx];
                        for (range, &value) in row.iter_mut().zip(own) {
                            *range = joined(*range, [value, value]);
                        }
                    }
                }
                for i in 0..bx {
                    let all = row[felt(i, nx)].iter().copied();
                    layer[[j, i]] = all.fold(NOTHING, joined);
                }
            }
        });
        Self { ranges }
    }

    /// [smallest, largest] density of each brick, shape (z, y, x).
    pub fn ranges(&self) -> &Array3<[f32; 2]> {
        &self.ranges
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;

    #[test]
    fn a_brick_feels_its_voxels_and_the_next_ones() {
        let mut values = Array3::zeros((5, 9, 13));
        values[[2, 4, 8]] = 3.0;
        let bricks = Bricks::of(&values);
        assert_eq!(bricks.ranges().dim(), (2, 3, 4));
        for ((z, y, x), &[low, high]) in bricks.ranges().indexed_iter() {
            // Voxel 4 along y touches bricks 0 and 1, voxel 8 along x bricks 1 and 2.
            let touched = z == 0 && y <= 1 && (1..=2).contains(&x);
            assert_eq!([low, high], [0.0, if touched { 3.0 } else { 0.0 }], "{z} {y} {x}");
        }
    }
}
