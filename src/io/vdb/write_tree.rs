//! Encodes a tree as `topology` and `leaves` read it. Knows nothing of headers.

use glam::IVec3;

use super::grid_type::ValueType;
use super::mask::SlotMask;
use super::topology::{Branch, RootContent, Tiles, Topology};
use super::tree::{Leaf, Tree};
use super::value::Value;
use super::value_block::Encoding;
use super::write_block::{BlockWorkspace, put_block};
use crate::parallel;

/// Number of leaves that a thread encodes at a time, and of leaves whose bytes wait to be
/// assembled.
const LEAVES: usize = 64;
const BATCH: usize = 64 * LEAVES;

/// Appends everything except the leaves' values.
pub(super) fn put_topology<T: Value>(tree: &Tree<T>, encoding: &Encoding<T>, out: &mut Vec<u8>) {
    let topology = tree.topology();
    out.extend(1_u32.to_le_bytes());
    T::encode(&[topology.background], out);
    let tiles = topology.root.iter().filter_map(|slot| match slot.content {
        RootContent::Tile { value, active } => Some((slot.origin, value, active)),
        RootContent::Child(_) => None,
    });
    let tiles: Vec<_> = tiles.collect();
    for count in [tiles.len(), topology.uppers.len()] {
        out.extend((count as u32).to_le_bytes());
    }
    for (origin, value, active) in tiles {
        put_origin(origin, out);
        T::encode(&[value], out);
        out.push(u8::from(active));
    }
    let mut workspace = BlockWorkspace::default();
    for upper in &topology.uppers {
        put_origin(upper.origin, out);
        put_branch(upper, encoding, &mut workspace, out);
        let first = upper.first_child;
        for lower in &topology.lowers[first..first + upper.children.count()] {
            put_branch(lower, encoding, &mut workspace, out);
            put_leaf_masks(topology, lower, out);
        }
    }
}

fn put_origin(origin: IVec3, out: &mut Vec<u8>) {
    out.extend(origin.to_array().into_iter().flat_map(i32::to_le_bytes));
}

pub(super) fn put_words(words: &[u64], out: &mut Vec<u8>) {
    out.extend(words.iter().flat_map(|word| word.to_le_bytes()));
}

fn put_leaf_masks<T: Value>(topology: &Topology<T>, lower: &Branch<T>, out: &mut Vec<u8>) {
    for leaf in lower.first_child..lower.first_child + lower.children.count() {
        put_words(topology.leaf_mask(leaf), out);
    }
}

fn put_branch<T: Value>(
    branch: &Branch<T>,
    encoding: &Encoding<T>,
    workspace: &mut BlockWorkspace<T>,
    out: &mut Vec<u8>,
) {
    let words = |mask: &SlotMask| mask.words().to_vec();
    let (children, active) = (words(&branch.children), words(&branch.active));
    put_words(&children, out);
    put_words(&active, out);
    let uniform;
    let values = match &branch.tiles {
        Tiles::Each(values) => values,
        Tiles::Uniform(value) => {
            uniform = vec![*value; 64 * children.len()];
            &uniform
        }
    };
    put_block(values, &active, &children, encoding, workspace, out);
}

/// Passes on the encoded leaf buffers, piece by piece.
pub(super) fn put_leaves<T: Value>(
    tree: &Tree<T>,
    value_type: &ValueType,
    encoding: &Encoding<T>,
    mut put: impl FnMut(Vec<u8>),
) {
    let leaves: Vec<Leaf<T>> = tree.leaves().collect();
    for batch in leaves.chunks(BATCH) {
        let parts = parallel::map(batch.chunks(LEAVES), |leaves| {
            let (mut part, mut workspace) = (Vec::new(), BlockWorkspace::default());
            for leaf in leaves {
                put_leaf(leaf, value_type, encoding, &mut workspace, &mut part);
            }
            part
        });
        parts.into_iter().for_each(&mut put);
    }
}

fn put_leaf<T: Value>(
    leaf: &Leaf<T>,
    value_type: &ValueType,
    encoding: &Encoding<T>,
    workspace: &mut BlockWorkspace<T>,
    out: &mut Vec<u8>,
) {
    put_words(leaf.active, out);
    match value_type {
        ValueType::Mask => put_origin(leaf.origin, out),
        ValueType::Bool => {
            put_origin(leaf.origin, out);
            let mut bytes = Vec::new();
            T::encode(leaf.values, &mut bytes);
            out.extend(bytes.chunks(8).map(|values| {
                values.iter().enumerate().fold(0, |byte, (bit, value)| byte | value << bit)
            }));
        }
        _ => put_block(leaf.values, leaf.active, &[], encoding, workspace, out),
    }
}
