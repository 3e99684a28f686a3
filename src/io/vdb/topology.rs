//! A tree without the values of its leaves: what the file stores at a grid's `grid_pos`. It knows
//! nothing of leaf buffers.
//!
//! ```text
//! root ── table of 4096^3 entries: a tile (one value for all of it) or an upper branch
//!   upper branch ── 32^3 slots of 128^3 voxels: a tile or a lower branch
//!     lower branch ── 16^3 slots of 8^3 voxels: a tile or a leaf
//!       leaf ── 8^3 voxels
//! ```

use glam::IVec3;

use super::compression::Workspace;
use super::fault::{Fault, Parsed};
use super::grid_type::{TreeShape, slot_of, slot_offset};
use super::mask::{self, SlotMask};
use super::source::{Bytes, Reader};
use super::value::Value;
use super::value_block::{Encoding, ValueBlock, read_value};

/// A tree without its leaves' values. Nodes are in the order of the file, so the children of a
/// branch are adjacent.
#[derive(Clone)]
pub(super) struct Topology<T> {
    pub(super) shape: TreeShape,
    pub(super) background: T,
    /// Sorted by origin.
    pub(super) root: Vec<RootSlot<T>>,
    pub(super) uppers: Vec<Branch<T>>,
    pub(super) lowers: Vec<Branch<T>>,
    pub(super) leaf_origins: Vec<IVec3>,
    /// The active masks of all leaves, one after another.
    pub(super) leaf_active: Vec<u64>,
}

#[derive(Clone)]
pub(super) struct RootSlot<T> {
    pub(super) origin: IVec3,
    pub(super) content: RootContent<T>,
}

#[derive(Clone)]
pub(super) enum RootContent<T> {
    Tile {
        value: T,
        active: bool,
    },
    /// Index of the upper branch.
    Child(usize),
}

/// An inner node. Each slot is a child or a tile.
#[derive(Clone)]
pub(super) struct Branch<T> {
    pub(super) origin: IVec3,
    pub(super) children: SlotMask,
    pub(super) active: SlotMask,
    pub(super) tiles: Tiles<T>,
    /// Index of its first child among the nodes of the next lower level.
    pub(super) first_child: usize,
}

/// The values of a branch's tiles.
#[derive(Clone)]
pub(super) enum Tiles<T> {
    /// One value for all, as in nearly every branch.
    Uniform(T),
    /// One value per slot; those of children have no meaning.
    Each(Vec<T>),
}

impl<T: Copy> Tiles<T> {
    pub(super) fn get(&self, slot: usize) -> T {
        match self {
            Self::Uniform(value) => *value,
            Self::Each(values) => values[slot],
        }
    }
}

impl<T: Value> Branch<T> {
    /// Index of a slot's child among the nodes of the next lower level.
    pub(super) fn child(&self, slot: usize) -> Option<usize> {
        self.children.has(slot).then(|| self.first_child + self.children.rank(slot))
    }

    fn memory_bytes(&self) -> usize {
        let values = match &self.tiles {
            Tiles::Uniform(_) => 0,
            Tiles::Each(values) => size_of_val(values.as_slice()),
        };
        size_of::<Self>() + self.children.memory_bytes() + self.active.memory_bytes() + values
    }
}

impl<T: Value> Topology<T> {
    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        let branches = self.uppers.iter().chain(&self.lowers);
        size_of_val(self.root.as_slice())
            + branches.map(Branch::memory_bytes).sum::<usize>()
            + size_of_val(self.leaf_origins.as_slice())
            + size_of_val(self.leaf_active.as_slice())
    }

    /// The active mask of leaf `index`.
    pub(super) fn leaf_mask(&self, index: usize) -> &[u64] {
        let words = self.shape.leaf_words();
        &self.leaf_active[index * words..(index + 1) * words]
    }
}

/// Reads the number of buffers and the background, which are the first bytes of a topology.
pub(super) fn read_background<T: Value>(bytes: &mut Bytes) -> Parsed<T> {
    let at = bytes.position();
    let buffers = bytes.u32()?;
    if buffers != 1 {
        return Err(Fault::bad(at, format!("{buffers} buffers per tree; only 1 is supported")));
    }
    read_value(bytes)
}

