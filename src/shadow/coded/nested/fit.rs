//! Places the nine knots by least squares over a texel's points, first freely, then rounded to
//! codes.
//!
//! Knots are added one after another where a polyline errs most. Then each in turn moves to the
//! best point nearby; a knot's best opacity follows from its depth in closed form, because with
//! fixed neighbours the squared error is a parabola of it. Knots are rounded to codes from the root
//! of the tree down, and each chooses its best opacity again with those rounded before, so that
//! later knots make up for rounding.
//!
//! Errors are compared by what they gain over the chord between a knot's neighbours. So all sums
//! are small where errors are, and four lanes of f32 are precise enough.

use glam::Vec4;

use super::samples::{COUNT, LANES, SMALLEST, Samples, unit};
use super::sums::{Sums, tag, tagged, transposed};
use crate::kernel::exponential::INTEGERS;

/// Knots of a curve.
pub const KNOTS: usize = 9;
const LAST: usize = KNOTS - 1;
/// How often every knot moves.
const SWEEPS: usize = 2;
/// The order in which inner knots move.
const ORDER: [usize; KNOTS - 2] = [2, 4, 6, 1, 3, 5, 7];
/// By how many points a knot moves at most, at a time.
const FARTHEST: usize = 4;
/// A weight so small that it matters only where no point has influence; then a knot's best opacity
/// is halfway between its neighbours.
const TIE: f32 = 1e-9;
/// The first of the four depth codes that are tried, before the wanted depth: opacity has coarser
/// codes, and a knot at a nearby depth may lie closer to one.
const BEFORE: f32 = 1.0;

/// A knot of the curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Knot {
    /// Share of the way from the ray's entry to its exit.
    pub depth: f32,
    /// Share of the ray's largest opacity.
    pub opacity: f32,
}

impl Knot {
    /// The knot at the shares `depth` and `opacity` of the way from `a` to `b`.
    pub fn between([a, b]: [Self; 2], depth: f32, opacity: f32) -> Self {
        Self {
            depth: a.depth + (b.depth - a.depth) * depth,
            opacity: a.opacity + (b.opacity - a.opacity) * opacity,
        }
    }

    /// The same knot, clamped to the range from `a` to `b`.
    fn held_between(self, [a, b]: [Self; 2]) -> Self {
        let clamped = |x: f32, low: f32, high: f32| {
            let x = if x > low { x } else { low };
            if x < high { x } else { high }
        };
        Self {
            depth: clamped(self.depth, a.depth, b.depth),
            opacity: clamped(self.opacity, a.opacity, b.opacity),
        }
    }
}

/// The chord between two knots: opacity linear in depth.
#[derive(Clone, Copy)]
struct Chord {
    a: Knot,
    b: Knot,
    slope: f32,
}

impl Chord {
    fn new([a, b]: [Knot; 2]) -> Self {
        Self { a, b, slope: (b.opacity - a.opacity) / (b.depth - a.depth).max(SMALLEST) }
    }

    /// Opacity at a way of `ahead` from the first knot.
    #[inline]
    fn at(self, ahead: Vec4) -> Vec4 {
        self.a.opacity + ahead * self.slope
    }

    /// For knots between the two, from sums over all points: `steep` of weight times the square of
    /// a knot's influence on a point, `pull` of weight times influence times the point's distance
    /// from the chord.
    #[inline]
    fn gains(self, ahead: Vec4, steep: Vec4, pull: Vec4) -> Gains {
        let chord = self.at(ahead);
        let steep = steep + TIE;
        let pull = pull + TIE * (0.5 * (self.a.opacity + self.b.opacity) - chord);
        Gains { chord, steep, pull }
    }
}

/// By how much squared errors are smaller than those of the chord, as a parabola of a knot's
/// opacity; four knots.
#[derive(Clone, Copy)]
struct Gains {
    chord: Vec4,
    steep: Vec4,
    pull: Vec4,
}

impl Gains {
    #[inline]
    fn best(self) -> Vec4 {
        self.chord + self.pull / self.steep
    }

    #[inline]
    fn at(self, opacity: Vec4) -> Vec4 {
        let above = opacity - self.chord;
        (2.0 * self.pull - self.steep * above) * above
    }
}

/// Nine knots and the points that they approximate.
#[derive(Debug)]
pub struct Fit {
    samples: Samples,
    /// Index of the point at which each knot stands before it is rounded; it rises.
    at: [usize; KNOTS],
    /// The knots by rising depth.
    knots: [Knot; KNOTS],
}

impl Fit {
    /// The free fit.
    pub fn new(samples: Samples) -> Self {
        let at = farthest_points(&samples);
        let knots = at.map(|i| Knot { depth: samples.depth[i], opacity: samples.opacity[i] });
        let mut fit = Self { samples, at, knots };
        let mut sums = Sums::new();
        for _ in 0..SWEEPS {
            fit.move_first(&mut sums);
            for j in ORDER {
                fit.move_inner(&mut sums, j);
            }
            fit.move_last(&mut sums);
        }
        fit
    }

