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
            low: least(self.low, other.low),
            high: most(self.high, other.high),
            slope: most(self.slope, other.slope),
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

/// What is known of columns of voxels, one for each x; slopes are squared.
struct Columns {
    low: Vec<f32>,
    high: Vec<f32>,
    slope: Vec<f32>,
}

impl Columns {
    fn new(nx: usize) -> Self {
        Self { low: vec![NOTHING.low; nx], high: vec![NOTHING.high; nx], slope: vec![0.0; nx] }
    }

    fn clear(&mut self) {
        self.low.fill(NOTHING.low);
        self.high.fill(NOTHING.high);
        self.slope.fill(0.0);
    }

    /// Adds a row of voxels, with the next rows along y and z.
    fn add(&mut self, own: &[f32], above: &[f32], behind: &[f32]) {
        // The last voxel of a row has no next one.
        let inner = own.len() - 1;
        self.add_part(0, &own[..inner], &own[1..], above, behind);
        let last = &own[inner..];
        self.add_part(inner, last, last, &above[inner..], &behind[inner..]);
    }

    fn add_part(&mut self, at: usize, own: &[f32], next: &[f32], above: &[f32], behind: &[f32]) {
        let known = self.low[at..].iter_mut().zip(&mut self.high[at..]).zip(&mut self.slope[at..]);
        let around = own.iter().zip(next).zip(above).zip(behind);
        for (((low, high), slope), (((&a, &x), &y), &z)) in known.zip(around) {
            let (x, y, z) = (x - a, y - a, z - a);
            *low = least(*low, a);
            *high = most(*high, a);
            *slope = most(*slope, x * x + y * y + z * z);
        }
    }

    fn join(&mut self, other: &Self) {
        let known = self.low.iter_mut().zip(&mut self.high).zip(&mut self.slope);
        let further = other.low.iter().zip(&other.high).zip(&other.slope);
        for (((low, high), slope), ((&l, &h), &s)) in known.zip(further) {
            (*low, *high, *slope) = (least(*low, l), most(*high, h), most(*slope, s));
        }
    }

    /// The range of these columns.
    fn range(&self, columns: std::ops::Range<usize>) -> Range {
        let all =
            columns.map(|x| Range { low: self.low[x], high: self.high[x], slope: self.slope[x] });
        let known = all.fold(NOTHING, Range::joined);
        Range { slope: known.slope.sqrt(), ..known }
    }
}

/// The smaller one of two numbers that are not NaN: unlike `f32::min` one instruction of a vector
/// unit.
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The larger one of two numbers that are not NaN.
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Works on values in standard layout, first along z, then along y and x.
fn dense(values: &Array3<f32>, edge: usize) -> Array3<Range> {
    let (nz, ny, nx) = values.dim();
    let [bz, by, bx] = [nz, ny, nx].map(|n| n.div_ceil(edge));
    let values = values.as_slice().unwrap_or_default();
    let row_of = |z: usize, y: usize| &values[(z.min(nz - 1) * ny + y.min(ny - 1)) * nx..][..nx];
    let mut ranges = Array3::from_elem((bz, by, bx), NOTHING);
    let layers: Vec<_> = ranges.axis_iter_mut(Axis(0)).collect();
    parallel::for_each(layers.into_iter().enumerate(), |(b, mut layer)| {
        let mut columns = Columns::new(nx);
        // Of the bricks that the next row may belong to: the one before, its own and the next.
        let mut bricks = [0; 3].map(|_| Columns::new(nx));
        for y in 0..ny {
            columns.clear();
            for z in felt(edge, b, nz) {
                columns.add(row_of(z, y), row_of(z, y + 1), row_of(z + 1, y));
            }
            let own = y / edge;
            for j in own.saturating_sub(1)..(own + 2).min(by) {
                let rows = felt(edge, j, ny);
                let brick = &mut bricks[j % 3];
                if y == rows.start {
                    brick.clear();
                }
                if rows.contains(&y) {
                    brick.join(&columns);
                }
                if y + 1 == rows.end {
                    for i in 0..bx {
                        layer[[j, i]] = brick.range(felt(edge, i, nx));
                    }
                }
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

    /// By the definition, voxel by voxel.
    fn range_of(values: &Array3<f32>, edge: usize, brick: [usize; 3]) -> Range {
        let dims: [usize; 3] = values.dim().into();
        let felt = |axis: usize| {
            let first = edge * brick[axis];
            first.saturating_sub(1)..(first + edge + 1).min(dims[axis])
        };
        let mut known = NOTHING;
        for z in felt(0) {
            for (y, x) in felt(1).flat_map(|y| felt(2).map(move |x| (y, x))) {
                let own = values[[z, y, x]];
                let next = |[dz, dy, dx]: [usize; 3]| {
                    values.get([z + dz, y + dy, x + dx]).map_or(0.0, |next| (next - own).powi(2))
                };
                let slope = next([0, 0, 1]) + next([0, 1, 0]) + next([1, 0, 0]);
                known.low = known.low.min(own);
                known.high = known.high.max(own);
                known.slope = known.slope.max(slope);
            }
        }
        Range { slope: known.slope.sqrt(), ..known }
    }

    #[test]
    fn ranges_are_those_of_the_definition() {
        for (dims, edge) in [
            ([9, 14, 21], 4),
            ([4, 4, 4], 4),
            ([1, 1, 1], 4),
            ([17, 5, 1], 4),
            ([3, 18, 2], 4),
            ([13, 33, 8], 8),
            ([7, 6, 5], 2),
        ] {
            let mut state = 1_u32;
            let values = Array3::from_shape_simple_fn(dims, || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 * 1e-5 - 70.0
            });
            let found = dense(&values, edge);
            assert_eq!(found.dim(), dims.map(|n| n.div_ceil(edge)).into());
            for ((z, y, x), range) in found.indexed_iter() {
                assert_eq!(*range, range_of(&values, edge, [z, y, x]), "{dims:?} {z} {y} {x}");
            }
        }
    }

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
