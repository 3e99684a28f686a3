//! A loaded grid of one value type: a sparse tree like OpenVDB's. Knows nothing of files.

use glam::IVec3;

use super::grid_type::{slot_of, slot_offset};
use super::index_box::IndexBox;
use super::mask;
use super::statistics::{Findings, Statistics};
use super::topology::{RootContent, Tiles, Topology, branch_slots};
use super::value::Value;
use crate::parallel;

/// The values of a grid: leaves of (nearly always) 8^3 voxels, and tiles for larger constant
/// regions. All other voxels have the background's value and are inactive.
#[derive(Clone)]
pub struct Tree<T> {
    topology: Topology<T>,
    leaf_values: Vec<T>,
}

/// A cube of voxels with individual values.
#[derive(Clone, Copy, Debug)]
pub struct Leaf<'a, T> {
    /// The lowest voxel.
    pub origin: IVec3,
    /// Base-2 logarithm of the edge in voxels; 3 except in trees of an unusual shape.
    pub log_edge: u32,
    /// The values of all voxels, also inactive ones; z fastest, then y, then x.
    pub values: &'a [T],
    /// One bit per voxel, in the order of `values`, from the lowest bit of the first word on; set
    /// for active voxels.
    pub active: &'a [u64],
}

/// A cube of voxels that share one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile<T> {
    /// The lowest voxel.
    pub origin: IVec3,
    /// Base-2 logarithm of the edge in voxels: 3, 7 or 12 except in trees of an unusual shape; 0
    /// for a single voxel (see [`Tree::active_values`]).
    pub log_edge: u32,
    /// The value of every voxel.
    pub value: T,
    /// Whether the voxels are active.
    pub active: bool,
}

impl<T> Tile<T> {
    /// The box of the tile's voxels.
    pub fn bounds(&self) -> IndexBox {
        IndexBox::cube(self.origin, self.log_edge)
    }

    /// Number of voxels.
    pub fn voxels(&self) -> u64 {
        1 << (3 * self.log_edge)
    }
}

impl<'a, T: Copy> Leaf<'a, T> {
    /// The box of the leaf's voxels.
    pub fn bounds(&self) -> IndexBox {
        IndexBox::cube(self.origin, self.log_edge)
    }

    /// The active voxels, as tiles of one voxel.
    pub fn active_values(self) -> impl Iterator<Item = Tile<T>> + 'a {
        mask::set_bits(self.active).map(move |voxel| Tile {
            origin: self.origin + slot_offset(voxel, self.log_edge, 0),
            log_edge: 0,
            value: self.values[voxel],
            active: true,
        })
    }
}

impl<T: Value> Tree<T> {
    pub(super) fn new(topology: Topology<T>, leaf_values: Vec<T>) -> Self {
        Self { topology, leaf_values }
    }

    pub(super) fn into_parts(self) -> (Topology<T>, Vec<T>) {
        (self.topology, self.leaf_values)
    }

    pub(super) fn topology(&self) -> &Topology<T> {
        &self.topology
    }

    /// The value of every voxel that is neither in a leaf nor in a tile.
    pub fn background(&self) -> T {
        self.topology.background
    }

    /// The value at a voxel, and whether it is active.
    pub fn get(&self, index: IVec3) -> (T, bool) {
        let topology = &self.topology;
        let shape = topology.shape;
        let origin = index & !((1 << shape.upper_log()) - 1);
        let found =
            topology.root.binary_search_by_key(&origin.to_array(), |slot| slot.origin.to_array());
        let Ok(found) = found else { return (topology.background, false) };
        let upper = match topology.root[found].content {
            RootContent::Tile { value, active } => return (value, active),
            RootContent::Child(upper) => &topology.uppers[upper],
        };
        let [slot, lower_slot] = branch_slots(shape, index);
        let Some(lower) = upper.child(slot) else {
            return (upper.tiles.get(slot), upper.active.has(slot));
        };
        let lower = &topology.lowers[lower];
        let Some(leaf) = lower.child(lower_slot) else {
            return (lower.tiles.get(lower_slot), lower.active.has(lower_slot));
        };
        let leaf = self.leaf(leaf);
        let voxel = slot_of(index, shape.leaf, 0);
        (leaf.values[voxel], mask::is_set(leaf.active, voxel))
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.topology.leaf_origins.len()
    }

