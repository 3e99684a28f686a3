//! Builds trees: from voxels and boxes that are set one after another, or from a tree that is to be
//! changed. Constant regions become tiles. Knows nothing of files.

use std::collections::BTreeMap;

use glam::IVec3;

use super::grid_type::{TreeShape, slot_of, slot_offset};
use super::index_box::IndexBox;
use super::mask::{self, SlotMask};
use super::topology::{Branch, RootContent, RootSlot, Tiles, Topology};
use super::tree::Tree;
use super::value::Value;

/// Voxels of a leaf.
const VOXELS: usize = 512;
const WORDS: usize = 8;

/// Base-2 logarithms of the edges, in voxels, of a leaf and of the branches above it.
const EDGES: [u32; 3] = [3, 7, 12];

/// Builds a tree in the shape that every program reads (leaves of 8^3 voxels, branches of 16^3 and
/// 32^3). Values that are set later replace earlier ones.
pub struct TreeBuilder<T> {
    background: T,
    root: BTreeMap<[i32; 3], Node<T>>,
}

/// The content of a cube: a tile, unless it has slots or, at the lowest level, voxels.
struct Node<T> {
    /// The tile's value and activity. If there are slots, it applies to those that are not in the
    /// map.
    tile: (T, bool),
    slots: Option<BTreeMap<usize, Self>>,
    leaf: Option<Box<LeafVoxels<T>>>,
    /// In place of `leaf`: a leaf in the file's encoding, which begins with the active mask. It
    /// cannot be changed any more.
    packed: Option<Box<[u8]>>,
}

/// The voxels of all leaves, in the order of the tree.
struct AllLeaves<T> {
    values: Vec<T>,
    packed: Vec<Box<[u8]>>,
}

struct LeafVoxels<T> {
    values: Vec<T>,
    active: [u64; WORDS],
}

/// Base-2 logarithm of a branch's edge in slots; `level` 1 is right above the leaves.
fn slots_log(level: usize) -> u32 {
    EDGES[level] - EDGES[level - 1]
}

impl<T: Value> TreeBuilder<T> {
    /// A tree that holds only the background.
    pub fn new(background: T) -> Self {
        Self { background, root: BTreeMap::new() }
    }

    /// Sets one voxel.
    pub fn set(&mut self, index: IVec3, value: T, active: bool) {
        let leaf = self.leaf(index);
        let slot = slot_of(index, EDGES[0], 0);
        leaf.values[slot] = value;
        mask::put(&mut leaf.active, slot, active);
    }

    /// Sets all voxels of a box. The time is proportional to the box's surface and to its number of
    /// cubes of 4096^3 voxels.
    pub fn fill(&mut self, bounds: IndexBox, value: T, active: bool) {
        let low = (bounds.min & !4095).to_array();
        for x in (low[0]..=bounds.max.x).step_by(4096) {
            for y in (low[1]..=bounds.max.y).step_by(4096) {
                for z in (low[2]..=bounds.max.z).step_by(4096) {
                    let origin = IVec3::new(x, y, z);
                    let empty = Node::tile(self.background, false);
                    let node = self.root.entry(origin.to_array()).or_insert(empty);
                    node.fill(2, origin, &bounds, value, active);
                }
            }
        }
    }

    /// Sets the 8^3 voxels of the leaf at `origin` to 512 `values` with z fastest; `active` has one
    /// bit per voxel.
    pub(super) fn set_leaf(&mut self, origin: IVec3, values: Vec<T>, active: [u64; WORDS]) {
        *self.leaf(origin) = LeafVoxels { values, active };
    }

    /// Like `set_leaf`, but sets a tile if all voxels are equal.
    pub(in crate::io) fn put_block(&mut self, origin: IVec3, voxels: (Vec<T>, [u64; WORDS])) {
        let leaf = LeafVoxels { values: voxels.0, active: voxels.1 };
        match leaf.constant() {
            Some((value, active)) => self.put_constant(origin, value, active),
            None => *self.leaf(origin) = leaf,
        }
    }

    /// The value and activity of all voxels of a leaf, if they are equal.
    pub(super) fn constant(values: &[T], active: &[u64; WORDS]) -> Option<(T, bool)> {
        let first = *values.first()?;
        let on = active[0] & 1 == 1;
        let word = if on { u64::MAX } else { 0 };
        let alike = active.iter().all(|&other| other == word)
            && values.iter().all(|&value| value.same_bits(first));
        alike.then_some((first, on))
    }

