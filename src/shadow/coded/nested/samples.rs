//! The points that a fit approximates: a texel's opacity over depth at equal distances along the
//! curve.
//!
//! The nodes are read twice, four at a time: first each says behind which of the points it is the
//! last node, then each point is placed between that node and the next.

use glam::{Mat4, Vec4};

use crate::kernel::exponential::{INTEGERS, four_transmitted};
use crate::shadow::Node;

/// Number of points of a curve; a power of two.
pub const COUNT: usize = 64;
/// The points, and three more without weight, so that four from any point on can be read at once.
pub const PADDED: usize = COUNT + 4;
/// The weight that every point has in addition to the share of depth that it stands for. Points are
/// dense where opacity rises steeply, so this keeps the largest error small.
const POINT_WEIGHT: f32 = 1.0;
/// Lengths are raised to this before a division.
pub const SMALLEST: f32 = 1e-30;
/// Optical depth above which transmittance counts as zero.
const OPAQUE: f32 = 87.0;
/// Positions of the lanes of a vector.
pub const LANES: Vec4 = Vec4::new(0.0, 1.0, 2.0, 3.0);

/// Points of opacity over depth, by rising depth if the nodes rise; the first and the last are the
/// medium's ends.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Depths, as shares of the way from the ray's entry to its exit.
    pub depth: [f32; PADDED],
    /// Opacities, as shares of the ray's largest opacity.
    pub opacity: [f32; PADDED],
    /// Weights of squared errors; their sum is at most 1 + `POINT_WEIGHT`.
    pub weight: [f32; PADDED],
}

/// Largest opacity of a polyline of optical depth.
pub fn largest_opacity(nodes: &[Node]) -> f32 {
    nodes.last().map_or(0.0, |node| opacity(Vec4::splat(node.optical_depth)).x)
}

/// How far along a curve its nodes lie, in distances between two points. Distance is half depth and
/// half opacity, so that the whole length is known beforehand.
#[derive(Clone, Copy)]
struct Way {
    first: f32,
    per_depth: f32,
    per_opacity: f32,
}

impl Way {
    #[inline]
    fn to(self, depths: Vec4, optical_depths: Vec4) -> Vec4 {
        (depths - self.first) * self.per_depth + opacity(optical_depths) * self.per_opacity
    }

    /// For each of four ways the first point that is not in front of it.
    #[inline]
    fn points(ways: Vec4) -> [usize; 4] {
        let whole = between(ways + 0.5, (COUNT - 1) as f32) + INTEGERS;
        let [a, b, c, d] = whole.to_array();
        let low_bits = |x: f32| x.to_bits() as usize % COUNT;
        [low_bits(a), low_bits(b), low_bits(c), low_bits(d)]
    }
}

