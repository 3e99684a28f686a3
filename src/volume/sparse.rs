//! Values in blocks, where blocks of one uniform value are stored once: smoke in a large empty box
//! takes memory only where the smoke is.
//!
//! ```text
//! voxel  0 1 2 ..    .. 15 16 17 ..
//!       |x x x ..    .. x  x|            block 0: 17 voxels along an axis, for 16 cells
//!                       |x  x ..    x|   block 1 begins with the last voxel of block 0
//! ```

use std::collections::HashMap;

use ndarray::Array3;

use crate::error::{Error, Result};
use crate::math::Each;
use crate::parallel;

/// Cells along each edge of a block.
pub const BLOCK: usize = 16;
/// Voxels along each edge of a block: a cell needs the voxels at both of its ends.
pub const BLOCK_EDGE: usize = BLOCK + 1;
/// Voxels of a block.
pub const BLOCK_VALUES: usize = BLOCK_EDGE * BLOCK_EDGE * BLOCK_EDGE;

/// Values in blocks. Block (x, y, z) holds the cells from voxel `BLOCK * (x, y, z)` on.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseVoxels {
    /// Voxels along x, y, z.
    dims: [usize; 3],
    /// For each block, x fastest, the index of the stored block that holds its values.
    table: Vec<u32>,
    /// The stored blocks, [`BLOCK_VALUES`] values each, x fastest. Values beyond the volume's last
    /// voxel repeat that voxel.
    values: Vec<f32>,
}

/// The voxels that belong to one block alone, without those that it shares with the next ones.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// The first voxel, x, y, z.
    pub origin: [usize; 3],
    /// Voxels along x, y, z: up to [`BLOCK`].
    pub size: [usize; 3],
    /// The value of all voxels, if they are equal.
    pub uniform: Option<f32>,
    /// The stored block.
    values: &'a [f32],
}

impl Part<'_> {
    /// Calls `visit` with the index and the value of each voxel.
    pub fn for_each(self, mut visit: impl FnMut([usize; 3], f32)) {
        let ([x0, y0, z0], [nx, ny, nz]) = (self.origin, self.size);
        for z in 0..nz {
            for y in 0..ny {
                let row = &self.values[inside([0, y, z])..][..nx];
                for (x, &value) in row.iter().enumerate() {
                    visit([x0 + x, y0 + y, z0 + z], value);
                }
            }
        }
    }
}

/// Index of voxel (x, y, z) of a block among the block's values.
#[inline]
fn inside([x, y, z]: [usize; 3]) -> usize {
    (z * BLOCK_EDGE + y) * BLOCK_EDGE + x
}

/// Position (x, y, z) of element `i` in a grid with these counts along x, y, z, x fastest.
pub fn place_of(i: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [i % nx, i / nx % ny, i / (nx * ny)]
}

/// Number of blocks that cover `voxels` voxels along an axis.
#[inline]
fn blocks_along(voxels: usize) -> usize {
    voxels.div_ceil(BLOCK)
}

impl SparseVoxels {
    /// A volume of `dims` voxels. `values` are the stored blocks, and `table` has for each block, x
    /// fastest, the index of the stored block that holds its values; [`SparseVoxels::blocks`] gives
    /// the number of blocks along each axis. The last voxels of a block along each axis must equal
    /// the first of the next block. Values beyond the volume may be anything.
    ///
    /// # Errors
    /// If the lengths do not fit, if the table refers to a block that is not stored, or if blocks
    /// of which different parts lie in the volume share a stored block that is not uniform.
    pub fn new(dims: [usize; 3], table: Vec<u32>, values: Vec<f32>) -> Result<Self> {
        let wrong = |why: &str| Err(Error::value("sparse voxels", why));
        let blocks = dims.map(blocks_along).iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        if blocks != Some(table.len()) || table.is_empty() {
            return wrong("the table does not have one entry per block");
        }
        if !values.len().is_multiple_of(BLOCK_VALUES) {
            return wrong("the values do not fill whole blocks");
        }
        if table.iter().any(|&stored| stored as usize >= values.len() / BLOCK_VALUES) {
            return wrong("a block is not one of those stored");
        }
        let mut voxels = Self { dims, table, values };
        voxels.repeat_last()?;
        voxels.share();
        Ok(voxels)
    }

    /// The blocks of `values`, which have the shape (z, y, x) and are not empty.
    pub(super) fn of(values: &Array3<f32>) -> Self {
        let (nz, ny, nx) = values.dim();
        let dims = [nx, ny, nz];
        let counts = dims.map(blocks_along);
        let blocks = counts.iter().product();
        let (mut table, mut stored) = (Vec::with_capacity(blocks), Vec::new());
        let mut uniform: HashMap<u32, u32> = HashMap::new();
        let mut block = vec![0.0; BLOCK_VALUES];
        for i in 0..blocks {
            fill_block(values, place_of(i, counts), &mut block);
            let next = (stored.len() / BLOCK_VALUES) as u32;
            let own = match same_everywhere(&block) {
                Some(value) => *uniform.entry(value.to_bits()).or_insert(next),
                None => next,
            };
            if own == next {
                stored.extend_from_slice(&block);
            }
            table.push(own);
        }
        Self { dims, table, values: stored }
    }