    /// Sets the leaf at `origin` to a tile. A tile that equals the background is skipped if nothing
    /// was set there before.
    pub(super) fn put_constant(&mut self, origin: IVec3, value: T, active: bool) {
        if active || !value.same_bits(self.background) {
            self.fill(IndexBox::cube(origin, EDGES[0]), value, active);
        }
    }

    /// Sets the leaf at `origin`, where nothing was set before, to bytes in the file's encoding,
    /// with the active mask first.
    pub(super) fn set_packed(&mut self, origin: IVec3, bytes: Box<[u8]>) {
        self.node(origin).packed = Some(bytes);
    }

    fn leaf(&mut self, index: IVec3) -> &mut LeafVoxels<T> {
        self.node(index).leaf()
    }

    /// The node of the leaf that contains a voxel.
    fn node(&mut self, index: IVec3) -> &mut Node<T> {
        let empty = Node::tile(self.background, false);
        let mut node = self.root.entry((index & !4095).to_array()).or_insert(empty);
        for level in [2, 1] {
            node = node.slot(slot_of(index, slots_log(level), EDGES[level - 1]));
        }
        node
    }

    /// Finishes the tree. Leaves and branches whose voxels are all equal, bit for bit, become
    /// tiles.
    pub fn finish(self) -> Tree<T> {
        self.finish_packed().0
    }

    /// Finishes the tree, in which packed leaves have no values. Also returns those leaves in their
    /// order.
    pub(super) fn finish_packed(self) -> (Tree<T>, Vec<Box<[u8]>>) {
        let shape = TreeShape { upper: slots_log(2), lower: slots_log(1), leaf: EDGES[0] };
        let mut topology = Topology {
            shape,
            background: self.background,
            root: Vec::new(),
            uppers: Vec::new(),
            lowers: Vec::new(),
            leaf_origins: Vec::new(),
            leaf_active: Vec::new(),
        };
        let mut leaves = AllLeaves { values: Vec::new(), packed: Vec::new() };
        for (origin, node) in self.root {
            let origin = IVec3::from_array(origin);
            let node = node.pruned(2);
            let (value, active) = node.tile;
            let content = match node.slots {
                Some(slots) => {
                    push_upper(&mut topology, &mut leaves, origin, node.tile, slots);
                    RootContent::Child(topology.uppers.len() - 1)
                }
                None if !active && value.same_bits(self.background) => continue,
                None => RootContent::Tile { value, active },
            };
            topology.root.push(RootSlot { origin, content });
        }
        (Tree::new(topology, leaves.values), leaves.packed)
    }
}

impl<T: Value> Node<T> {
    fn tile(value: T, active: bool) -> Self {
        Self { tile: (value, active), slots: None, leaf: None, packed: None }
    }

    /// The node in a slot of this branch; makes it a branch if it is none.
    fn slot(&mut self, slot: usize) -> &mut Self {
        let (value, active) = self.tile;
        let slots = self.slots.get_or_insert_default();
        slots.entry(slot).or_insert_with(|| Self::tile(value, active))
    }

    /// This leaf's voxels; makes it a leaf if it is none.
    fn leaf(&mut self) -> &mut LeafVoxels<T> {
        let (value, active) = self.tile;
        self.leaf.get_or_insert_with(|| {
            let active = [if active { u64::MAX } else { 0 }; WORDS];
            Box::new(LeafVoxels { values: vec![value; VOXELS], active })
        })
    }