    /// The first and the last knot.
    pub fn ends(&self) -> [Knot; 2] {
        [self.knots[0], self.knots[LAST]]
    }

    /// Puts the first and the last knot at these rounded depths.
    pub fn settle_ends(&mut self, [first, last]: [f32; 2]) {
        self.knots[0] = Knot { depth: first, opacity: 0.0 };
        self.knots[LAST] = Knot { depth: last, opacity: 1.0 };
    }

    /// Rounds inner knot `j` to the best codes, of `bits` bits for depth and opacity, between the
    /// already rounded knots at distance `reach` to either side. Returns the codes.
    pub fn settle(&mut self, j: usize, reach: usize, bits: [u32; 2]) -> [u32; 2] {
        let around = [self.knots[j - reach], self.knots[j + reach]];
        let [a, b] = around;
        let near = [self.knots[j - 1].held_between(around), self.knots[j + 1].held_between(around)];
        let [most_depth, most_opacity] = [((1 << bits[0]) - 1) as f32, ((1 << bits[1]) - 1) as f32];
        let wanted = unit((self.knots[j].depth - a.depth) / (b.depth - a.depth)) * most_depth;
        let codes = wanted as i32 as f32 - BEFORE + LANES;
        let codes = codes.max(Vec4::ZERO).min(Vec4::splat(most_depth));
        let depths = a.depth + (b.depth - a.depth) * (codes / most_depth);
        let held = depths.max(Vec4::splat(near[0].depth)).min(Vec4::splat(near[1].depth));
        let gains = self.gains_at(held, near, [self.at[j - 1] + 1, self.at[j + 1]]);
        let height = b.opacity - a.opacity;
        let shares = (gains.best() - a.opacity) / height.max(SMALLEST);
        let shares = shares.max(Vec4::ZERO).min(Vec4::ONE);
        let opacity_codes = shares * most_opacity + INTEGERS;
        let opacities = a.opacity + height * ((opacity_codes - INTEGERS) / most_opacity);
        // A depth beyond a neighbour is taken only if there is no other.
        let beyond = Vec4::select(held.cmpeq(depths), Vec4::ZERO, Vec4::splat(1e3));
        let best = largest(gains.at(opacities) - beyond);
        let of = |four: Vec4| four.to_array()[best];
        self.knots[j] = Knot { depth: of(depths), opacity: of(opacities) };
        let whole = |x: f32, bits: u32| x.to_bits() & ((1 << bits) - 1);
        [whole(of(codes) + INTEGERS, bits[0]), whole(of(opacity_codes), bits[1])]
    }

    /// Moves inner knot `j` to the best of the points nearby, between its neighbours.
    fn move_inner(&mut self, sums: &mut Sums, j: usize) {
        let (samples, here) = (&self.samples, self.at[j]);
        let chord = Chord::new([self.knots[j - 1], self.knots[j + 1]]);
        let Chord { a, b, .. } = chord;
        let range = [self.at[j - 1] + 1, self.at[j + 1]];
        sums.add(samples, range, |depth, opacity, weight| {
            let (ahead, left) = (depth - a.depth, b.depth - depth);
            let above = opacity - chord.at(ahead);
            let (rising, falling) = (weight * ahead, weight * left);
            [rising * ahead, rising * above, falling * left, falling * above]
        });
        let near = [range[0].max(here.saturating_sub(FARTHEST)), range[1].min(here + FARTHEST)];
        let mut opacities = [0.0; 2 * FARTHEST + 4];
        let all = sums.all;
        let at =
            sums.best(samples, near, |i, depth, [square, mixed, later_square, later_mixed]| {
                let ahead = depth - a.depth;
                let rise = 1.0 / ahead.max(Vec4::splat(SMALLEST));
                let fall = 1.0 / (b.depth - depth).max(Vec4::splat(SMALLEST));
                let steep = square * rise * rise + (all.z - later_square) * fall * fall;
                let pull = mixed * rise + (all.w - later_mixed) * fall;
                let gains = chord.gains(ahead, steep, pull);
                let opacity = gains.best().max(Vec4::splat(a.opacity)).min(Vec4::splat(b.opacity));
                opacity.write_to_slice(&mut opacities[i % (2 * FARTHEST)..]);
                gains.at(opacity).max(Vec4::ZERO)
            });
        self.at[j] = at;
        self.knots[j] = Knot { depth: samples.depth[at], opacity: opacities[at - near[0]] };
    }

    /// Moves the first knot, of opacity 0, to the best point in front of the next one.
    fn move_first(&mut self, sums: &mut Sums) {
        let (samples, b) = (&self.samples, self.knots[1]);
        let range = [0, self.at[1]];
        sums.add(samples, range, |depth, opacity, weight| {
            let (left, below) = (b.depth - depth, b.opacity - opacity);
            let weighted = weight * below;
            let constant = weighted * below;
            let front = weight * opacity * opacity - constant;
            [front, weighted * left, weight * left * left, constant]
        });
        let all = sums.all;
        let at = sums.best(samples, range, |_, depth, [front, mixed, square, _]| {
            let slope = b.opacity / (b.depth - depth).max(Vec4::splat(SMALLEST));
            let line = slope * (slope * (all.z - square) - 2.0 * (all.y - mixed));
            1.0 / (all.w + front + line).max(Vec4::splat(TIE))
        });
        self.at[0] = at;
        self.knots[0].depth = samples.depth[at];
    }

