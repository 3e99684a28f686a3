//! The range of densities in each small brick of a volume, for empty-space skipping and for bounds.

use glam::DVec3;
use ndarray::{Array3, Axis};

use super::sparse::{BLOCK, BLOCK_EDGE};
use super::{SparseVoxels, Voxels};
use crate::parallel;

/// Voxels along each edge of a brick, unless a volume would have too many bricks.
pub const BRICK: usize = 4;
/// The largest number of bricks in all and along one axis. (3D textures of every device may be as
/// long as the latter.)
const MOST_BRICKS: [f64; 2] = [(1 << 24) as f64, 2048.0];

/// Voxels along the edge of the bricks of a volume with `extent` voxels along x, y, z: [`BRICK`],
/// doubled until there are not too many bricks.
pub fn brick_edge(extent: DVec3) -> f64 {
    let mut edge = BRICK as f64;
    let too_many = |counts: DVec3| {
        counts.element_product() > MOST_BRICKS[0] || counts.max_element() > MOST_BRICKS[1]
    };
    while too_many((extent / edge).ceil()) {
        edge *= 2.0;
    }
    edge
}

/// What is known of the densities in each brick.
///
/// Brick b covers the index space from `edge * b - 0.5` to `edge * (b + 1) - 0.5` along each axis.
/// Densities are trilinear, so its range is that of its own voxels and of the adjacent ones on
/// every side.
#[derive(Clone, Debug)]
pub struct Bricks {
    edge: usize,
    /// One per brick, shape (z, y, x).
    ranges: Array3<Range>,
}

/// How densities vary in a brick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The smallest density.
    pub low: f32,
    /// The largest density.
    pub high: f32,
    /// The largest change over a voxel: the length of the vector of differences to the next voxel
    /// along each axis.
    pub slope: f32,
}

/// The range of no voxels.
const NOTHING: Range = Range { low: f32::INFINITY, high: f32::NEG_INFINITY, slope: 0.0 };

impl Range {
    fn joined(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            slope: self.slope.max(other.slope),
        }
    }
}

/// The range of voxel indices, along an axis of `count` voxels, that brick `b` depends on.
fn felt(edge: usize, b: usize, count: usize) -> std::ops::Range<usize> {
    (edge * b).saturating_sub(1)..(edge * (b + 1) + 1).min(count)
}

impl Bricks {
    /// The bricks of `voxels`, which must be finite and not empty.
    pub(super) fn of(voxels: &Voxels) -> Self {
        let dims = voxels.dims();
        let edge = brick_edge(DVec3::from_array(dims.map(|n| n as f64))) as usize;
        let ranges = match voxels {
            Voxels::Dense(values) => dense(values, edge),
            Voxels::Sparse(voxels) => sparse(voxels, edge),
        };
        Self { edge, ranges }
    }

    /// Voxels along each edge.
    pub fn edge(&self) -> usize {
        self.edge
    }

    /// The range of each brick, shape (z, y, x).
    pub fn ranges(&self) -> &Array3<Range> {
        &self.ranges
    }
}

/// Works row by row, on values in standard layout.
fn dense(values: &Array3<f32>, edge: usize) -> Array3<Range> {
    let felt = |b, count| felt(edge, b, count);
    let (nz, ny, nx) = values.dim();
    let [bz, by, bx] = [nz, ny, nx].map(|n| n.div_ceil(edge));
    let values = values.as_slice().unwrap_or_default();
    let row_of = |z: usize, y: usize| &values[(z.min(nz - 1) * ny + y.min(ny - 1)) * nx..][..nx];
    let mut ranges = Array3::from_elem((bz, by, bx), NOTHING);
    let layers: Vec<_> = ranges.axis_iter_mut(Axis(0)).collect();
    parallel::for_each(layers.into_iter().enumerate(), |(b, mut layer)| {
        // What is known of the layer's rows so far, as one row; slopes squared.
        let (mut low, mut high, mut slope) = (vec![0.0; nx], vec![0.0; nx], vec![0.0; nx]);
        let mut next = vec![0.0; nx];
        for j in 0..by {
            low.fill(f32::INFINITY);
            high.fill(f32::NEG_INFINITY);
            slope.fill(0.0);
            for z in felt(b, nz) {
                for y in felt(j, ny) {
                    let (own, above, behind) = (row_of(z, y), row_of(z, y + 1), row_of(z + 1, y));
                    next[..nx - 1].copy_from_slice(&own[1..]);
                    next[nx - 1] = own[nx - 1];
                    let around = own.iter().zip(&next).zip(above).zip(behind);
                    let known = low.iter_mut().zip(&mut high).zip(&mut slope);
                    for (((low, high), slope), (((&a, &x), &y), &z)) in known.zip(around) {
                        *low = a.min(*low);
                        *high = a.max(*high);
                        let (x, y, z) = (x - a, y - a, z - a);
                        *slope = (x * x + y * y + z * z).max(*slope);
                    }
                }
            }
            for i in 0..bx {
                let all = felt(i, nx).map(|x| Range {
                    low: low[x],
                    high: high[x],
                    slope: slope[x].sqrt(),
                });
                layer[[j, i]] = all.fold(NOTHING, Range::joined);
            }
        }
    });
    ranges
}

