//! Values in blocks, of which those that are the same everywhere share one: smoke in a large empty box takes
//! memory where it is.
//!
//! ```text
//! voxel  0 1 2 ..    .. 15 16 17 ..
//!       |x x x ..    .. x  x|            block 0: 17 voxels along an axis, for 16 cells
//!                       |x  x ..    x|   block 1 begins with the last voxel of block 0
//! ```

use std::collections::HashMap;

use ndarray::Array3;
use rayon::prelude::*;

use crate::error::{Error, Result};

/// Cells along each edge of a block.
pub const BLOCK: usize = 16;
/// Voxels along each edge of a block: a cell needs those at both of its ends.
pub const BLOCK_EDGE: usize = BLOCK + 1;
/// Voxels of a block.
pub const BLOCK_VALUES: usize = BLOCK_EDGE * BLOCK_EDGE * BLOCK_EDGE;

/// Blocks of values; block (x, y, z) holds the cells from voxel `BLOCK * (x, y, z)` on.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseVoxels {
    /// Voxels along x, y, z.
    dims: [usize; 3],
    /// Which of the stored blocks each block is, x fastest.
    table: Vec<u32>,
    /// Stored blocks, [`BLOCK_VALUES`] each, x fastest. What lies beyond the last voxel is as that.
    values: Vec<f32>,
}

/// A block with voxels that no block before it has, and differs from 0 in some.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// The first voxel, x, y, z.
    pub origin: [usize; 3],
    /// Voxels of its own along x, y, z: up to [`BLOCK`].
    pub size: [usize; 3],
    /// The stored block.
    values: &'a [f32],
}

impl Part<'_> {
    /// Calls `visit` with each of its own voxels and what it holds.
    pub fn for_each(self, mut visit: impl FnMut([usize; 3], f32)) {
        let ([x0, y0, z0], [nx, ny, nz]) = (self.origin, self.size);
        for z in 0..nz {
            for y in 0..ny {
                let row = &self.values[(z * BLOCK_EDGE + y) * BLOCK_EDGE..][..nx];
                for (x, &value) in row.iter().enumerate() {
                    visit([x0 + x, y0 + y, z0 + z], value);
                }
            }
        }
    }
}

/// Blocks that cover so many voxels along an axis.
fn blocks_along(voxels: usize) -> usize {
    voxels.div_ceil(BLOCK)
}

impl SparseVoxels {
    /// Volumes of `dims` voxels from stored blocks and, for each block, which of them it is: as
    /// [`SparseVoxels::blocks`] says how many there are, x fastest. Stored blocks at the upper borders may hold
    /// anything beyond the last voxel, and stand for one block only unless their values are all the same.
    ///
    /// # Errors
    /// If the lengths do not fit, or a block is none of those stored.
    pub fn new(dims: [usize; 3], table: Vec<u32>, values: Vec<f32>) -> Result<Self> {
        let wrong = |why: &str| Err(Error::value("sparse voxels", why));
        let blocks = dims.map(blocks_along).iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        if blocks != Some(table.len()) || table.is_empty() {
            return wrong("the table has not one entry a block");
        }
        if !values.len().is_multiple_of(BLOCK_VALUES) {
            return wrong("values are not whole blocks");
        }
        if table.iter().any(|&stored| stored as usize >= values.len() / BLOCK_VALUES) {
            return wrong("a block is none of those stored");
        }
        let mut voxels = Self { dims, table, values };
        voxels.repeat_last();
        voxels.share();
        Ok(voxels)
    }

