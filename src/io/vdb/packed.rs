//! Trees whose leaves are packed as soon as they arrive, for grids whose voxels come piece by piece
//! and are never in memory as a whole. Knows nothing of files.

use glam::IVec3;

use super::builder::TreeBuilder;
use super::compression::Compression;
use super::grid::Grid;
use super::grid_type::ValueType;
use super::tree::Tree;
use super::value::Value;
use super::value_block::Encoding;
use super::write_block::{BlockWorkspace, put_block};
use super::write_tree::put_words;
use crate::error::Result;
use crate::error::memory;
use crate::parallel;

/// Leaves that a thread takes at once.
const LEAVES: usize = 32;
/// Voxels of a leaf.
const VOXELS: usize = 512;

/// Scratch memory, which one thread reuses.
#[derive(Default)]
struct Scratch<T> {
    values: Vec<T>,
    workspace: BlockWorkspace<T>,
    bytes: Vec<u8>,
}

/// Builds a [`PackedTree`] from leaves that come in any order, each once.
pub struct PackedBuilder<T> {
    builder: TreeBuilder<T>,
    encoding: Encoding<T>,
    leaves: usize,
}

/// A tree with its leaves encoded as in the file, in the file's order.
pub struct PackedTree<T> {
    /// The tree without the leaves' values.
    pub(super) tree: Tree<T>,
    pub(super) encoding: Encoding<T>,
    pub(super) value_type: ValueType,
    pub(super) leaves: Vec<Box<[u8]>>,
}

impl<T: Value> PackedBuilder<T>
where
    Grid: From<Tree<T>>,
{
    /// A tree that holds only the background.
    pub fn new(background: T, compression: Compression) -> Self {
        let encoding = Encoding { compression, half: false, background };
        Self { builder: TreeBuilder::new(background), encoding, leaves: 0 }
    }

    /// Packs the leaves at `origins`, each the lowest of its voxels; those that are the same
    /// everywhere become tiles. `fill` puts a leaf's voxels, z fastest, and says which of them are
    /// active.
    pub fn add(&mut self, origins: &[IVec3], fill: impl Fn(IVec3, &mut [T]) -> [u64; 8] + Sync) {
        let encoding = &self.encoding;
        let packed = parallel::map(origins.chunks(LEAVES), |origins| {
            let mut scratch = Scratch::default();
            let mut packed = Vec::with_capacity(origins.len());
            for &origin in origins {
                let Scratch { values, workspace, bytes } = &mut scratch;
                values.resize(VOXELS, encoding.background);
                let active = fill(origin, values);
                let constant = TreeBuilder::constant(values, &active);
                bytes.clear();
                if constant.is_none() {
                    put_words(&active, bytes);
                    put_block(values, &active, &[], encoding, workspace, bytes);
                }
                packed.push((origin, constant, Box::from(bytes.as_slice())));
            }
            packed
        });
        for (origin, constant, bytes) in packed.into_iter().flatten() {
            match constant {
                Some((value, active)) => self.builder.put_constant(origin, value, active),
                None => {
                    self.builder.set_packed(origin, bytes);
                    self.leaves += 1;
                }
            }
        }
    }

    /// Finishes the tree.
    ///
    /// # Errors
    /// If there is not enough memory for the tree besides its leaves.
    pub fn finish(self) -> Result<PackedTree<T>> {
        // Origin, mask and position of each leaf.
        memory::check(256 * self.leaves as u64, "a tree")?;
        let (tree, leaves) = self.builder.finish_packed();
        let value_type = Grid::from(TreeBuilder::new(T::default()).finish()).value_type();
        Ok(PackedTree { tree, encoding: self.encoding, value_type, leaves })
    }
}

impl<T: Value> PackedTree<T> {
    /// Number of active voxels.
    pub fn active_voxel_count(&self) -> u64 {
        self.tree.active_voxel_count()
    }
}
