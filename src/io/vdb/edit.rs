//! Trees derived from other trees: other values, fewer voxels, constant regions as tiles. Knows
//! nothing of files.

use glam::IVec3;

use super::builder::TreeBuilder;
use super::grid_type::{TreeShape, slot_offset};
use super::index_box::IndexBox;
use super::mask;
use super::topology::{Branch, RootContent, RootSlot, Tiles, Topology};
use super::tree::{Leaf, Tree};
use super::value::Value;

/// The box of all possible voxels.
pub const EVERYWHERE: IndexBox = IndexBox { min: IVec3::MIN, max: IVec3::MAX };

impl<T: Value> Tree<T> {
    /// The same tree with every value converted by `convert`; active voxels stay active.
    #[must_use]
    pub fn map<U: Value>(self, convert: impl Fn(T) -> U) -> Tree<U> {
        let (topology, values) = self.into_parts();
        let branches = |branches: Vec<Branch<T>>| -> Vec<Branch<U>> {
            let branches = branches.into_iter().map(|branch| Branch {
                origin: branch.origin,
                children: branch.children,
                active: branch.active,
                tiles: match branch.tiles {
                    Tiles::Uniform(value) => Tiles::Uniform(convert(value)),
                    Tiles::Each(values) => Tiles::Each(values.into_iter().map(&convert).collect()),
                },
                first_child: branch.first_child,
            });
            branches.collect()
        };
        let root = topology.root.into_iter().map(|slot| RootSlot {
            origin: slot.origin,
            content: match slot.content {
                RootContent::Tile { value, active } => {
                    RootContent::Tile { value: convert(value), active }
                }
                RootContent::Child(upper) => RootContent::Child(upper),
            },
        });
        let topology = Topology {
            shape: topology.shape,
            background: convert(topology.background),
            root: root.collect(),
            uppers: branches(topology.uppers),
            lowers: branches(topology.lowers),
            leaf_origins: topology.leaf_origins,
            leaf_active: topology.leaf_active,
        };
        Tree::new(topology, values.into_iter().map(&convert).collect())
    }

    /// The voxels of `bounds`, each with its value and activity changed by `change`; all others
    /// become inactive and get the background's value. Constant regions become tiles.
    #[must_use]
    pub fn rebuilt(&self, bounds: IndexBox, change: &dyn Fn(T, bool) -> (T, bool)) -> Self {
        let background = self.background();
        let mut builder = TreeBuilder::new(background);
        for tile in self.tiles() {
            if let Some(part) = tile.bounds().intersection(&bounds) {
                let (value, active) = change(tile.value, tile.active);
                builder.fill(part, value, active);
            }
        }
        for leaf in self.leaves() {
            let cube = leaf.bounds();
            let Some(part) = cube.intersection(&bounds) else { continue };
            let voxel = |slot: usize| change(leaf.values[slot], mask::is_set(leaf.active, slot));
            if leaf.log_edge == 3 {
                let mut values = vec![background; leaf.values.len()];
                let mut active = [0; 8];
                for (slot, value) in values.iter_mut().enumerate() {
                    if part == cube || part.contains(leaf.origin + slot_offset(slot, 3, 0)) {
                        let (changed, on) = voxel(slot);
                        *value = changed;
                        mask::put(&mut active, slot, on);
                    }
                }
                builder.set_leaf(leaf.origin, values, active);
                continue;
            }
            for slot in 0..leaf.values.len() {
                let index = leaf.origin + slot_offset(slot, leaf.log_edge, 0);
                if part.contains(index) {
                    let (value, active) = voxel(slot);
                    builder.set(index, value, active);
                }
            }
        }
        builder.finish()
    }

    /// The same voxels in the tree shape that every program reads, with constant regions as tiles.
    #[must_use]
    pub fn pruned(self) -> Self {
        let shape = TreeShape { upper: 5, lower: 4, leaf: 3 };
        let topology = self.topology();
        let constant = |leaf: Leaf<T>| {
            let alike = |word: u64| leaf.active.iter().all(|&other| other == word);
            let first = leaf.values.first();
            (alike(0) || alike(u64::MAX))
                && first.is_some_and(|first| leaf.values.iter().all(|v| v.same_bits(*first)))
        };
        let lean = |branch: &Branch<T>| {
            let uniform = matches!(branch.tiles, Tiles::Uniform(_));
            let active = branch.active.count();
            let slots = branch.active.words().len() * 64;
            branch.children.count() > 0 || !uniform || (active != 0 && active != slots)
        };
        let is_pruned = topology.shape == shape
            && topology.uppers.iter().chain(&topology.lowers).all(lean)
            && !self.leaves().any(constant);
        if is_pruned { self } else { self.rebuilt(EVERYWHERE, &|value, active| (value, active)) }
    }
}
