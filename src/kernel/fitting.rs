//! Turns fragments into nodes: keeps all of them, or as few as a tolerance on transmittance allows.
//!
//! The fit is greedy, as in Lokovic and Veach 2000, section 3.3: it keeps the range of slopes of
//! lines from the last kept node that pass within the tolerance of every point since, and keeps a
//! new node where that range becomes empty. Three things differ. The lines are lines of optical
//! depth. A line starts where the one before ends, at a value within the tolerance of the exact
//! one. And the bound also holds between points, because they stand no further apart than
//! [`POINT_SPACING`] in optical depth: at an extremum inside a piece the second derivative of the
//! difference of the two exponentials is at most `POINT_SPACING` squared times the difference times
//! the ratio of the two transmittances. That ratio is kept below 4, so the difference exceeds that
//! at the ends by some percent at most. [`FIT_SHARE`] takes those percent off the tolerance, and as
//! much again for the samples in slabs.
//!
//! Slabs have an error of their own, since optical depth is taken to be linear within each. Where
//! extinction changes evenly from the slab before, that error is at most the change times an eighth
//! of the slab's length. The fit leaves room for it, but keeps at least [`LEAST_ROOM`] of the
//! tolerance for itself, so that the tolerance holds against the medium and not only against its
//! slabs.

use super::exponential::transmitted;
use super::fragments::Node;

/// Largest difference of optical depth between the points that a fit must pass.
pub const POINT_SPACING: f32 = 0.25;
/// Share of the tolerance that is allowed at the points.
pub const FIT_SHARE: f32 = 0.82;
/// Share of the tolerance that is always left to the fit, however large the slabs' own error is.
pub const LEAST_ROOM: f32 = 0.25;
/// Error of a chord of a parabola, as a share of the change of slope times the length.
pub const BEND: f32 = 0.125;
/// Lowest transmittance that a fit may have, as a share of the exact one.
pub const LOWEST_SHARE: f32 = 0.25;
/// The optical depth by which transmittance falls to that share: ln 4.
pub const LOWEST_DEPTH: f32 = 2.0 * std::f32::consts::LN_2;
/// Transmittance below this share of the tolerance counts as zero, and later fragments are left
/// out.
pub const DARK_SHARE: f32 = 0.1;
/// The steepest slope of optical depth over depth.
pub const STEEPEST: f32 = f32::MAX;
/// Lengths and transmittances are raised to this before a division.
pub const SMALLEST: f32 = 1e-30;

/// Turns fragments in order of depth into nodes, exactly or within a tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Fitter {
    /// Largest error of transmittance at the points; 0 keeps every fragment.
    tolerance: f32,
    /// Optical depth beyond which nothing matters.
    dark: f32,
    /// The last node kept.
    anchor: Node,
    /// The range of slopes, optical depth over depth, of lines from the anchor that pass within the
    /// tolerance of all points since.
    slopes: [f32; 2],
    /// The last point, on the exact function.
    last: Node,
    /// Extinction of the last fragment.
    extinction: f32,
    /// The error in optical depth that the last fragment may have itself.
    bend: f32,
    /// Whether a fragment was added yet.
    begun: bool,
}

impl Fitter {
    /// A fitter whose result differs from the fragments' transmittance by at most `tolerance`; 0
    /// keeps every fragment.
    pub fn new(tolerance: f32) -> Self {
        let tolerance = tolerance * FIT_SHARE;
        let dark = -(tolerance * DARK_SHARE).max(SMALLEST).ln();
        let (anchor, slopes) = (Node::default(), [0.0, STEEPEST]);
        let (extinction, bend) = (0.0, 0.0);
        Self { tolerance, dark, anchor, slopes, last: anchor, extinction, bend, begun: false }
    }

    /// Adds a fragment from depth `front` to `back` (equal for a surface) in world lengths. It must
    /// not begin in front of the one before. Passes each node that becomes final to `keep`.
    #[inline]
    pub fn add(
        &mut self,
        [front, back]: [f32; 2],
        optical_depth: f32,
        keep: &mut impl FnMut(Node),
    ) {
        let start = Node { depth: front.max(self.last.depth), ..self.last };
        if !self.begun {
            self.begun = true;
            self.anchor = Node { depth: front, optical_depth: 0.0 };
            self.last = self.anchor;
            keep(self.anchor);
        } else if front > self.last.depth {
            // There is nothing between two fragments, so optical depth stays the same.
            self.point(start, keep);
            self.extinction = 0.0;
        }
        let start = self.last;
        let back = back.max(start.depth);
        let length = back - start.depth;
        let extinction = optical_depth / length.max(SMALLEST);
        self.bend = (extinction - self.extinction).abs() * length * BEND;
        self.extinction = extinction;
        let end = |share: f32| Node {
            depth: start.depth + (back - start.depth) * share,
            optical_depth: start.optical_depth + optical_depth * share,
        };
        if self.tolerance > 0.0 && back > start.depth {
            // Where nothing gets through no points are needed, however thick the slab.
            let pieces = (optical_depth / POINT_SPACING).ceil();
            let mut i = 1.0;
            while i < pieces && end(i / pieces).optical_depth < self.dark {
                self.point(end(i / pieces), keep);
                i += 1.0;
            }
        }
        self.point(Node { depth: back, ..end(1.0) }, keep);
    }

