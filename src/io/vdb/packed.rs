//! Trees whose leaves are packed as soon as they are there: for grids whose voxels come piece by piece, and are
//! never in memory as a whole. It knows nothing of files.

use std::collections::HashMap;

use glam::IVec3;
use rayon::prelude::*;

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
use crate::memory;

/// The 8^3 voxels of a leaf, z fastest, and which of them are active.
pub type LeafVoxels<T> = (Vec<T>, [u64; 8]);

/// Makes a [`PackedTree`]: leaves come in any order, each once.
pub struct PackedBuilder<T> {
    builder: TreeBuilder<T>,
    encoding: Encoding<T>,
    leaves: HashMap<[i32; 3], Box<[u8]>>,
}

/// A tree with its leaves as the file has them, in its order.
pub struct PackedTree<T> {
    /// Without the leaves' values.
    pub(super) tree: Tree<T>,
    pub(super) encoding: Encoding<T>,
    pub(super) value_type: ValueType,
    pub(super) leaves: Vec<Box<[u8]>>,
}

impl<T: Value> PackedBuilder<T>
where
    Grid: From<Tree<T>>,
{
    /// Nothing but the background.
    pub fn new(background: T, compression: Compression) -> Self {
        let encoding = Encoding { compression, half: false, background };
        Self { builder: TreeBuilder::new(background), encoding, leaves: HashMap::new() }
    }

    /// Packs leaves, each at the lowest of its voxels; those that are the same everywhere become tiles.
    pub fn add(&mut self, leaves: Vec<(IVec3, LeafVoxels<T>)>) {
        let encoding = &self.encoding;
        let packed: Vec<_> = leaves
            .into_par_iter()
            .map_init(BlockWorkspace::default, |workspace, (origin, (values, active))| {
                let constant = TreeBuilder::constant(&values, &active);
                let mut bytes = Vec::new();
                if constant.is_none() {
                    put_words(&active, &mut bytes);
                    put_block(&values, &active, &[], encoding, workspace, &mut bytes);
                }
                (origin, constant, active, bytes.into_boxed_slice())
            })
            .collect();
        for (origin, constant, active, bytes) in packed {
            match constant {
                Some((value, active)) => self.builder.put_constant(origin, value, active),
                None => {
                    self.builder.set_leaf(origin, Vec::new(), active);
                    self.leaves.insert(origin.to_array(), bytes);
                }
            }
        }
    }

    /// The tree.
    ///
    /// # Errors
    /// If there is no memory for it beside what it is made of.
    pub fn finish(mut self) -> Result<PackedTree<T>> {
        // Origin, mask and place of each leaf.
        memory::check(256 * self.leaves.len() as u64, "a tree")?;
        let tree = self.builder.finish();
        let origins = tree.topology().leaf_origins.iter();
        let leaves = origins.filter_map(|origin| self.leaves.remove(&origin.to_array())).collect();
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