    fn fill(&mut self, level: usize, origin: IVec3, bounds: &IndexBox, value: T, active: bool) {
        let cube = IndexBox::cube(origin, EDGES[level]);
        let Some(part) = cube.intersection(bounds) else { return };
        if part == cube {
            *self = Self::tile(value, active);
            return;
        }
        // The slots (in a leaf: voxels) that the box touches.
        let slot_log = if level == 0 { 0 } else { EDGES[level - 1] };
        let [low, high] = [part.min, part.max].map(|corner| (corner - origin) >> slot_log);
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let origin = origin + (IVec3::new(x, y, z) << slot_log);
                    if level == 0 {
                        let leaf = self.leaf();
                        let slot = slot_of(origin, EDGES[0], 0);
                        leaf.values[slot] = value;
                        mask::put(&mut leaf.active, slot, active);
                        continue;
                    }
                    let node = self.slot(slot_of(origin, slots_log(level), slot_log));
                    node.fill(level - 1, origin, bounds, value, active);
                }
            }
        }
    }

    /// The same node with all constant parts as tiles.
    fn pruned(mut self, level: usize) -> Self {
        if let Some((value, active)) = self.leaf.as_ref().and_then(|leaf| leaf.constant()) {
            return Self::tile(value, active);
        }
        let Some(slots) = self.slots.take() else { return self };
        let rest = self.tile;
        let slots: BTreeMap<usize, Self> = slots
            .into_iter()
            .map(|(slot, node)| (slot, node.pruned(level - 1)))
            .filter(|(_, node)| !node.is_tile_of(rest))
            .collect();
        let full = slots.len() == 1 << (3 * slots_log(level));
        match slots.values().next().map(|node| node.tile) {
            None => return self,
            Some(first) if full && slots.values().all(|node| node.is_tile_of(first)) => {
                return Self::tile(first.0, first.1);
            }
            Some(_) => {}
        }
        self.slots = Some(slots);
        self
    }

    fn is_tile(&self) -> bool {
        self.slots.is_none() && self.leaf.is_none() && self.packed.is_none()
    }

    fn is_tile_of(&self, (value, active): (T, bool)) -> bool {
        self.is_tile() && self.tile.0.same_bits(value) && self.tile.1 == active
    }
}

impl<T: Value> LeafVoxels<T> {
    /// The value and activity of all voxels, if they are equal.
    fn constant(&self) -> Option<(T, bool)> {
        TreeBuilder::constant(&self.values, &self.active)
    }
}

fn push_upper<T: Value>(
    topology: &mut Topology<T>,
    leaves: &mut AllLeaves<T>,
    origin: IVec3,
    rest: (T, bool),
    slots: BTreeMap<usize, Node<T>>,
) {
    let (log, slot_log) = (slots_log(2), EDGES[1]);
    let first_child = topology.lowers.len();
    let (branch, children) = split(origin, log, first_child, rest, slots);
    for (slot, node) in children {
        if let Some(slots) = node.slots {
            let origin = origin + slot_offset(slot, log, slot_log);
            push_lower(topology, leaves, origin, node.tile, slots);
        }
    }
    topology.uppers.push(branch);
}

fn push_lower<T: Value>(
    topology: &mut Topology<T>,
    leaves: &mut AllLeaves<T>,
    origin: IVec3,
    rest: (T, bool),
    slots: BTreeMap<usize, Node<T>>,
) {
    let (log, slot_log) = (slots_log(1), EDGES[0]);
    let first_child = topology.leaf_origins.len();
    let (branch, children) = split(origin, log, first_child, rest, slots);
    for (slot, node) in children {
        topology.leaf_origins.push(origin + slot_offset(slot, log, slot_log));
        if let Some(leaf) = node.leaf {
            topology.leaf_active.extend(leaf.active);
            leaves.values.extend(leaf.values);
        } else if let Some(bytes) = node.packed {
            topology.leaf_active.extend(mask::words(&bytes).take(WORDS));
            leaves.packed.push(bytes);
        }
    }
    topology.lowers.push(branch);
}

/// Builds a branch from its slots. Also returns its children, in the order of their slots.
fn split<T: Value>(
    origin: IVec3,
    log: u32,
    first_child: usize,
    (rest, rest_active): (T, bool),
    slots: BTreeMap<usize, Node<T>>,
) -> (Branch<T>, Vec<(usize, Node<T>)>) {
    let count = 1_usize << (3 * log);
    let mut children = vec![0; count / 64];
    let mut active = vec![if rest_active { u64::MAX } else { 0 }; count / 64];
    let mut tiles = Tiles::Uniform(rest);
    let mut nodes = Vec::new();
    for (slot, node) in slots {
        if node.is_tile() {
            let (value, on) = node.tile;
            mask::put(&mut active, slot, on);
            if let (Tiles::Uniform(_), false) = (&tiles, value.same_bits(rest)) {
                tiles = Tiles::Each(vec![rest; count]);
            }
            if let Tiles::Each(values) = &mut tiles {
                values[slot] = value;
            }
        } else {
            mask::put(&mut active, slot, false);
            mask::put(&mut children, slot, true);
            nodes.push((slot, node));
        }
    }
    let [children, active] = [children, active].map(SlotMask::from_words);
    (Branch { origin, children, active, tiles, first_child }, nodes)
}