    /// Passes the last node to `keep`.
    pub fn finish(&mut self, keep: &mut impl FnMut(Node)) {
        if self.begun && self.last != self.anchor {
            self.close(keep);
        }
    }

    /// Optical depth of all fragments together.
    #[inline]
    pub fn optical_depth(&self) -> f32 {
        self.last.optical_depth
    }

    /// Whether so little light is left that later fragments do not matter to a fit.
    #[inline]
    pub fn is_dark(&self) -> bool {
        self.tolerance > 0.0 && self.last.optical_depth > self.dark
    }

    /// The range of optical depth in which a line may pass a point, within the tolerance of
    /// transmittance. With the tolerance as a share s of transmittance the exact range is -ln(1 +
    /// s) to -ln(1 - s) around the point. 2 s / (2 + s) and 2 s / (2 - s) are within it, close to
    /// it where s is small, and need no logarithm.
    #[inline]
    fn range(&self, optical_depth: f32) -> [f32; 2] {
        let through = transmitted(optical_depth);
        let room = (self.tolerance - self.bend * through).max(self.tolerance * LEAST_ROOM);
        let share = room / through;
        let below = 2.0 * share / (2.0 + share);
        let above = if share < 1.0 - LOWEST_SHARE {
            2.0 * share / (2.0 - share)
        } else {
            LOWEST_DEPTH
        };
        [(optical_depth - below).max(0.0), optical_depth + above]
    }

    /// Requires the line from the last kept node to pass near `point`.
    #[inline]
    fn point(&mut self, point: Node, keep: &mut impl FnMut(Node)) {
        if self.tolerance == 0.0 {
            self.last = point;
            self.anchor = point;
            keep(point);
            return;
        }
        let [least, most] = self.range(point.optical_depth);
        let narrowed = |anchor: Node, [low, high]: [f32; 2]| {
            let share = 1.0 / (point.depth - anchor.depth);
            let slope = |tau: f32| (tau - anchor.optical_depth) * share;
            [low.max(slope(least)), high.min(slope(most))]
        };
        if point.depth > self.anchor.depth {
            let slopes = narrowed(self.anchor, self.slopes);
            if slopes[0] <= slopes[1] {
                self.slopes = slopes;
                self.last = point;
                return;
            }
            self.close(keep);
        }
        if point.depth > self.anchor.depth {
            self.slopes = narrowed(self.anchor, [0.0, STEEPEST]);
        } else {
            // The surface is too opaque to be part of a line.
            keep(point);
            self.anchor = point;
            self.slopes = [0.0, STEEPEST];
        }
        self.last = point;
    }

    /// Ends the line at the last point: through it if the tolerance allows, else as near to it as
    /// possible.
    #[inline]
    fn close(&mut self, keep: &mut impl FnMut(Node)) {
        if self.tolerance == 0.0 {
            return;
        }
        let length = self.last.depth - self.anchor.depth;
        let true_slope =
            (self.last.optical_depth - self.anchor.optical_depth) / length.max(SMALLEST);
        let slope = true_slope.max(self.slopes[0]).min(self.slopes[1]);
        let optical_depth = self.anchor.optical_depth + slope * length;
        self.anchor = Node { depth: self.last.depth, optical_depth };
        self.slopes = [0.0, STEEPEST];
        keep(self.anchor);
    }
}

/// How many of a raw list's `nodes` to keep so that one line to the last node can replace the rest
/// and changes transmittance by less than `truncation`: the nodes left out lie where transmittance
/// minus its final value is below it. (The hair paper prints an inequality that always holds.)
pub fn truncated(nodes: &[Node], truncation: f32) -> usize {
    let Some(last) = nodes.last() else { return 0 };
    let end = (-last.optical_depth).exp();
    nodes.partition_point(|node| (-node.optical_depth).exp() - end >= truncation) + 1
}