    fn leaf(&self, index: usize) -> Leaf<'_, T> {
        let voxels = self.topology.shape.leaf_voxels();
        Leaf {
            origin: self.topology.leaf_origins[index],
            log_edge: self.topology.shape.leaf,
            values: &self.leaf_values[index * voxels..(index + 1) * voxels],
            active: self.topology.leaf_mask(index),
        }
    }

    /// All leaves, in the order of the file.
    pub fn leaves(&self) -> impl ExactSizeIterator<Item = Leaf<'_, T>> {
        (0..self.leaf_count()).map(|index| self.leaf(index))
    }

    /// The tiles that are active or differ from the background.
    pub fn tiles(&self) -> impl Iterator<Item = Tile<T>> {
        self.topology.tiles()
    }

    /// Every active voxel once: tiles first, then the voxels of the leaves as tiles of one voxel.
    pub fn active_values(&self) -> impl Iterator<Item = Tile<T>> {
        let tiles = self.tiles().filter(|tile| tile.active);
        tiles.chain(self.leaves().flat_map(Leaf::active_values))
    }

    /// Number of active voxels, saturating at `u64::MAX`.
    pub fn active_voxel_count(&self) -> u64 {
        self.topology.active_voxel_count()
    }

    /// The smallest box around all active voxels; `None` if there are none.
    pub fn active_bounds(&self) -> Option<IndexBox> {
        self.topology.active_bounds()
    }

    /// Statistics of the active values, one per component; empty without active voxels.
    pub fn statistics(&self) -> Vec<Statistics> {
        let mut all = Findings::of_tiles(&self.topology);
        let leaves =
            parallel::map(self.leaves(), |leaf| Findings::of_leaf(leaf.values, leaf.active));
        for leaf in &leaves {
            all.merge(leaf);
        }
        all.statistics(T::COMPONENTS)
    }

    /// Bytes of memory held.
    pub fn memory_bytes(&self) -> u64 {
        (self.topology.memory_bytes() + size_of_val(self.leaf_values.as_slice())) as u64
    }
}

impl<T: Value> Topology<T> {
    /// The tiles that are active or differ from the background.
    pub(super) fn tiles(&self) -> impl Iterator<Item = Tile<T>> {
        let shape = self.shape;
        let root = self.root.iter().filter_map(move |slot| match slot.content {
            RootContent::Tile { value, active } => {
                Some(Tile { origin: slot.origin, log_edge: shape.upper_log(), value, active })
            }
            RootContent::Child(_) => None,
        });
        let uppers = self.uppers.iter().map(move |upper| (upper, shape.upper, shape.lower_log()));
        let lowers = self.lowers.iter().map(move |lower| (lower, shape.lower, shape.leaf_log()));
        let branches = uppers.chain(lowers).flat_map(|(branch, log, slot_log)| {
            // A branch whose tiles are all inactive background is skipped at once.
            let blank = matches!(branch.tiles, Tiles::Uniform(value)
                if value.same_bits(self.background) && branch.active.count() == 0);
            let slots = if blank { 0 } else { 1 << (3 * log) };
            (0..slots).filter(|&slot| !branch.children.has(slot)).map(move |slot| Tile {
                origin: branch.origin + slot_offset(slot, log, slot_log),
                log_edge: slot_log,
                value: branch.tiles.get(slot),
                active: branch.active.has(slot),
            })
        });
        let background = self.background;
        root.chain(branches).filter(move |tile| tile.active || !tile.value.same_bits(background))
    }

    /// Number of active voxels, saturating at `u64::MAX`.
    pub(super) fn active_voxel_count(&self) -> u64 {
        let tiles = self.tiles().filter(|tile| tile.active).map(|tile| tile.voxels());
        let voxels = mask::count_ones(&self.leaf_active) as u64;
        tiles.fold(voxels, u64::saturating_add)
    }

    /// The smallest box around all active voxels.
    pub(super) fn active_bounds(&self) -> Option<IndexBox> {
        let around = |known: Option<IndexBox>, more: IndexBox| match known {
            Some(known) => Some(known.union(&more)),
            None => Some(more),
        };
        let tiles = self.tiles().filter(|tile| tile.active);
        let mut known = tiles.fold(None, |known, tile| around(known, tile.bounds()));
        for (index, &origin) in self.leaf_origins.iter().enumerate() {
            let cube = IndexBox::cube(origin, self.shape.leaf);
            // Most leaves lie within the bounds already, whatever their voxels are.
            if known.is_some_and(|known| known.intersection(&cube) == Some(cube)) {
                continue;
            }
            for voxel in mask::set_bits(self.leaf_mask(index)) {
                let voxel = origin + slot_offset(voxel, self.shape.leaf, 0);
                known = around(known, IndexBox { min: voxel, max: voxel });
            }
        }
        known
    }
}
