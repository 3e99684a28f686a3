//! Lists of points of transmittance: the visibility functions of deep shadow maps (Lokovic and
//! Veach 2000).
//!
//! Theory. A function is a list of points (depth, transmittance) with lines between them: as few
//! points as keep it within a tolerance of the samples at every depth. The compression (section
//! 3.3) is greedy. It keeps the range of slopes of lines from the last kept point that pass within
//! the tolerance of every sample since; where the range becomes empty, it adds a point on the
//! middle slope.
//!
//! Changes. Between samples transmittance is an exponential and not a line. So a thick slab is cut
//! where a line would be off by more than [`CHORD_SHARE`] of the tolerance; the rest of the
//! tolerance is left to the samples, and the bound holds at every depth. A line never rises and
//! never leaves 0..1. The slope taken is that to the last sample itself where it is in the range,
//! which is closer to the exact function at the same size.

use bytemuck::{Pod, Zeroable};

use super::{Runs, Shadow, TexelMap};
use crate::frame::Frame;
use crate::kernel::fragments::Node;
use crate::scene::LightView;

/// Share of the tolerance that the lines between samples may use.
const CHORD_SHARE: f32 = 0.1;
/// The smallest tolerance; f32 cannot resolve a smaller one.
const LEAST_TOLERANCE: f32 = 1e-5;

/// A point of a visibility function: 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VisibilityPoint {
    /// Depth along the texel's ray in units of the light's view ([`LightView::unit`]).
    pub depth: f32,
    /// Transmittance from the light to there, 0..1.
    pub transmittance: f32,
}

/// Replaces the contents of `points` by a visibility function that is within `tolerance` of the
/// transmittance along `nodes` at every depth. Tolerances below 1e-5 count as 1e-5.
pub fn fit_visibility(nodes: &[Node], tolerance: f32, points: &mut Vec<VisibilityPoint>) {
    points.clear();
    let Some(first) = nodes.first() else { return };
    let tolerance = tolerance.max(LEAST_TOLERANCE);
    let anchor = VisibilityPoint { depth: first.depth, transmittance: 1.0 };
    let mut fit = Fit {
        tolerance: (1.0 - CHORD_SHARE) * tolerance,
        anchor,
        slopes: ALL,
        last: anchor,
        points,
    };
    fit.points.push(anchor);
    // Over an optical depth of h a chord is off by at most h^2 / 8 of the transmittance in front of
    // it.
    let thickness = (8.0 * CHORD_SHARE * tolerance).sqrt();
    for [a, b] in nodes.array_windows::<2>() {
        if b.depth > a.depth {
            let slope = (b.depth - a.depth) / (b.optical_depth - a.optical_depth);
            let mut inner = a.optical_depth + thickness * (0.5 * a.optical_depth).exp();
            while inner < b.optical_depth {
                let depth = a.depth + (inner - a.optical_depth) * slope;
                fit.sample(depth.min(b.depth), (-inner).exp());
                inner += thickness * (0.5 * inner).exp();
            }
        }
        fit.sample(b.depth, (-b.optical_depth).exp());
    }
    if fit.last != fit.anchor {
        fit.close();
    }
}

/// All slopes that do not rise.
const ALL: [f32; 2] = [f32::MIN, 0.0];

struct Fit<'a> {
    /// Largest error at the samples.
    tolerance: f32,
    /// The last point kept.
    anchor: VisibilityPoint,
    /// The range of slopes, transmittance over depth, of lines from the anchor that pass within the
    /// tolerance of all samples since.
    slopes: [f32; 2],
    /// The last sample.
    last: VisibilityPoint,
    points: &'a mut Vec<VisibilityPoint>,
}

impl Fit<'_> {
    /// Requires the line from the last kept point to pass near this sample.
    fn sample(&mut self, depth: f32, transmittance: f32) {
        let sample = VisibilityPoint { depth, transmittance };
        if depth > self.anchor.depth {
            let slopes = self.narrowed(sample);
            if slopes[0] <= slopes[1] {
                self.slopes = slopes;
                self.last = sample;
                return;
            }
            self.close();
        }
        if depth > self.anchor.depth {
            self.slopes = self.narrowed(sample);
        } else if (transmittance - self.anchor.transmittance).abs() > self.tolerance {
            // The surface is too opaque to be part of a line.
            self.points.push(sample);
            self.anchor = sample;
        }
        self.last = sample;
    }

    fn narrowed(&self, sample: VisibilityPoint) -> [f32; 2] {
        let length = sample.depth - self.anchor.depth;
        let slope = |through: f32| (through - self.anchor.transmittance) / length;
        let least = (sample.transmittance - self.tolerance).max(0.0);
        [
            self.slopes[0].max(slope(least)),
            self.slopes[1].min(slope(sample.transmittance + self.tolerance)),
        ]
    }

    /// Ends the line at the last sample, as near to it as the tolerance allows.
    fn close(&mut self) {
        let length = self.last.depth - self.anchor.depth;
        if length > 0.0 {
            let [least, most] = self.slopes;
            let slope = (self.last.transmittance - self.anchor.transmittance) / length;
            let slope = slope.min(most).max(least);
            let through = self.anchor.transmittance + slope * length;
            self.anchor =
                VisibilityPoint { depth: self.last.depth, transmittance: through.clamp(0.0, 1.0) };
            self.points.push(self.anchor);
        }
        self.slopes = ALL;
    }
}

