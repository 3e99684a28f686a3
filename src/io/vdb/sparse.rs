//! Converts a box of a tree to blocks of values to render, where equal blocks are stored once:
//! empty parts of a tree take no memory here either.

use std::collections::HashMap;

use glam::IVec3;

use super::canvas::Canvas;
use super::index_box::IndexBox;
use super::tree::{Leaf, Tile, Tree};
use super::value::Value;
use crate::error::memory;
use crate::error::{ErrorKind, Result};
use crate::parallel;
use crate::volume::{BLOCK, BLOCK_EDGE, BLOCK_VALUES, MAX_DIM, SparseVoxels, place_of};

/// The largest number of blocks for a box.
const MOST_BLOCKS: u64 = 1 << 26;

/// The contents of a block that is not uniform; later ones cover earlier ones.
struct Own<'a, T> {
    block: [usize; 3],
    /// The value of the block where nothing covers it.
    ground: f32,
    tiles: Vec<Tile<T>>,
    leaves: Vec<Leaf<'a, T>>,
}

/// A box of a tree in blocks, with the tiles and leaves of each block; made by [`Tree::blocks`].
pub struct Blocks<'a, T> {
    bounds: IndexBox,
    /// Number of blocks along x, y, z.
    counts: [usize; 3],
    /// The values of uniform blocks; the first is the background.
    uniform: Vec<f32>,
    own: Vec<Own<'a, T>>,
    /// For each block, x fastest: an index in `uniform`, or, with the flag [`OWN`], in `own`.
    table: Vec<u32>,
    /// The largest number of blocks in `own`.
    room: usize,
    /// Whether more would be needed.
    overfull: bool,
}

/// Flag in the table: the block is not uniform.
const OWN: u32 = 1 << 31;

impl<T: Value> Tree<T> {
    /// The blocks of `bounds`, not filled yet.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if there are more blocks than a table can hold, or if they take more
    /// than `limit_bytes` once they are filled.
    pub fn blocks(&self, bounds: IndexBox, limit_bytes: u64) -> Result<Blocks<'_, T>> {
        let blocks = bounds.dims().map(|length| length.div_ceil(BLOCK as u64));
        let count = blocks.iter().fold(1_u64, |all, &n| all.saturating_mul(n));
        if count > MOST_BLOCKS || bounds.dims().iter().any(|&n| n > MAX_DIM as u64) {
            let [x, y, z] = bounds.dims();
            return Err(ErrorKind::Limit {
                what: format!("a sparse grid over {x} x {y} x {z} voxels"),
                needed: format!("{count} blocks of {BLOCK} voxels cubed"),
                limit: format!("{MOST_BLOCKS}, and {MAX_DIM} voxels along an axis"),
            }
            .into());
        }
        let refused = || {
            let [x, y, z] = bounds.dims();
            let what = format!("a sparse grid over {x} x {y} x {z} voxels");
            let needed = format!("more than {limit_bytes} bytes");
            Err(ErrorKind::Limit { what, needed, limit: format!("{limit_bytes} bytes") }.into())
        };
        let most = limit_bytes.min(isize::MAX as u64);
        let Some(left) = most.checked_sub(SparseVoxels::bytes_of(count, 1)) else {
            return refused();
        };
        let mut found = Blocks {
            bounds,
            counts: blocks.map(|n| n as usize),
            uniform: vec![self.background().to_f32()],
            own: Vec::new(),
            table: memory::filled(count as usize, 0, "blocks of a sparse grid")?,
            // Many of them may turn out to be equal.
            room: memory::count(left) / size_of::<Own<'_, T>>(),
            overfull: false,
        };
        let mut known = HashMap::from([(found.uniform[0].to_bits(), 0)]);
        for tile in self.tiles() {
            found.add_tile(tile, &mut known);
        }
        for leaf in self.leaves() {
            found.each_touched(leaf.bounds(), |blocks, i, _| {
                blocks.own_at(i).into_iter().for_each(|own| own.leaves.push(leaf));
            });
        }
        if found.overfull {
            return refused();
        }
        found.share_alike();
        if found.bytes() > most {
            return refused();
        }
        Ok(found)
    }
}

impl<'a, T: Value> Blocks<'a, T> {
    /// An upper bound for the bytes of memory that the blocks take once they are filled.
    pub fn bytes(&self) -> u64 {
        let stored = self.uniform.len() + self.own.len();
        SparseVoxels::bytes_of(self.table.len() as u64, stored as u64)
    }

