//! How fragments become nodes: all of them, or as few as a tolerance on transmittance allows.
//!
//! Greedy, as in Lokovic and Veach 2000, section 3.3: from the last node kept, the range of slopes
//! that pass within the tolerance of every point so far; where it gets empty, a node. Three
//! changes. The lines are lines of optical depth. A line starts where the one before ends, on a
//! value within the tolerance of the truth. And the bound holds between points too: they stand no
//! further apart than [`POINT_SPACING`] in optical depth. At an extremum inside a piece the second
//! derivative of the difference of the two exponentials is at most `POINT_SPACING` squared times
//! the difference times the ratio of the two transmittances, which is kept below 4, so the
//! difference exceeds its ends by some percent at most: [`FIT_SHARE`] takes that off the tolerance,
//! and as much again for the samples in slabs.
//!
//! And slabs err themselves: in one, optical depth is taken to be linear. Where extinction changes
//! from the slab before, by that change times an eighth of the slab's length at most if it changes
//! evenly. The fit leaves room for as much, down to [`LEAST_ROOM`], so that the tolerance holds
//! against the medium and not only against its slabs.

use super::fragments::Node;

/// Optical depth between points that a fit is held to, at most.
pub const POINT_SPACING: f32 = 0.25;
/// Share of the tolerance that holds at the points.
pub const FIT_SHARE: f32 = 0.82;
/// Share of the tolerance that is left to the fit however much slabs err.
pub const LEAST_ROOM: f32 = 0.25;
/// Error of a line through a parabola, as a share of how much its slope changes times its length.
pub const BEND: f32 = 0.125;
/// Lowest transmittance of a fit, as a share of the true one.
pub const LOWEST_SHARE: f32 = 0.25;
/// Share of the tolerance below which transmittance counts as zero: what follows is left out.
pub const DARK_SHARE: f32 = 0.1;
/// No slope is steeper.
pub const STEEPEST: f32 = f32::MAX;
/// Lengths and transmittances below this count as this where they divide.
pub const SMALLEST: f32 = 1e-30;

/// Turns fragments in order of depth into nodes, exactly or within a tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Fitter {
    /// Largest error of transmittance at the points; 0 keeps every fragment.
    tolerance: f32,
    /// Optical depth behind which nothing matters.
    dark: f32,
    /// The last node kept.
    anchor: Node,
    /// Slopes of optical depth over depth from there that pass all points since.
    slopes: [f32; 2],
    /// The last point, on the true function.
    last: Node,
    /// Extinction of the last fragment.
    extinction: f32,
    /// Optical depth by which the last fragment may err itself.
    bend: f32,
    /// Whether there was a fragment.
    begun: bool,
}

impl Fitter {
    /// For an error of at most `tolerance` in transmittance; 0 keeps every fragment.
    pub fn new(tolerance: f32) -> Self {
        let tolerance = tolerance * FIT_SHARE;
        let dark = -(tolerance * DARK_SHARE).max(SMALLEST).ln();
        let (anchor, slopes) = (Node::default(), [0.0, STEEPEST]);
        let (extinction, bend) = (0.0, 0.0);
        Self { tolerance, dark, anchor, slopes, last: anchor, extinction, bend, begun: false }
    }

    /// Adds a fragment from depth `front` to `back` (equal for a surface), not in front of the one
    /// before, and gives the nodes that this settles to `keep`.
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
            // Nothing between two fragments: optical depth stays.
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
            // Behind the dark none is needed, however thick the slab.
            let pieces = (optical_depth / POINT_SPACING).ceil();
            let mut i = 1.0;
            while i < pieces && end(i / pieces).optical_depth < self.dark {
                self.point(end(i / pieces), keep);
                i += 1.0;
            }
        }
        self.point(Node { depth: back, ..end(1.0) }, keep);
    }

    /// Gives the last node to `keep`.
    pub fn finish(&mut self, keep: &mut impl FnMut(Node)) {
        if self.begun && self.last != self.anchor {
            self.close(keep);
        }
    }

    /// Optical depth of all that was added.
    #[inline]
    pub fn optical_depth(&self) -> f32 {
        self.last.optical_depth
    }

    /// Whether what follows is too dark to matter to a fit.
    #[inline]
    pub fn is_dark(&self) -> bool {
        self.tolerance > 0.0 && self.last.optical_depth > self.dark
    }

    /// The line from the last node has to pass near `point`.
    #[inline]
    fn point(&mut self, point: Node, keep: &mut impl FnMut(Node)) {
        if self.tolerance == 0.0 {
            self.last = point;
            self.anchor = point;
            keep(point);
            return;
        }
        let through = (-point.optical_depth).exp();
        let room = (self.tolerance - self.bend * through).max(self.tolerance * LEAST_ROOM);
        let least = -(through + room).min(1.0).ln();
        let most = -(through - room).max(through * LOWEST_SHARE).max(SMALLEST).ln();
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
            // A surface too opaque to be part of a line.
            keep(point);
            self.anchor = point;
            self.slopes = [0.0, STEEPEST];
        }
        self.last = point;
    }

    /// Ends the line at the last point: through it if that is allowed, else as near as it may.
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

/// How many nodes of a raw list to keep so that the rest, replaced by one line to the last node,
/// changes transmittance by less than `truncation`: what is left out lies where transmittance minus
/// its final value is below it. (The hair paper prints an inequality that holds everywhere.)
pub fn truncated(nodes: &[Node], truncation: f32) -> usize {
    let Some(last) = nodes.last() else { return 0 };
    let end = (-last.optical_depth).exp();
    nodes.partition_point(|node| (-node.optical_depth).exp() - end >= truncation) + 1
}