    /// Moves the last knot, of opacity 1, to the best point behind the one before.
    fn move_last(&mut self, sums: &mut Sums) {
        let (samples, a) = (&self.samples, self.knots[LAST - 1]);
        let range = [self.at[LAST - 1] + 1, COUNT];
        sums.add(samples, range, |depth, opacity, weight| {
            let (ahead, above, rest) = (depth - a.depth, opacity - a.opacity, 1.0 - opacity);
            let weighted = weight * above;
            let constant = weight * rest * rest;
            let front = weighted * above - constant;
            [front, weighted * ahead, weight * ahead * ahead, constant]
        });
        let all = sums.all;
        let at = sums.best(samples, range, |_, depth, [front, mixed, square, _]| {
            let slope = (1.0 - a.opacity) / (depth - a.depth).max(Vec4::splat(SMALLEST));
            let line = slope * (slope * square - 2.0 * mixed);
            1.0 / (all.w + front + line).max(Vec4::splat(TIE))
        });
        self.at[LAST] = at;
        self.knots[LAST].depth = samples.depth[at];
    }

    /// What knots at four depths gain between two neighbours, by the points first..end.
    #[inline]
    fn gains_at(&self, depths: Vec4, near: [Knot; 2], [first, end]: [usize; 2]) -> Gains {
        let chord = Chord::new(near);
        let [a, b] = near;
        let rise = (1.0 / (depths - a.depth).max(Vec4::splat(SMALLEST))).to_array();
        let fall = (1.0 / (b.depth - depths).max(Vec4::splat(SMALLEST))).to_array();
        let (mut steep, mut pull) = ([Vec4::ZERO; 4], [Vec4::ZERO; 4]);
        let mut i = first;
        while i < end {
            let [depth, opacity, weight] = self.samples.four(i);
            let (ahead, left) = (depth - a.depth, b.depth - depth);
            let above = opacity - chord.at(ahead);
            for k in 0..4 {
                let influence = (ahead * rise[k]).min(left * fall[k]).max(Vec4::ZERO);
                let weighted = weight * influence;
                steep[k] += weighted * influence;
                pull[k] += weighted * above;
            }
            i += 4;
        }
        let [steep, pull] = [transposed(steep), transposed(pull)];
        let sum = |[a, b, c, d]: [Vec4; 4]| a + b + c + d;
        chord.gains(depths - a.depth, sum(steep), sum(pull))
    }
}

/// Points for nine knots: the ends, then repeatedly the point farthest from the polyline so far
/// (Douglas and Peucker 1973).
fn farthest_points(samples: &Samples) -> [usize; KNOTS] {
    let mut at = [COUNT - 1; KNOTS];
    at[0] = 0;
    // For each piece of the polyline its farthest point, and how far that is.
    let mut farthest = [(-1.0, 0); KNOTS];
    farthest[0] = farthest_between(samples, 0, COUNT - 1);
    for count in 2..KNOTS {
        let mut piece = 0;
        for j in 1..count - 1 {
            if farthest[j].0 > farthest[piece].0 {
                piece = j;
            }
        }
        let [from, to] = [at[piece], at[piece + 1]];
        let new = farthest[piece].1;
        at.copy_within(piece + 1..count, piece + 2);
        farthest.copy_within(piece + 1..count - 1, piece + 2);
        at[piece + 1] = new;
        farthest[piece] = farthest_between(samples, from, new);
        farthest[piece + 1] = farthest_between(samples, new, to);
    }
    at
}

/// How far the farthest point between two others is from the line through them, and its index; less
/// than 0 if there is none.
fn farthest_between(samples: &Samples, from: usize, to: usize) -> (f32, usize) {
    if from + 1 >= to {
        return (-1.0, from);
    }
    let point = |i: usize| Knot { depth: samples.depth[i], opacity: samples.opacity[i] };
    let chord = Chord::new([point(from), point(to)]);
    let mut farthest = Vec4::ZERO;
    let mut i = from + 1;
    while i < to {
        let [depth, opacity, weight] = samples.four(i);
        let off = (opacity - chord.at(depth - chord.a.depth)).abs();
        // Points within a jump lie on a vertical line between its ends, which needs no knots.
        let off = Vec4::select(weight.cmpgt(Vec4::ZERO), off, Vec4::ZERO);
        farthest = farthest.max(tagged(off, i, to));
        i += 4;
    }
    (farthest.max_element(), tag(farthest).clamp(from + 1, to - 1))
}

/// Index of the largest of four numbers.
#[inline]
fn largest(four: Vec4) -> usize {
    let [a, b, c, d] = four.to_array();
    let (i, left) = if b > a { (1, b) } else { (0, a) };
    let (j, right) = if d > c { (3, d) } else { (2, c) };
    if right > left { j } else { i }
}

#[cfg(test)]
mod tests;