    /// Fills the blocks with all voxels, active or not, as numbers for rendering (see
    /// [`Value::to_f32`]), each converted by `convert`.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn fill(self, convert: impl Fn(f32) -> f32 + Sync) -> Result<SparseVoxels> {
        let Self { bounds, uniform, own, mut table, .. } = self;
        let stored = (uniform.len() + own.len()) * BLOCK_VALUES;
        let mut values = memory::filled(stored, 0.0, "voxels of a sparse grid")?;
        let (constant, rest) = values.split_at_mut(uniform.len() * BLOCK_VALUES);
        for (block, value) in constant.chunks_exact_mut(BLOCK_VALUES).zip(&uniform) {
            block.fill(convert(*value));
        }
        let blocks = rest.chunks_exact_mut(BLOCK_VALUES).zip(&own);
        parallel::for_each(blocks, |(values, own)| own.fill(values, &bounds, &convert));
        for block in table.iter_mut().filter(|block| **block & OWN != 0) {
            *block = (*block & !OWN) + uniform.len() as u32;
        }
        SparseVoxels::new(bounds.dims().map(|n| n as usize), table, values)
    }

    /// Merges blocks that contain only tiles, in the same arrangement: those along the faces of a
    /// large tile.
    fn share_alike(&mut self) {
        let mut known: HashMap<Vec<i64>, u32> = HashMap::new();
        let mut moved = Vec::with_capacity(self.own.len());
        let mut kept = Vec::new();
        for own in std::mem::take(&mut self.own) {
            let next = kept.len() as u32;
            let place = match own.key(&self.bounds) {
                Some(key) => *known.entry(key).or_insert(next),
                None => next,
            };
            if place == next {
                kept.push(own);
            }
            moved.push(place);
        }
        self.own = kept;
        for block in self.table.iter_mut().filter(|block| **block & OWN != 0) {
            *block = OWN | moved[(*block & !OWN) as usize];
        }
    }

    fn add_tile(&mut self, tile: Tile<T>, known: &mut HashMap<u32, u32>) {
        let value = tile.value.to_f32();
        self.each_touched(tile.bounds(), |blocks, i, whole| {
            if whole {
                let next = blocks.uniform.len() as u32;
                let uniform = *known.entry(value.to_bits()).or_insert(next);
                if uniform == next {
                    blocks.uniform.push(value);
                }
                blocks.table[i] = uniform;
            } else if !blocks.is_all(i, value) {
                blocks.own_at(i).into_iter().for_each(|own| own.tiles.push(tile));
            }
        });
    }

    /// Calls `visit` for each block that contains voxels of a cube, and says whether the cube
    /// contains the whole block.
    fn each_touched(&mut self, cube: IndexBox, mut visit: impl FnMut(&mut Self, usize, bool)) {
        let Some(part) = cube.intersection(&self.bounds) else { return };
        let min = self.bounds.min.to_array();
        let last = self.bounds.dims().map(|n| n as i64 - 1);
        let (low, high) = (part.min.to_array(), part.max.to_array());
        let offset = |index: i32, axis: usize| i64::from(index) - i64::from(min[axis]);
        // A block's last voxels are the next block's first.
        let span = |axis: usize| {
            let first = (offset(low[axis], axis) - 1).max(0) / BLOCK as i64;
            first..=offset(high[axis], axis) / BLOCK as i64
        };
        let inside = |block: i64, axis: usize| {
            let first = block * BLOCK as i64;
            let end = (first + BLOCK as i64).min(last[axis]);
            offset(low[axis], axis) <= first && end <= offset(high[axis], axis)
        };
        let [nx, ny, _] = self.counts;
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let whole = inside(x, 0) && inside(y, 1) && inside(z, 2);
                    visit(self, (z as usize * ny + y as usize) * nx + x as usize, whole);
                }
            }
        }
    }

    /// Whether a whole block is known to have this value.
    fn is_all(&self, i: usize, value: f32) -> bool {
        let known = self.uniform.get(self.table[i] as usize);
        known.is_some_and(|known| known.to_bits() == value.to_bits())
    }

    /// The contents of a block that is not uniform. `None` if there is no room for more such
    /// blocks.
    fn own_at(&mut self, i: usize) -> Option<&mut Own<'a, T>> {
        let known = self.table[i];
        if known & OWN == 0 {
            if self.own.len() == self.room {
                self.overfull = true;
                return None;
            }
            let block = place_of(i, self.counts);
            let ground = self.uniform[known as usize];
            self.table[i] = OWN | self.own.len() as u32;
            self.own.push(Own { block, ground, tiles: Vec::new(), leaves: Vec::new() });
        }
        self.own.get_mut((self.table[i] & !OWN) as usize)
    }
}

impl<T: Value> Own<'_, T> {
    /// The block's voxels that are in the box.
    fn held(&self, bounds: &IndexBox) -> IndexBox {
        let first = bounds.min + IVec3::from_array(self.block.map(|b| (b * BLOCK) as i32));
        let edge = BLOCK_EDGE as i32 - 1;
        // Limited to the box and to 32-bit indices.
        let last = IVec3::from_array(std::array::from_fn(|axis| {
            first[axis].saturating_add(edge).min(bounds.max[axis])
        }));
        IndexBox { min: first, max: last }
    }

    /// A key that is equal for blocks with the same tiles in the same positions; `None` if there
    /// are leaves.
    fn key(&self, bounds: &IndexBox) -> Option<Vec<i64>> {
        if !self.leaves.is_empty() {
            return None;
        }
        let held = self.held(bounds);
        let place = |at: IVec3| (at - held.min).to_array().map(i64::from);
        let mut key = place(held.max).to_vec();
        key.push(i64::from(self.ground.to_bits()));
        for tile in &self.tiles {
            let part = tile.bounds().intersection(&held)?;
            key.extend(place(part.min).into_iter().chain(place(part.max)));
            key.push(i64::from(tile.value.to_f32().to_bits()));
        }
        Some(key)
    }

    fn fill(&self, values: &mut [f32], bounds: &IndexBox, convert: &impl Fn(f32) -> f32) {
        values.fill(convert(self.ground));
        let mut canvas = Canvas { bounds: self.held(bounds), along: [BLOCK_EDGE; 2], values };
        let number = |value: T, _| convert(value.to_f32());
        self.tiles.iter().for_each(|tile| canvas.add_tile(tile, number));
        self.leaves.iter().for_each(|leaf| canvas.add_leaf(leaf, number));
    }
}