    /// The blocks of values of shape (z, y, x), not empty.
    pub(super) fn of(values: &Array3<f32>) -> Self {
        let (nz, ny, nx) = values.dim();
        let dims = [nx, ny, nz];
        let [bx, by, bz] = dims.map(blocks_along);
        let (mut table, mut stored) = (Vec::with_capacity(bx * by * bz), Vec::new());
        let mut uniform: HashMap<u32, u32> = HashMap::new();
        let mut block = vec![0.0; BLOCK_VALUES];
        for i in 0..bx * by * bz {
            fill_block(values, [i % bx, i / bx % by, i / (bx * by)], &mut block);
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
    pub fn blocks(&self) -> [usize; 3] {
        self.dims.map(blocks_along)
    }

    /// Which stored block each block is, x fastest.
    pub fn table(&self) -> &[u32] {
        &self.table
    }

    /// The stored blocks, one behind the other, x fastest in each.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.table.as_slice()) + size_of_val(self.values.as_slice())
    }

    /// Bytes of so many blocks, of which as many are stored.
    pub fn bytes_of(blocks: u64, stored: u64) -> u64 {
        blocks.saturating_mul(4).saturating_add(stored.saturating_mul(4 * BLOCK_VALUES as u64))
    }

    /// The value of a voxel.
    #[inline]
    pub fn get(&self, [x, y, z]: [usize; 3]) -> f32 {
        let [bx, by, _] = self.blocks();
        let stored = self.table[(z / BLOCK * by + y / BLOCK) * bx + x / BLOCK] as usize;
        let [x, y, z] = [x % BLOCK, y % BLOCK, z % BLOCK];
        self.values[stored * BLOCK_VALUES + (z * BLOCK_EDGE + y) * BLOCK_EDGE + x]
    }

    /// The values of a block.
    pub fn block(&self, [x, y, z]: [usize; 3]) -> &[f32] {
        let [bx, by, _] = self.blocks();
        let stored = self.table[(z * by + y) * bx + x] as usize;
        &self.values[stored * BLOCK_VALUES..][..BLOCK_VALUES]
    }

    /// The values of a row of voxels along x.
    pub fn fill_row(&self, y: usize, z: usize, row: &mut [f32]) {
        let [bx, by, _] = self.blocks();
        let first = (z / BLOCK * by + y / BLOCK) * bx;
        let inside = (z % BLOCK * BLOCK_EDGE + y % BLOCK) * BLOCK_EDGE;
        for (part, &stored) in row.chunks_mut(BLOCK).zip(&self.table[first..first + bx]) {
            let from = stored as usize * BLOCK_VALUES + inside;
            part.copy_from_slice(&self.values[from..from + part.len()]);
        }
    }

    /// Whether each stored block is 0 everywhere.
    pub(super) fn blank(&self) -> Vec<bool> {
        self.values.par_chunks(BLOCK_VALUES).map(|b| b.iter().all(|&v| v == 0.0)).collect()
    }

    /// Blocks that hold anything, x fastest.
    pub fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let [bx, by, _] = self.blocks();
        let blank = self.blank();
        let held = self.table.iter().enumerate().filter(move |&(_, &s)| !blank[s as usize]);
        held.map(move |(i, &stored)| {
            let origin = [i % bx, i / bx % by, i / (bx * by)].map(|b| b * BLOCK);
            let size = std::array::from_fn(|axis| BLOCK.min(self.dims[axis] - origin[axis]));
            let values = &self.values[stored as usize * BLOCK_VALUES..][..BLOCK_VALUES];
            Part { origin, size, values }
        })
    }

    /// Replaces every value.
    pub fn replace(&mut self, with: impl Fn(f32) -> f32 + Sync) {
        self.values.par_iter_mut().for_each(|value| *value = with(*value));
        self.share();
    }

