//! Transmittance from a list of fragments, which is kept as a polyline of optical depth over depth.
//!
//! A *node* is a depth and the optical depth from the light to there. Between two nodes optical
//! depth is linear, so transmittance is an exponential. Optical depth is zero in front of the first
//! node and constant behind the last. A slab of medium is two nodes, one of which it shares with a
//! slab that it touches; a surface is two nodes at the same depth.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use crate::math::Each;

/// Optical depth of an opaque surface: its transmittance is about the smallest normal f32.
pub const OPAQUE_OPTICAL_DEPTH: f32 = crate::frame::OPAQUE;

/// A point of the polyline.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// Depth along the texel's ray in units of the light's view
    /// ([`LightView::unit`](crate::scene::LightView::unit)), world lengths for scenes of ordinary
    /// size.
    pub depth: f32,
    /// Optical depth from the light to there.
    pub optical_depth: f32,
}

/// How many of `nodes`, in order of rising depth, have at most the depth `depth`.
#[inline]
pub fn nodes_before(nodes: &[Node], depth: f32) -> usize {
    nodes.partition_point(|node| node.depth <= depth)
}

/// Optical depth at `depth`, where `before` is the number of nodes that lie at or in front of it
/// ([`nodes_before`]).
#[inline]
pub fn optical_depth_between(nodes: &[Node], before: usize, depth: f32) -> f32 {
    match (before.checked_sub(1).and_then(|i| nodes.get(i)), nodes.get(before)) {
        (None, _) => 0.0,
        (Some(last), None) => last.optical_depth,
        (Some(a), Some(b)) => {
            // b is behind `depth`, and a is at or in front of it.
            let share = (depth - a.depth) / (b.depth - a.depth);
            a.optical_depth + (b.optical_depth - a.optical_depth) * share
        }
    }
}

/// A depth behind every node.
const FARTHEST: f32 = 1e30;

/// Optical depths at `depth` of four lists of nodes; the same as four calls of
/// [`optical_depth_between`], which share their divisions.
#[inline]
pub fn four_optical_depths(lists: [&[Node]; 4], depth: f32) -> Vec4 {
    let ends = lists.each(|nodes| ends_around(nodes, depth));
    let part = |of: fn(&[Node; 2]) -> f32| Vec4::from_array([0, 1, 2, 3].each(|i| of(&ends[i])));
    let (front, back) = (part(|[a, _]| a.depth), part(|[_, b]| b.depth));
    let (low, high) = (part(|[a, _]| a.optical_depth), part(|[_, b]| b.optical_depth));
    low + (high - low) * ((depth - front) / (back - front))
}

/// The last node at or in front of `depth`, and the next one. In front of the first node stands one
/// without optical depth, and behind the last one with the same.
#[inline]
fn ends_around(nodes: &[Node], depth: f32) -> [Node; 2] {
    // A search whose steps do not branch, as their outcomes cannot be predicted: the last node at
    // or in front of the depth, if there is one, stays among the `count` from `first` on.
    let (mut first, mut count) = (0, nodes.len());
    while count > 1 {
        let half = count / 2;
        let middle = first + half;
        first = if nodes[middle].depth <= depth { middle } else { first };
        count -= half;
    }
    let start = Node { depth: -FARTHEST, optical_depth: 0.0 };
    match nodes.get(first) {
        Some(&node) if node.depth > depth => [start, node],
        found => {
            let a = found.copied().unwrap_or(start);
            [a, nodes.get(first + 1).copied().unwrap_or(Node { depth: FARTHEST, ..a })]
        }
    }
}

/// Optical depth at which a shadow's front is taken to be.
pub const FRONT_DEPTH: f32 = 0.5;

/// Optical depth that a texel must reach for its shadow to have a front: nine tenths of the light
/// are gone.
pub const LEAST_WITH_FRONT: f32 = std::f32::consts::LN_10;

/// The depth where optical depth reaches [`FRONT_DEPTH`], or `None` if it stays below
/// [`LEAST_WITH_FRONT`].
#[inline]
pub fn front_of(nodes: &[Node]) -> Option<f32> {
    nodes.last().filter(|last| last.optical_depth >= LEAST_WITH_FRONT)?;
    let pairs = nodes.array_windows().map(|[a, b]| (a, b));
    let (a, b) = pairs.into_iter().find(|(_, b)| b.optical_depth >= FRONT_DEPTH)?;
    let share = (FRONT_DEPTH - a.optical_depth) / (b.optical_depth - a.optical_depth);
    Some(a.depth + (b.depth - a.depth) * share.clamp(0.0, 1.0))
}

/// Transmittance at `depth` where each fragment's shadow test is an exponential of the distance
/// from the fragment's front, with `sharpness` in 1 / world length. These are exponential shadow
/// maps (Annen et al. 2008), applied to one fragment after another as in "Real-time deep shadow
/// maps for hair", section "Spatial filtering".
pub fn exponential_transmittance(nodes: &[Node], before: usize, depth: f32, sharpness: f32) -> f32 {
    let Some(a) = before.checked_sub(1).and_then(|i| nodes.get(i)) else { return 1.0 };
    let passed = 1.0 - (-sharpness * (depth - a.depth)).exp();
    let at_a = (-a.optical_depth).exp();
    // `depth` lies just behind a surface at `a`.
    let surface = before.checked_sub(2).and_then(|i| nodes.get(i)).filter(|s| s.depth == a.depth);
    let from = surface.map_or(at_a, |s| (-s.optical_depth).exp());
    let to = nodes.get(before).map_or(at_a, |b| (-b.optical_depth).exp());
    from + (at_a - from) * passed + (to - at_a) * passed
}