/// Reads a whole topology. Sets the background of `encoding` to the one in the file, as the leaf
/// buffers need it.
pub(super) fn read<T: Value>(
    reader: &mut Reader,
    shape: TreeShape,
    encoding: &mut Encoding<T>,
) -> Parsed<Topology<T>> {
    encoding.background = reader.parse(read_background)?;
    let mut builder = Builder {
        topology: Topology {
            shape,
            background: encoding.background,
            root: Vec::new(),
            uppers: Vec::new(),
            lowers: Vec::new(),
            leaf_origins: Vec::new(),
            leaf_active: Vec::new(),
        },
        encoding: *encoding,
        workspace: Workspace::default(),
        packed: Vec::new(),
        values: Vec::new(),
    };
    let [tiles, children] = reader.parse(|bytes| bytes.each(Bytes::u32))?;
    for _ in 0..tiles {
        let slot = reader.parse(|bytes| {
            let origin = read_origin(bytes, shape)?;
            let value = read_value(bytes)?;
            let content = RootContent::Tile { value, active: bytes.u8()? != 0 };
            Ok(RootSlot { origin, content })
        })?;
        builder.topology.root.push(slot);
    }
    for _ in 0..children {
        let origin = reader.parse(|bytes| read_origin(bytes, shape))?;
        builder.read_upper(reader, origin)?;
    }
    let mut topology = builder.topology;
    let key = |slot: &RootSlot<T>| slot.origin.to_array();
    topology.root.sort_by_key(key);
    if let Some(pair) = topology.root.windows(2).find(|pair| pair[0].origin == pair[1].origin) {
        let why = format!("two root entries at {}", pair[0].origin);
        return Err(Fault::bad(reader.position(), why));
    }
    Ok(topology)
}

fn read_origin(bytes: &mut Bytes, shape: TreeShape) -> Parsed<IVec3> {
    let at = bytes.position();
    let origin = IVec3::from_array(bytes.each(Bytes::i32)?);
    let edge = 1 << shape.upper_log();
    // A multiple of the edge leaves room for the whole node below the largest index.
    if origin & (edge - 1) != IVec3::ZERO {
        return Err(Fault::bad(at, format!("a root entry at {origin}, not a multiple of {edge}")));
    }
    Ok(origin)
}

struct Builder<T> {
    topology: Topology<T>,
    encoding: Encoding<T>,
    workspace: Workspace,
    packed: Vec<T>,
    values: Vec<T>,
}

impl<T: Value> Builder<T> {
    fn read_upper(&mut self, reader: &mut Reader, origin: IVec3) -> Parsed<()> {
        let shape = self.topology.shape;
        let first_child = self.topology.lowers.len();
        let upper = self.read_branch(reader, origin, shape.upper, first_child)?;
        for slot in upper.children.slots() {
            let origin = origin + slot_offset(slot, shape.upper, shape.lower_log());
            self.read_lower(reader, origin)?;
        }
        let content = RootContent::Child(self.topology.uppers.len());
        self.topology.root.push(RootSlot { origin, content });
        self.topology.uppers.push(upper);
        Ok(())
    }

    fn read_lower(&mut self, reader: &mut Reader, origin: IVec3) -> Parsed<()> {
        let shape = self.topology.shape;
        let first_child = self.topology.leaf_origins.len();
        let lower = self.read_branch(reader, origin, shape.lower, first_child)?;
        let mask_bytes = lower.children.count() * shape.leaf_voxels() / 8;
        let topology = &mut self.topology;
        reader.parse(|bytes| {
            topology.leaf_active.extend(mask::words(bytes.take(mask_bytes)?));
            Ok(())
        })?;
        let offsets = lower.children.slots().map(|slot| slot_offset(slot, shape.lower, shape.leaf));
        topology.leaf_origins.extend(offsets.map(|offset| origin + offset));
        topology.lowers.push(lower);
        Ok(())
    }

    fn read_branch(
        &mut self,
        reader: &mut Reader,
        origin: IVec3,
        log: u32,
        first_child: usize,
    ) -> Parsed<Branch<T>> {
        let slots = 1_usize << (3 * log);
        reader.parse(|bytes| {
            let at = bytes.position();
            let children = SlotMask::from_bytes(bytes.take(slots / 8)?);
            let active = SlotMask::from_bytes(bytes.take(slots / 8)?);
            if !children.is_disjoint(&active) {
                return Err(Fault::bad(at, "a slot is both a child and an active tile"));
            }
            let block = ValueBlock::take(bytes, &self.encoding, slots, active.count())?;
            self.values.resize(slots, T::default());
            block.decode(
                &self.encoding,
                active.words(),
                &mut self.workspace,
                &mut self.packed,
                &mut self.values,
            )?;
            let tiles = self.compact(&children);
            Ok(Branch { origin, children, active, tiles, first_child })
        })
    }

    /// Combines the values that were just read into one if all tiles are equal.
    fn compact(&self, children: &SlotMask) -> Tiles<T> {
        let mut tiles = (0..self.values.len())
            .filter(|&slot| !children.has(slot))
            .map(|slot| self.values[slot]);
        let Some(first) = tiles.next() else { return Tiles::Uniform(self.encoding.background) };
        if tiles.all(|value| value.same_bits(first)) {
            Tiles::Uniform(first)
        } else {
            Tiles::Each(self.values.clone())
        }
    }
}

/// The slots of a voxel in an upper branch and in a lower one.
pub(super) fn branch_slots(shape: TreeShape, index: IVec3) -> [usize; 2] {
    [slot_of(index, shape.upper, shape.lower_log()), slot_of(index, shape.lower, shape.leaf_log())]
}
