//! Transmittance from a list of fragments: optical depth as a polyline over depth, and how it is
//! read.
//!
//! A *node* is (depth, optical depth up to there). Between two nodes optical depth is linear, so
//! that transmittance is an exponential; in front of the first it is zero and behind the last it
//! stays. A slab of medium is two nodes (one where slabs touch), a surface is two nodes of one
//! depth.

use bytemuck::{Pod, Zeroable};

/// Optical depth of an opaque surface; its transmittance is the smallest normal f32.
pub const OPAQUE_OPTICAL_DEPTH: f32 = 87.0;

/// A point of the polyline.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// Depth along the texel's ray in world lengths.
    pub depth: f32,
    /// Optical depth from the light to there.
    pub optical_depth: f32,
}

/// How many of `nodes` (by rising depth) lie at or in front of `depth`.
#[inline]
pub fn nodes_before(nodes: &[Node], depth: f32) -> usize {
    nodes.partition_point(|node| node.depth <= depth)
}

/// Optical depth at `depth`, where `before` nodes lie at or in front of it.
#[inline]
pub fn optical_depth_between(nodes: &[Node], before: usize, depth: f32) -> f32 {
    match (before.checked_sub(1).and_then(|i| nodes.get(i)), nodes.get(before)) {
        (None, _) => 0.0,
        (Some(last), None) => last.optical_depth,
        (Some(a), Some(b)) => {
            // b is deeper than `depth`, which is at least as deep as a.
            let share = (depth - a.depth) / (b.depth - a.depth);
            a.optical_depth + (b.optical_depth - a.optical_depth) * share
        }
    }
}

/// Optical depth where a shadow's front is taken to be.
pub const FRONT_DEPTH: f32 = 0.5;

/// Optical depth that a texel needs for its shadow to have a front: nine tenths of the light.
pub const LEAST_WITH_FRONT: f32 = std::f32::consts::LN_10;

/// Depth where optical depth reaches [`FRONT_DEPTH`]; `None` where it stays below
/// [`LEAST_WITH_FRONT`].
#[inline]
pub fn front_of(nodes: &[Node]) -> Option<f32> {
    nodes.last().filter(|last| last.optical_depth >= LEAST_WITH_FRONT)?;
    let pairs = nodes.array_windows().map(|[a, b]| (a, b));
    let (a, b) = pairs.into_iter().find(|(_, b)| b.optical_depth >= FRONT_DEPTH)?;
    let share = (FRONT_DEPTH - a.optical_depth) / (b.optical_depth - a.optical_depth);
    Some(a.depth + (b.depth - a.depth) * share.clamp(0.0, 1.0))
}

/// Transmittance at `depth` with each fragment's shadow test an exponential of the way from its
/// front, `sharpness` in 1 / world length (exponential shadow maps, Annen et al. 2008, on each
/// fragment in turn: real-time deep shadow maps for hair, "Spatial filtering").
pub fn exponential_transmittance(nodes: &[Node], before: usize, depth: f32, sharpness: f32) -> f32 {
    let Some(a) = before.checked_sub(1).and_then(|i| nodes.get(i)) else { return 1.0 };
    let passed = 1.0 - (-sharpness * (depth - a.depth)).exp();
    let at_a = (-a.optical_depth).exp();
    // A surface at `a` that has only just been passed.
    let surface = before.checked_sub(2).and_then(|i| nodes.get(i)).filter(|s| s.depth == a.depth);
    let from = surface.map_or(at_a, |s| (-s.optical_depth).exp());
    let to = nodes.get(before).map_or(at_a, |b| (-b.optical_depth).exp());
    from + (at_a - from) * passed + (to - at_a) * passed
}