impl Samples {
    /// The points of a ray's `nodes`, whose optical depth rises; `largest` is the ray's largest
    /// opacity, above 0.
    pub fn new(nodes: &[Node], [enter, exit]: [f32; 2], largest: f32) -> Self {
        let mut samples =
            Self { depth: [0.0; PADDED], opacity: [0.0; PADDED], weight: [0.0; PADDED] };
        let twice;
        let nodes = match *nodes {
            [] => return samples,
            [node] => {
                twice = [node; 2];
                &twice[..]
            }
            _ => nodes,
        };
        let ends = [nodes[0].depth, nodes[nodes.len() - 1].depth];
        let half = 0.5 * (COUNT - 1) as f32;
        let way = Way {
            first: ends[0],
            per_depth: half / (ends[1] - ends[0]).max(SMALLEST),
            per_opacity: half / largest,
        };
        let per_largest = 1.0 / largest;
        let per_length = 1.0 / (exit - enter).max(SMALLEST);
        let before = nodes_before(nodes, way);
        let numbers: &[f32] = bytemuck::cast_slice(nodes);
        let last = nodes.len() - 2;
        let mut from = 0;
        for i in 0..COUNT / 4 {
            let i = 4 * i;
            let mut slab = |before: u32| {
                from = from.max(before);
                Vec4::from_slice(&numbers[2 * last.min(from as usize)..])
            };
            let slabs = [slab(before[i]), slab(before[i + 1]), slab(before[i + 2])];
            let slabs = Mat4::from_cols(slabs[0], slabs[1], slabs[2], slab(before[i + 3]));
            let slabs = slabs.transpose();
            let [front, back] = [slabs.x_axis, slabs.z_axis];
            let (a, b) = (between(slabs.y_axis, OPAQUE), between(slabs.w_axis, OPAQUE));
            let [start, end] = [way.to(front, a), way.to(back, b)];
            let part = (LANES + i as f32 - start) / (end - start).max(Vec4::splat(SMALLEST));
            let part = between(part, 1.0);
            let depth = (front + (back - front) * part - enter) * per_length;
            between(depth, 1.0).write_to_slice(&mut samples.depth[i..]);
            let opacity = opacity(a + (b - a) * part) * per_largest;
            between(opacity, 1.0).write_to_slice(&mut samples.opacity[i..]);
        }
        let [first, last] = ends.map(|depth| unit((depth - enter) * per_length));
        (samples.depth[0], samples.opacity[0]) = (first, 0.0);
        samples.depth[COUNT - 1..].fill(last.max(first));
        samples.opacity[COUNT - 1] = 1.0;
        samples.weigh();
        samples
    }

    /// Sets each point's weight by the depth halfway to its neighbours. A point within a jump
    /// stands for no depth.
    fn weigh(&mut self) {
        let half = 0.5 / (self.depth[COUNT - 1] - self.depth[0]).max(SMALLEST);
        let point = Vec4::splat(POINT_WEIGHT / COUNT as f32);
        let mut last = self.depth[0];
        for i in 0..COUNT / 4 {
            let i = 4 * i;
            let here = Vec4::from_slice(&self.depth[i..]);
            let before = Vec4::new(last, here.x, here.y, here.z);
            last = here.w;
            let shares = (Vec4::from_slice(&self.depth[i + 1..]) - before) * half;
            let outside = shares.cmpgt(Vec4::splat(1e-6));
            let weights = shares + Vec4::select(outside, point, Vec4::ZERO);
            weights.write_to_slice(&mut self.weight[i..]);
        }
    }
}

/// For each point the last node in front of it, or 0 if there is none between it and the point
/// before.
#[inline]
fn nodes_before(nodes: &[Node], way: Way) -> [u32; COUNT] {
    let mut before = [0; COUNT];
    let mut index = 0;
    let (fours, rest) = nodes.as_chunks::<4>();
    for [a, b, c, d] in fours {
        let depths = Vec4::new(a.depth, b.depth, c.depth, d.depth);
        let taus = Vec4::new(a.optical_depth, b.optical_depth, c.optical_depth, d.optical_depth);
        for point in Way::points(way.to(depths, taus)) {
            before[point] = index;
            index += 1;
        }
    }
    for node in rest {
        let ways = way.to(Vec4::splat(node.depth), Vec4::splat(node.optical_depth));
        before[Way::points(ways)[0]] = index;
        index += 1;
    }
    before
}

/// Opacities of four optical depths; 0 for NaN.
#[inline]
fn opacity(optical_depths: Vec4) -> Vec4 {
    let positive = optical_depths.cmpgt(Vec4::ZERO);
    1.0 - four_transmitted(Vec4::select(positive, optical_depths, Vec4::ZERO))
}

/// Numbers clamped to 0..`most`; 0 for NaN.
#[inline]
fn between(x: Vec4, most: f32) -> Vec4 {
    Vec4::select(x.cmpgt(Vec4::ZERO), x, Vec4::ZERO).min(Vec4::splat(most))
}

/// `x` clamped to 0..1; 0 for NaN.
pub fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}
