//! The leaf buffers, which the file stores at a grid's `block_pos` in the order of the topology's
//! leaves. They are read in batches, and all threads decode a batch. Knows nothing of what the
//! values are used for.

use super::compression::Workspace;
use super::fault::{Fault, Parsed};
use super::grid_type::{TreeShape, ValueType};
use super::mask;
use super::source::{Bytes, Reader};
use super::topology::Topology;
use super::value::Value;
use super::value_block::{Encoding, ValueBlock};
use crate::error::memory;
use crate::parallel;

/// Largest number of bytes of leaf buffers in memory, unless a single leaf has more.
const BATCH_BYTES: u64 = 4 << 20;
/// Leaves that a thread takes at once.
pub(super) const LEAVES: usize = 32;

/// The layout of a leaf buffer.
#[derive(Clone, Copy)]
enum Layout {
    /// Active mask and values.
    Values,
    /// Active mask, origin, and the values as a bit mask.
    Bits,
    /// Active mask and origin; a voxel is true where it is active.
    Mask,
}

/// How to read the leaf buffers of a grid.
pub(super) struct LeafFormat<T> {
    pub(super) shape: TreeShape,
    pub(super) encoding: Encoding<T>,
    layout: Layout,
}

enum Content<'a, T> {
    Block(ValueBlock<'a, T>),
    Bits(&'a [u8]),
    Mask,
}

/// A leaf as encoded in the file.
pub(super) struct PackedLeaf<'a, T> {
    mask: &'a [u8],
    content: Content<'a, T>,
}

/// Consecutive leaves.
struct Batch<'a, T> {
    leaves: Vec<PackedLeaf<'a, T>>,
    /// Number of bytes that they take.
    taken: usize,
    /// Offset at which the next leaf is incomplete, and the number of bytes that it needs from
    /// there.
    lacking: Option<(u64, u64)>,
}

/// Scratch memory of one thread for decoding leaves.
#[derive(Default)]
pub(super) struct LeafWorkspace<T> {
    bytes: Workspace,
    packed: Vec<T>,
}

impl<T: Value> LeafFormat<T> {
    pub(super) fn new(value_type: &ValueType, shape: TreeShape, encoding: Encoding<T>) -> Self {
        let layout = match value_type {
            ValueType::Bool => Layout::Bits,
            ValueType::Mask => Layout::Mask,
            _ => Layout::Values,
        };
        Self { shape, encoding, layout }
    }

    /// Rejects a topology with more leaves than the remaining bytes can hold, before memory for
    /// them is allocated.
    pub(super) fn check_room(&self, leaves: usize, reader: &Reader) -> Parsed<()> {
        let mask_bytes = self.shape.leaf_voxels() / 8;
        let least = match self.layout {
            Layout::Values => mask_bytes + 1,
            Layout::Bits => 2 * mask_bytes + 12,
            Layout::Mask => mask_bytes + 12,
        };
        let needed = least as u64 * leaves as u64;
        if needed > reader.left() {
            return Err(Fault::Short { at: reader.position(), needed });
        }
        Ok(())
    }

