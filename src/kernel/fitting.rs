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

use glam::{Vec4, Vec4Swizzles};

use super::exponential::four_transmitted;
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

    /// Adds a slab from depth `front` to `back` in world lengths. It must not begin in front of the
    /// fragment before. Passes each node that becomes final to `keep`.
    #[inline]
    pub fn add(&mut self, bounds: [f32; 2], optical_depth: f32, keep: &mut impl FnMut(Node)) {
        self.add_fragment(bounds, optical_depth, true, keep);
    }

    /// [`Fitter::add`] for what a surface leaves, which is linear between its depths.
    #[inline]
    pub fn add_surface(
        &mut self,
        bounds: [f32; 2],
        optical_depth: f32,
        keep: &mut impl FnMut(Node),
    ) {
        self.add_fragment(bounds, optical_depth, false, keep);
    }

    #[inline]
    fn add_fragment(
        &mut self,
        [front, back]: [f32; 2],
        optical_depth: f32,
        of_medium: bool,
        keep: &mut impl FnMut(Node),
    ) {
        self.approach(front, keep);
        let start = self.last;
        let back = back.max(start.depth);
        let length = back - start.depth;
        self.bend = 0.0;
        if length > 0.0 && of_medium {
            let extinction = optical_depth / length.max(SMALLEST);
            self.bend = (extinction - self.extinction).abs() * length * BEND;
            self.extinction = extinction;
        }
        let end = |share: f32| Node {
            depth: start.depth + (back - start.depth) * share,
            optical_depth: start.optical_depth + optical_depth * share,
        };
        if optical_depth > POINT_SPACING && self.tolerance > 0.0 && back > start.depth {
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

    /// Adds four slabs, each of which begins where the one before ends; slabs without optical depth
    /// are left out. The result is that of four calls of [`Fitter::add`], which end where nothing
    /// later matters ([`Fitter::is_dark`]).
    #[inline]
    pub fn add_four(
        &mut self,
        [fronts, backs]: [Vec4; 2],
        optical_depths: Vec4,
        keep: &mut impl FnMut(Node),
    ) {
        let joined = fronts.x >= self.last.depth
            && fronts.yzw() == backs.xyz()
            && fronts.cmplt(backs).all()
            && optical_depths.cmpgt(Vec4::ZERO).all();
        if joined && self.tolerance == 0.0 {
            self.approach(fronts.x, keep);
            for k in 0..4 {
                let optical_depth = self.last.optical_depth + optical_depths[k];
                self.last = Node { depth: backs[k], optical_depth };
                keep(self.last);
            }
            self.anchor = self.last;
            return;
        }
        let ordinary = joined
            && self.tolerance > 0.0
            && optical_depths.cmple(Vec4::splat(POINT_SPACING)).all();
        if !ordinary {
            for k in 0..4 {
                if optical_depths[k] > 0.0 {
                    self.add([fronts[k], backs[k]], optical_depths[k], keep);
                    if self.is_dark() {
                        return;
                    }
                }
            }
            return;
        }
        self.approach(fronts.x, keep);
        let lengths = backs - fronts;
        let extinctions = optical_depths / lengths.max(Vec4::splat(SMALLEST));
        let before = Vec4::new(self.extinction, extinctions.x, extinctions.y, extinctions.z);
        let bends = (extinctions - before).abs() * lengths * BEND;
        (self.extinction, self.bend) = (extinctions.w, bends.w);
        let first = self.last.optical_depth + optical_depths.x;
        let second = first + optical_depths.y;
        let third = second + optical_depths.z;
        let taus = Vec4::new(first, second, third, third + optical_depths.w);
        let [least, most] = self.four_ranges(taus, bends);
        for k in 0..4 {
            self.place(Node { depth: backs[k], optical_depth: taus[k] }, [least[k], most[k]], keep);
            if self.is_dark() {
                return;
            }
        }
    }

    /// Goes on to depth `front`, where the next fragment begins.
    #[inline]
    fn approach(&mut self, front: f32, keep: &mut impl FnMut(Node)) {
        if !self.begun {
            self.begun = true;
            self.anchor = Node { depth: front, optical_depth: 0.0 };
            self.last = self.anchor;
            keep(self.anchor);
        } else if front > self.last.depth {
            // There is nothing between two fragments, so optical depth stays the same.
            self.point(Node { depth: front, ..self.last }, keep);
            self.extinction = 0.0;
        }
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

    /// [`Fitter::four_ranges`] at one point, for the last fragment.
    #[inline]
    fn range(&self, optical_depth: f32) -> [f32; 2] {
        let [least, most] = self.four_ranges(Vec4::splat(optical_depth), Vec4::splat(self.bend));
        [least.x, most.x]
    }

    /// The ranges of optical depth in which a line may pass four points, within the tolerance of
    /// transmittance; `bends` are the errors of their fragments. With the tolerance as a share s of
    /// transmittance the exact range is -ln(1 + s) to -ln(1 - s) around a point. 2 s / (2 + s) and 2
    /// s / (2 - s) are within it, close to it where s is small, and need no logarithm.
    #[inline]
    fn four_ranges(&self, optical_depths: Vec4, bends: Vec4) -> [Vec4; 2] {
        let through = four_transmitted(optical_depths);
        let least_room = Vec4::splat(self.tolerance * LEAST_ROOM);
        let room = (self.tolerance - bends * through).max(least_room);
        let shares = room / through;
        let below = 2.0 * shares / (2.0 + shares);
        let above = 2.0 * shares / (2.0 - shares);
        let within = shares.cmplt(Vec4::splat(1.0 - LOWEST_SHARE));
        let above = Vec4::select(within, above, Vec4::splat(LOWEST_DEPTH));
        [(optical_depths - below).max(Vec4::ZERO), optical_depths + above]
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
        let range = self.range(point.optical_depth);
        self.place(point, range, keep);
    }

    /// Requires the line from the last kept node to pass `point` between two optical depths.
    #[inline]
    fn place(&mut self, point: Node, [least, most]: [f32; 2], keep: &mut impl FnMut(Node)) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from 0 to 1 (a linear congruential generator of Knuth's).
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn four_slabs_at_once_are_four_slabs_one_by_one() {
        let mut random = Random(7);
        for case in 0..2_000 {
            let tolerance = if case % 5 == 0 { 0.0 } else { 0.01 };
            let (mut together, mut single) = (Fitter::new(tolerance), Fitter::new(tolerance));
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            let mut front = random.unit() as f32;
            let thickest = [0.02, 0.2, 0.5][case % 3];
            for _ in 0..20 {
                let step = 0.01 + random.unit() as f32;
                let fronts = front + Vec4::new(0.0, 1.0, 2.0, 3.0) * step;
                let backs = Vec4::new(fronts.y, fronts.z, fronts.w, front + 4.0 * step);
                let taus = Vec4::from_array([0; 4].map(|_| {
                    let tau = random.unit() as f32;
                    if tau < 0.05 { 0.0 } else { tau * thickest }
                }));
                together.add_four([fronts, backs], taus, &mut |node| found.push(node));
                for k in 0..4 {
                    if taus[k] > 0.0 && !single.is_dark() {
                        single.add([fronts[k], backs[k]], taus[k], &mut |node| expected.push(node));
                    }
                }
                assert_eq!(together.is_dark(), single.is_dark());
                if single.is_dark() {
                    break;
                }
                front = backs.w + if random.unit() < 0.2 { 0.5 } else { 0.0 };
            }
            together.finish(&mut |node| found.push(node));
            single.finish(&mut |node| expected.push(node));
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                // Lengths of slabs are rounded at other places.
                assert!((found.depth - expected.depth).abs() <= 1e-6 * expected.depth);
                let off = (found.optical_depth - expected.optical_depth).abs();
                assert!(off <= 1e-5 * (1.0 + expected.optical_depth), "{found:?}, {expected:?}");
            }
        }
    }
}