    /// Voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Blocks along x, y, z.
    #[inline]
    pub fn blocks(&self) -> [usize; 3] {
        self.dims.each(blocks_along)
    }

    /// For each block, x fastest, the index of its stored block.
    pub fn table(&self) -> &[u32] {
        &self.table
    }

    /// The stored blocks, one after another, [`BLOCK_VALUES`] values each, x fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.table.as_slice()) + size_of_val(self.values.as_slice())
    }

    /// Bytes of a volume of `blocks` blocks, for which `stored` blocks are stored.
    pub fn bytes_of(blocks: u64, stored: u64) -> u64 {
        blocks.saturating_mul(4).saturating_add(stored.saturating_mul(4 * BLOCK_VALUES as u64))
    }

    /// Index in the values at which the stored block of a block begins.
    #[inline]
    fn start(&self, [x, y, z]: [usize; 3]) -> Option<usize> {
        let [bx, by, _] = self.blocks();
        Some(*self.table.get((z * by + y) * bx + x)? as usize * BLOCK_VALUES)
    }

    /// Index of a voxel in the values, within the block in which it is not a repeated last voxel;
    /// `None` beyond the last block.
    #[inline]
    pub fn offset(&self, voxel: [usize; 3]) -> Option<usize> {
        Some(self.start(voxel.each(|v| v / BLOCK))? + inside(voxel.each(|v| v % BLOCK)))
    }

    /// The value of a voxel; 0 beyond the last block.
    #[inline]
    pub fn get(&self, voxel: [usize; 3]) -> f32 {
        self.offset(voxel).map_or(0.0, |offset| self.values[offset])
    }

    /// The values at the corners of a cell: of both voxels along x, for the two of y and then those
    /// of z. The second voxel along an axis is the first, or the next. 0 beyond the last block.
    #[inline]
    pub fn corners(&self, [x, y, z]: [[usize; 2]; 3]) -> [[f32; 2]; 4] {
        // A block holds all voxels of its cells.
        let first = [x[0], y[0], z[0]];
        let Some(start) = self.start(first.each(|v| v / BLOCK)) else { return [[0.0; 2]; 4] };
        let from = start + inside(first.each(|v| v % BLOCK));
        let [x, y, z] = [x, y, z].each(|[low, high]| high - low);
        let (y, z) = (y * BLOCK_EDGE, z * BLOCK_EDGE * BLOCK_EDGE);
        let values = &self.values[from..][..=x + y + z];
        [0, y, z, y + z].each(|row| [values[row], values[row + x]])
    }

    /// The [`BLOCK_VALUES`] values of a block; empty beyond the last block.
    pub fn block(&self, block: [usize; 3]) -> &[f32] {
        self.start(block).map_or(&[], |start| &self.values[start..start + BLOCK_VALUES])
    }

    /// Copies the values of the row of voxels at `y`, `z` along x into `row`.
    pub fn fill_row(&self, y: usize, z: usize, row: &mut [f32]) {
        let [bx, by, _] = self.blocks();
        let first = (z / BLOCK * by + y / BLOCK) * bx;
        let start = inside([0, y % BLOCK, z % BLOCK]);
        for (part, &stored) in row.chunks_mut(BLOCK).zip(&self.table[first..first + bx]) {
            let from = stored as usize * BLOCK_VALUES + start;
            part.copy_from_slice(&self.values[from..from + part.len()]);
        }
    }

    /// For each stored block, the value of all its voxels if they are equal.
    pub fn uniform(&self) -> Vec<Option<f32>> {
        parallel::map(self.values.chunks(BLOCK_VALUES), same_everywhere)
    }

    /// The blocks that are not zero everywhere, x fastest.
    pub fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let counts = self.blocks();
        let uniform = self.uniform();
        self.table.iter().enumerate().filter_map(move |(i, &stored)| {
            let uniform = uniform[stored as usize];
            if uniform == Some(0.0) {
                return None;
            }
            let origin = place_of(i, counts).map(|b| b * BLOCK);
            let size = std::array::from_fn(|axis| BLOCK.min(self.dims[axis] - origin[axis]));
            let values = &self.values[stored as usize * BLOCK_VALUES..][..BLOCK_VALUES];
            Some(Part { origin, size, uniform, values })
        })
    }

    /// Replaces every value by `with` of it.
    pub fn replace(&mut self, with: impl Fn(f32) -> f32 + Sync) {
        parallel::for_each(self.values.chunks_mut(BLOCK_VALUES), |block| {
            for value in block {
                *value = with(*value);
            }
        });
        self.share();
    }

    /// A volume with the values `value(voxel)`, which must be 0 wherever a voxel and all its
    /// neighbours are equal.
    pub(super) fn derived(&self, value: impl Fn([usize; 3]) -> f32 + Sync) -> Self {
        let counts = self.blocks();
        let [bx, by, _] = counts;
        let position = |i: usize| place_of(i, counts);
        let uniform = self.uniform();
        // The neighbouring blocks on all sides must be the same too.
        let even = |i: usize| {
            let (own, at) = (self.table[i], position(i));
            let steps = [1, bx, bx * by];
            let same = |axis: usize| {
                (at[axis] == 0 || self.table[i - steps[axis]] == own)
                    && (at[axis] + 1 == counts[axis] || self.table[i + steps[axis]] == own)
            };
            uniform[own as usize].is_some() && (0..3).all(same)
        };
        let others: Vec<usize> = (0..self.table.len()).filter(|&i| !even(i)).collect();
        let mut values = vec![0.0; (others.len() + 1) * BLOCK_VALUES];
        let blocks = values.chunks_exact_mut(BLOCK_VALUES).skip(1).zip(&others);
        parallel::for_each(blocks, |(block, &i)| {
            let first = position(i).map(|b| b * BLOCK);
            let at = |k: usize, axis: usize| (first[axis] + k).min(self.dims[axis] - 1);
            for (k, filled) in block.iter_mut().enumerate() {
                let [x, y, z] = place_of(k, [BLOCK_EDGE; 3]);
                *filled = value([at(x, 0), at(y, 1), at(z, 2)]);
            }
        });
        let mut table = vec![0; self.table.len()];
        for (stored, i) in others.into_iter().enumerate() {
            table[i] = stored as u32 + 1;
        }
        let mut derived = Self { dims: self.dims, table, values };
        derived.share();
        derived
    }

    /// Repeats the last voxel along each axis in the parts of blocks that lie beyond the volume.
    fn repeat_last(&mut self) -> Result<()> {
        let counts = self.blocks();
        let uniform = self.uniform();
        // The last voxel of each stored block that lies in the volume.
        let mut ends: Vec<Option<[usize; 3]>> = vec![None; uniform.len()];
        for (i, &stored) in self.table.iter().enumerate() {
            if uniform[stored as usize].is_some() {
                continue;
            }
            let block = place_of(i, counts);
            let last: [usize; 3] =
                std::array::from_fn(|axis| (self.dims[axis] - 1 - block[axis] * BLOCK).min(BLOCK));
            match ends[stored as usize] {
                Some(known) if known != last => {
                    let why = "a block at the border is shared with one of a different size";
                    return Err(Error::value("sparse voxels", why));
                }
                _ => ends[stored as usize] = Some(last),
            }
        }
        let blocks = self.values.chunks_exact_mut(BLOCK_VALUES).zip(ends);
        parallel::for_each(blocks, |(values, last)| {
            let Some(last) = last.filter(|last| *last != [BLOCK; 3]) else { return };
            for k in 0..BLOCK_VALUES {
                let place = place_of(k, [BLOCK_EDGE; 3]);
                values[k] = values[inside(std::array::from_fn(|axis| place[axis].min(last[axis])))];
            }
        });
        Ok(())
    }

    /// Stores blocks of one uniform value only once, and removes stored blocks that are not used.
    fn share(&mut self) {
        let mut used = vec![false; self.values.len() / BLOCK_VALUES];
        for &stored in &self.table {
            used[stored as usize] = true;
        }
        let mut known: HashMap<u32, u32> = HashMap::new();
        let mut moved = Vec::with_capacity(used.len());
        let mut kept = 0_u32;
        for (stored, uniform) in self.uniform().into_iter().enumerate() {
            if !used[stored] {
                moved.push(0);
                continue;
            }
            let place = match uniform {
                Some(value) => *known.entry(value.to_bits()).or_insert(kept),
                None => kept,
            };
            if place == kept {
                let from = stored * BLOCK_VALUES;
                self.values.copy_within(from..from + BLOCK_VALUES, kept as usize * BLOCK_VALUES);
                kept += 1;
            }
            moved.push(place);
        }
        self.values.truncate(kept as usize * BLOCK_VALUES);
        self.values.shrink_to_fit();
        self.table.iter_mut().for_each(|stored| *stored = moved[*stored as usize]);
    }
}

/// The value of all a block's voxels, if they are equal.
fn same_everywhere(block: &[f32]) -> Option<f32> {
    let (first, rest) = block.split_first()?;
    rest.iter().all(|value| value.to_bits() == first.to_bits()).then_some(*first)
}

/// Fills a block from an array of shape (z, y, x); values beyond its last voxel repeat that voxel.
fn fill_block(values: &Array3<f32>, block: [usize; 3], filled: &mut [f32]) {
    let (nz, ny, nx) = values.dim();
    let [x0, y0, z0] = block.map(|b| b * BLOCK);
    for (i, row) in filled.chunks_exact_mut(BLOCK_EDGE).enumerate() {
        let (y, z) = ((y0 + i % BLOCK_EDGE).min(ny - 1), (z0 + i / BLOCK_EDGE).min(nz - 1));
        for (x, value) in row.iter_mut().enumerate() {
            *value = values[[z, y, (x0 + x).min(nx - 1)]];
        }
    }
}
