//! The points that a fit approximates: a texel's opacity over depth at equal distances along the
//! curve.

use crate::shadow::Node;

/// Number of points of a curve.
pub const COUNT: usize = 64;
/// The weight that every point has in addition to the share of depth that it stands for. Points are
/// dense where opacity rises steeply, so this keeps the largest error small.
const POINT_WEIGHT: f32 = 1.0;
/// Lengths are raised to this before a division.
const SMALLEST: f32 = 1e-30;
/// Optical depth above which transmittance counts as zero.
const OPAQUE: f32 = 87.0;

/// Points of opacity over depth, by rising depth; the first and the last are the medium's ends.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Depths, as shares of the way from the ray's entry to its exit.
    pub depth: [f32; COUNT],
    /// Opacities, as shares of the ray's largest opacity.
    pub opacity: [f32; COUNT],
    /// Weights of squared errors; their sum is at most 1 + `POINT_WEIGHT`.
    pub weight: [f32; COUNT],
}

/// Largest opacity of a polyline of optical depth.
pub fn largest_opacity(nodes: &[Node]) -> f32 {
    nodes.last().map_or(0.0, |node| 1.0 - (-capped(node.optical_depth)).exp())
}

impl Samples {
    /// The points of a ray's `nodes`, whose optical depth rises; `largest` is the ray's largest
    /// opacity, above 0.
    ///
    /// Distance along the curve is half depth and half opacity. So the whole length is known
    /// beforehand, and one pass over the nodes is enough.
    pub fn new(nodes: &[Node], [enter, exit]: [f32; 2], largest: f32) -> Self {
        let share = |depth: f32| unit((depth - enter) / (exit - enter).max(SMALLEST));
        let [first, last] =
            [nodes.first(), nodes.last()].map(|node| node.map_or(0.0, |node| share(node.depth)));
        let last = last.max(first);
        let mut samples =
            Self { depth: [last; COUNT], opacity: [1.0; COUNT], weight: [0.0; COUNT] };
        samples.depth[0] = first;
        samples.opacity[0] = 0.0;
        let per_depth = 0.5 / (last - first).max(SMALLEST);
        let per_opacity = 0.5 / largest;
        let spacing = 1.0 / (COUNT - 1) as f32;
        let (mut count, mut way) = (1, 0.0);
        let mut front = (first, 0.0, 1.0);
        for node in nodes {
            let tau = capped(node.optical_depth);
            let back = (share(node.depth), tau, (-tau).exp());
            let step = (back.0 - front.0) * per_depth + (front.2 - back.2) * per_opacity;
            let step = step.max(0.0);
            while count < COUNT - 1 && count as f32 * spacing <= way + step {
                let part = unit((count as f32 * spacing - way) / step.max(SMALLEST));
                let tau = front.1 + (back.1 - front.1) * part;
                let depth = front.0 + (back.0 - front.0) * part;
                let opacity = (1.0 - (-tau).exp()) / largest;
                // Points rise, whatever the nodes are.
                samples.depth[count] = depth.max(samples.depth[count - 1]).min(last);
                samples.opacity[count] = opacity.max(samples.opacity[count - 1]).min(1.0);
                count += 1;
            }
            way += step;
            front = back;
        }
        samples.weigh();
        samples
    }

    /// Sets each point's weight by the depth halfway to its neighbours. A point within a jump
    /// stands for no depth.
    fn weigh(&mut self) {
        let length = (self.depth[COUNT - 1] - self.depth[0]).max(SMALLEST);
        for i in 0..COUNT {
            let [before, after] = [self.depth[i.max(1) - 1], self.depth[(i + 1).min(COUNT - 1)]];
            let share = 0.5 * (after - before) / length;
            let point = if share > 1e-6 { POINT_WEIGHT / COUNT as f32 } else { 0.0 };
            self.weight[i] = share + point;
        }
    }
}

/// `x` clamped to 0..1; 0 for NaN.
pub fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// An optical depth clamped to a finite range; 0 for NaN.
fn capped(optical_depth: f32) -> f32 {
    if optical_depth > 0.0 { optical_depth.min(OPAQUE) } else { 0.0 }
}