/// Transmittance at `depth` of a visibility function: 1 in front of its first point, linear between
/// two points, and constant behind the last.
fn transmittance_at(points: &[VisibilityPoint], depth: f32) -> f32 {
    let before = points.partition_point(|point| point.depth <= depth);
    match (before.checked_sub(1).and_then(|i| points.get(i)), points.get(before)) {
        (None, _) => 1.0,
        (Some(last), None) => last.transmittance,
        (Some(a), Some(b)) => {
            let share = (depth - a.depth) / (b.depth - a.depth);
            a.transmittance + (b.transmittance - a.transmittance) * share
        }
    }
}

/// A map with one visibility function per texel.
#[derive(Clone, Debug)]
pub struct VisibilityMap {
    size: u32,
    points: Runs<VisibilityPoint>,
    tolerance: f32,
    view: LightView,
}

impl VisibilityMap {
    /// A map with the points `runs`, `frame.map.size` squared texels, row 0 at v = 0, built within
    /// `tolerance` from `view` for `frame`.
    ///
    /// # Panics
    /// If the number of texels is another one.
    pub fn new(
        points: Runs<VisibilityPoint>,
        tolerance: f32,
        view: LightView,
        frame: &Frame,
    ) -> Self {
        let size = frame.map.size;
        assert_eq!(points.texels(), size as usize * size as usize, "texels of a {size}^2 map");
        Self { size, points, tolerance: tolerance.max(LEAST_TOLERANCE), view }
    }

    /// The points of a texel, by rising depth.
    pub fn points(&self, x: u32, y: u32) -> &[VisibilityPoint] {
        self.points.of(y as usize * self.size as usize + x as usize)
    }

    /// Largest error of transmittance that leaving out points may have caused.
    pub fn tolerance(&self) -> f32 {
        self.tolerance
    }

    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        &self.view
    }
}

impl Shadow for VisibilityMap {
    /// Bytes of the points and of the index of each texel's first one.
    fn bytes(&self) -> u64 {
        self.points.bytes()
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for VisibilityMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        transmittance_at(self.points(x, y), depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest difference from the nodes' own transmittance at many depths, and the number of
    /// points.
    fn fitted(nodes: &[Node], tolerance: f32) -> (f32, usize) {
        use crate::kernel::fragments::{nodes_before, optical_depth_between};
        let mut points = Vec::new();
        fit_visibility(nodes, tolerance, &mut points);
        let mut worst = 0.0_f32;
        for i in 0..=4000_u16 {
            let depth = f32::from(i) / 1000.0;
            let exact = (-optical_depth_between(nodes, nodes_before(nodes, depth), depth)).exp();
            worst = worst.max((transmittance_at(&points, depth) - exact).abs());
        }
        (worst, points.len())
    }

    fn node(depth: f32, optical_depth: f32) -> Node {
        Node { depth, optical_depth }
    }

    #[test]
    fn an_empty_ray_has_no_points_and_lets_all_light_through() {
        let mut points = vec![VisibilityPoint::default()];
        fit_visibility(&[], 0.01, &mut points);
        assert!(points.is_empty());
        assert_eq!(transmittance_at(&points, 1.0), 1.0);
    }

    #[test]
    fn the_tolerance_holds_at_every_depth() {
        let fog: Vec<Node> = (0..=300_u16)
            .map(|i| node(f32::from(i) * 0.01, (f32::from(i) * 0.02).powi(2)))
            .collect();
        let rays: [&[Node]; 5] = [
            &[node(1.0, 0.0), node(3.0, 3.0)],
            &[node(1.0, 0.0), node(3.0, 87.0)],
            &[node(1.0, 0.0), node(1.0, 0.7), node(2.0, 0.7), node(2.0, 87.0)],
            &[node(1.0, 0.0), node(1.0, 0.004), node(1.5, 0.02), node(1.5, 0.3), node(2.5, 1.3)],
            &fog,
        ];
        for nodes in rays {
            let mut before = usize::MAX;
            for tolerance in [0.0, 0.0003, 0.002, 0.01, 0.1] {
                let (worst, count) = fitted(nodes, tolerance);
                // Rounding to f32 adds to the tolerance.
                assert!(worst <= tolerance.max(LEAST_TOLERANCE) + 2e-6, "{worst} at {tolerance}");
                assert!(
                    count <= before,
                    "{count} points at {tolerance}, {before} at a smaller one"
                );
                before = count;
            }
        }
    }

    #[test]
    fn two_surfaces_are_two_steps() {
        let nodes = [node(1.0, 0.0), node(1.0, 0.7), node(2.0, 0.7), node(2.0, 1.4)];
        let mut points = Vec::new();
        fit_visibility(&nodes, 0.01, &mut points);
        assert_eq!(points.len(), 4, "{points:?}");
        assert_eq!(transmittance_at(&points, 0.999), 1.0);
        assert!((transmittance_at(&points, 1.001) - (-0.7_f32).exp()).abs() < 1e-6);
        assert!((transmittance_at(&points, 9.0) - (-1.4_f32).exp()).abs() < 1e-6);
    }
}