    fn take<'a>(&self, bytes: &mut Bytes<'a>) -> Parsed<PackedLeaf<'a, T>> {
        let voxels = self.shape.leaf_voxels();
        let mask = bytes.take(voxels / 8)?;
        let content = match self.layout {
            Layout::Values => {
                let active = mask::words(mask).map(u64::count_ones).sum::<u32>() as usize;
                Content::Block(ValueBlock::take(bytes, &self.encoding, voxels, active)?)
            }
            // The origin is known from the topology.
            Layout::Bits => {
                bytes.take(12)?;
                Content::Bits(bytes.take(voxels / 8)?)
            }
            Layout::Mask => {
                bytes.take(12)?;
                Content::Mask
            }
        };
        Ok(PackedLeaf { mask, content })
    }

    /// Calls `visit` for batches of all `count` leaves, with the number of leaves in front of each
    /// batch.
    pub(super) fn for_each_batch(
        &self,
        reader: &mut Reader,
        count: usize,
        mut visit: impl FnMut(usize, &[PackedLeaf<T>]) -> Parsed<()>,
    ) -> Parsed<()> {
        let mut done = 0;
        let mut wanted = BATCH_BYTES;
        while done < count {
            let (start, left) = (reader.position(), reader.left());
            let window = reader.look_ahead(wanted)?;
            let batch = self.take_batch(window, start, count - done)?;
            if let (true, Some((at, needed))) = (batch.leaves.is_empty(), batch.lacking) {
                let due = (at - start).saturating_add(needed);
                if due > left || window.len() as u64 == left {
                    return Err(Fault::Short { at, needed });
                }
                wanted = due.max(2 * wanted);
                continue;
            }
            visit(done, &batch.leaves)?;
            done += batch.leaves.len();
            let taken = batch.taken;
            reader.step(taken);
        }
        Ok(())
    }

    /// The leaves that are complete in the window, at most `limit`.
    fn take_batch<'a>(&self, window: &'a [u8], start: u64, limit: usize) -> Parsed<Batch<'a, T>> {
        let mut bytes = Bytes::new(window, start);
        let mut batch = Batch { leaves: Vec::new(), taken: 0, lacking: None };
        while batch.leaves.len() < limit {
            match self.take(&mut bytes) {
                Ok(leaf) => batch.leaves.push(leaf),
                Err(Fault::Short { at, needed }) => {
                    batch.lacking = Some((at, needed));
                    break;
                }
                Err(other) => return Err(other),
            }
            batch.taken = bytes.taken();
        }
        Ok(batch)
    }

    /// Decodes one leaf: its mask into `active`, its values into `values`.
    pub(super) fn decode(
        &self,
        leaf: &PackedLeaf<T>,
        workspace: &mut LeafWorkspace<T>,
        active: &mut [u64],
        values: &mut [T],
    ) -> Parsed<()> {
        for (word, stored) in active.iter_mut().zip(mask::words(leaf.mask)) {
            *word = stored;
        }
        let bits = match &leaf.content {
            Content::Block(block) => {
                let LeafWorkspace { bytes, packed } = workspace;
                return block.decode(&self.encoding, active, bytes, packed, values);
            }
            Content::Bits(bits) => bits,
            Content::Mask => leaf.mask,
        };
        // Both layouts have booleans only, whose values are single bytes.
        for (byte, values) in bits.iter().zip(values.chunks_exact_mut(8)) {
            let bytes: [u8; 8] = std::array::from_fn(|bit| byte >> bit & 1);
            T::decode(&bytes, values);
        }
        Ok(())
    }

    /// Decodes all leaves. Replaces the topology's masks by those of the buffers, and returns all
    /// values, leaf by leaf.
    pub(super) fn read_all(
        &self,
        reader: &mut Reader,
        topology: &mut Topology<T>,
    ) -> Parsed<Vec<T>> {
        let count = topology.leaf_origins.len();
        self.check_room(count, reader)?;
        let (voxels, words) = (self.shape.leaf_voxels(), self.shape.leaf_words());
        let mut values = memory::filled(count * voxels, T::default(), "voxels of leaves")?;
        let masks = &mut topology.leaf_active;
        self.for_each_batch(reader, count, |first, batch| {
            let range = first..first + batch.len();
            let values = &mut values[range.start * voxels..range.end * voxels];
            let masks = &mut masks[range.start * words..range.end * words];
            let parts = values
                .chunks_mut(voxels * LEAVES)
                .zip(masks.chunks_mut(words * LEAVES))
                .zip(batch.chunks(LEAVES));
            let decoded = parallel::map(parts, |((values, masks), leaves)| {
                let mut workspace = LeafWorkspace::default();
                let blocks = values.chunks_exact_mut(voxels).zip(masks.chunks_exact_mut(words));
                blocks.zip(leaves).try_for_each(|((values, active), leaf)| {
                    self.decode(leaf, &mut workspace, active, values)
                })
            });
            decoded.into_iter().collect()
        })?;
        Ok(values)
    }
}
