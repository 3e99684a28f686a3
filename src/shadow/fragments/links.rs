//! Links from each node to the depth-nearest nodes of the texels to the right and above, and
//! filters that follow them. (Real-time deep shadow maps for hair, "Neighbor Linking" and "Spatial
//! filtering".)

use super::lists::Runs;
use crate::kernel::fragments::Node;

/// The value of a missing link: the neighbour's list is empty, there is no such neighbour, or the
/// node's index does not fit sixteen bits.
pub const NO_LINK: u16 = u16::MAX;

/// The number of nodes that a walk from a link passes before a binary search takes over.
pub const MOST_WALKED: u32 = 8;

/// Links from a texel's `nodes` to those of a `neighbour`: calls `link` with the index of each node
/// and the index of the neighbour's node nearest in depth, of two equally near ones the one nearer
/// to the light. Both lists rise in depth, so one pass is enough.
pub fn nearest_nodes(nodes: &[Node], neighbour: &[Node], mut link: impl FnMut(usize, u16)) {
    let mut at = 0;
    for (i, node) in nodes.iter().enumerate() {
        while let (Some(here), Some(next)) = (neighbour.get(at), neighbour.get(at + 1)) {
            if (next.depth - node.depth).abs() >= (here.depth - node.depth).abs()
                && next.depth > node.depth
            {
                break;
            }
            at += 1;
        }
        let place = u16::try_from(at).unwrap_or(NO_LINK);
        link(i, if neighbour.is_empty() { NO_LINK } else { place });
    }
}

/// Links of all nodes of a square map: to the texel on the right (u) and to the texel above
/// (against v).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Links {
    /// For each node of the map: indices within the nodes of the right and of the upper texel.
    pub(super) links: Vec<[u16; 2]>,
}

impl Links {
    /// The links of a map with the nodes `runs`, in the order of those nodes.
    ///
    /// # Panics
    /// If `links` does not hold one entry for each node.
    pub fn new(runs: &Runs, links: Vec<[u16; 2]>) -> Self {
        assert_eq!(links.len(), runs.nodes().len(), "links of {} nodes", runs.nodes().len());
        Self { links }
    }

    /// For each node of the map: the index of the depth-nearest node within the right and within
    /// the upper texel's list, or [`NO_LINK`].
    pub fn links(&self) -> &[[u16; 2]] {
        &self.links
    }
}

/// A position in a texel's list during a walk from texel to texel: how many of its nodes lie in
/// front of the depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) texel: usize,
    pub(super) before: usize,
}

/// Moves from `from` to the neighbour `texel` through the link `direction` (0 right, 1 up) of the
/// last node in front of `depth`, then by a few nodes to the place of `depth`. Where the two lists
/// have little in common, a binary search finds it.
pub(super) fn step(
    runs: &Runs,
    links: &Links,
    from: Place,
    texel: usize,
    direction: usize,
    depth: f32,
) -> Place {
    let nodes = runs.of(texel);
    let own = runs.of(from.texel).len();
    let node = runs.starts()[from.texel] as usize + from.before.saturating_sub(1);
    let guess = if own > 0 { links.links[node][direction] } else { 0 };
    let mut before = usize::from(guess).min(nodes.len());
    for _ in 0..MOST_WALKED {
        if nodes.get(before).is_some_and(|node| node.depth <= depth) {
            before += 1;
        } else if before > 0 && nodes[before - 1].depth > depth {
            before -= 1;
        } else {
            return Place { texel, before };
        }
    }
    search(runs, texel, depth)
}

/// Finds the place of `depth` in a texel's list by a binary search.
pub(super) fn search(runs: &Runs, texel: usize, depth: f32) -> Place {
    Place { texel, before: crate::kernel::fragments::nodes_before(runs.of(texel), depth) }
}