/// Works on one block after another.
fn sparse(voxels: &SparseVoxels, edge: usize) -> Array3<Range> {
    let dims = voxels.dims();
    let [bx, by, bz] = dims.map(|n| n.div_ceil(edge));
    let uniform = voxels.uniform();
    let [nx, ny, _] = voxels.blocks();
    let mut ranges = Array3::from_elem((bz, by, bx), NOTHING);
    let layers: Vec<_> = ranges.axis_iter_mut(Axis(0)).collect();
    parallel::for_each(layers.into_iter().enumerate(), |(z, mut layer)| {
        for ((y, x), range) in layer.indexed_iter_mut() {
            let brick = [x, y, z];
            let felt: [_; 3] = std::array::from_fn(|axis| felt(edge, brick[axis], dims[axis]));
            let [xs, ys, zs] = felt.clone().map(|f| f.start / BLOCK..(f.end - 1) / BLOCK + 1);
            for k in zs {
                for (j, i) in ys.clone().flat_map(|j| xs.clone().map(move |i| (j, i))) {
                    let stored = voxels.table()[(k * ny + j) * nx + i] as usize;
                    let known = match uniform[stored] {
                        Some(value) => Range { low: value, high: value, slope: 0.0 },
                        None => part_of(voxels, [i, j, k], &felt),
                    };
                    *range = range.joined(known);
                }
            }
        }
    });
    ranges
}

/// The range of the voxels that lie both in a block and in a box.
fn part_of(voxels: &SparseVoxels, block: [usize; 3], felt: &[std::ops::Range<usize>; 3]) -> Range {
    let values = voxels.block(block);
    let [xs, ys, zs]: [_; 3] = std::array::from_fn(|axis| {
        let first = block[axis] * BLOCK;
        felt[axis].start.max(first) - first..felt[axis].end.min(first + BLOCK) - first
    });
    let mut known = NOTHING;
    for z in zs {
        for y in ys.clone() {
            let row =
                |z: usize, y: usize| &values[(z * BLOCK_EDGE + y) * BLOCK_EDGE..][..BLOCK_EDGE];
            let (own, above, behind) = (row(z, y), row(z, y + 1), row(z + 1, y));
            for x in xs.clone() {
                let a = own[x];
                let change = [own[x + 1] - a, above[x] - a, behind[x] - a];
                let slope = change.iter().map(|d| d * d).sum::<f32>();
                known = known.joined(Range { low: a, high: a, slope });
            }
        }
    }
    Range { slope: known.slope.sqrt(), ..known }
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;

    #[test]
    fn a_brick_feels_its_voxels_and_the_next_ones() {
        // Voxels 8 and 4 are the first of a brick, so the brick before depends on them; 3 and 7 are
        // the last of one, so the brick behind depends on them.
        for (voxel, touched_x, touched_y) in [([2, 4, 8], 1..=2, 0..=1), ([2, 7, 3], 0..=1, 1..=2)]
        {
            let mut values = Array3::zeros((5, 9, 13));
            values[voxel] = 3.0;
            let bricks = Bricks::of(&Voxels::Dense(values));
            assert_eq!(bricks.ranges().dim(), (2, 3, 4));
            for ((z, y, x), range) in bricks.ranges().indexed_iter() {
                let touched = z == 0 && touched_y.contains(&y) && touched_x.contains(&x);
                assert_eq!(
                    [range.low, range.high],
                    [0.0, if touched { 3.0 } else { 0.0 }],
                    "{z} {y} {x}"
                );
            }
        }
    }
}