    /// Blocks of other values, which are 0 wherever a voxel and all those around it hold the same.
    pub(super) fn derived(&self, value: impl Fn([usize; 3]) -> f32 + Sync) -> Self {
        let counts = self.blocks();
        let [bx, by, _] = counts;
        let position = |i: usize| [i % bx, i / bx % by, i / (bx * by)];
        // A block knows the first voxels of the next ones, but not the last of those before it.
        let even = |i: usize| {
            let own = self.table[i];
            let before = position(i).map(|b| usize::from(b > 0));
            let lower = [before[0], before[1] * bx, before[2] * bx * by];
            let same = lower.iter().all(|step| self.table[i - step] == own);
            same && same_everywhere(self.block(position(i))).is_some()
        };
        let filled = |i: usize| -> Vec<f32> {
            let first = position(i).map(|b| b * BLOCK);
            let at = |k: usize, axis: usize| (first[axis] + k).min(self.dims[axis] - 1);
            let voxels = (0..BLOCK_VALUES).map(|k| {
                [k % BLOCK_EDGE, k / BLOCK_EDGE % BLOCK_EDGE, k / BLOCK_EDGE / BLOCK_EDGE]
            });
            voxels.map(|[x, y, z]| value([at(x, 0), at(y, 1), at(z, 2)])).collect()
        };
        let others: Vec<usize> = (0..self.table.len()).filter(|&i| !even(i)).collect();
        let blocks: Vec<Vec<f32>> = others.par_iter().map(|&i| filled(i)).collect();
        let mut table = vec![0; self.table.len()];
        let mut values = vec![0.0; BLOCK_VALUES];
        for (i, block) in others.into_iter().zip(blocks) {
            table[i] = (values.len() / BLOCK_VALUES) as u32;
            values.extend(block);
        }
        let mut derived = Self { dims: self.dims, table, values };
        derived.share();
        derived
    }

    /// Repeats the last voxel of each axis in what blocks have beyond it.
    fn repeat_last(&mut self) {
        let [bx, by, _] = self.blocks();
        for (i, &stored) in self.table.iter().enumerate() {
            let block = [i % bx, i / bx % by, i / (bx * by)];
            let last: [usize; 3] =
                std::array::from_fn(|axis| (self.dims[axis] - 1 - block[axis] * BLOCK).min(BLOCK));
            if last == [BLOCK; 3] {
                continue;
            }
            let values = &mut self.values[stored as usize * BLOCK_VALUES..][..BLOCK_VALUES];
            let at = |x: usize, y: usize, z: usize| (z * BLOCK_EDGE + y) * BLOCK_EDGE + x;
            for z in 0..BLOCK_EDGE {
                for y in 0..BLOCK_EDGE {
                    for x in 0..BLOCK_EDGE {
                        values[at(x, y, z)] =
                            values[at(x.min(last[0]), y.min(last[1]), z.min(last[2]))];
                    }
                }
            }
        }
    }

    /// Keeps one of all stored blocks that are the same value everywhere, for each value.
    fn share(&mut self) {
        let uniform: Vec<Option<f32>> =
            self.values.par_chunks(BLOCK_VALUES).map(same_everywhere).collect();
        let mut known: HashMap<u32, u32> = HashMap::new();
        let mut moved = Vec::with_capacity(uniform.len());
        let mut kept = 0_u32;
        for (stored, uniform) in uniform.into_iter().enumerate() {
            if let Some(value) = uniform {
                if let Some(&first) = known.get(&value.to_bits()) {
                    moved.push(first);
                    continue;
                }
                known.insert(value.to_bits(), kept);
            }
            let from = stored * BLOCK_VALUES;
            self.values.copy_within(from..from + BLOCK_VALUES, kept as usize * BLOCK_VALUES);
            moved.push(kept);
            kept += 1;
        }
        self.values.truncate(kept as usize * BLOCK_VALUES);
        self.values.shrink_to_fit();
        self.table.par_iter_mut().for_each(|stored| *stored = moved[*stored as usize]);
    }
}

/// The value that all of a block's are.
fn same_everywhere(block: &[f32]) -> Option<f32> {
    let (first, rest) = block.split_first()?;
    rest.iter().all(|value| value.to_bits() == first.to_bits()).then_some(*first)
}

/// The values of a block of an array of shape (z, y, x); beyond its last voxel, as that.
pub(super) fn fill_block(values: &Array3<f32>, block: [usize; 3], filled: &mut [f32]) {
    let (nz, ny, nx) = values.dim();
    let [x0, y0, z0] = block.map(|b| b * BLOCK);
    for (i, row) in filled.chunks_exact_mut(BLOCK_EDGE).enumerate() {
        let (y, z) = ((y0 + i % BLOCK_EDGE).min(ny - 1), (z0 + i / BLOCK_EDGE).min(nz - 1));
        for (x, value) in row.iter_mut().enumerate() {
            *value = values[[z, y, (x0 + x).min(nx - 1)]];
        }
    }
}
