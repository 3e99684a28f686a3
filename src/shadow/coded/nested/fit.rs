//! Places the nine knots by least squares over a texel's points, first freely, then rounded to
//! codes.
//!
//! Knots are added one after another where a polyline errs most. Then each in turn moves along the
//! points; a knot's best opacity follows from its depth in closed form, because with fixed
//! neighbours the squared error is a parabola of it. Knots are rounded to codes from the root of
//! the tree down, and each chooses its best opacity again with those rounded before, so that later
//! knots make up for rounding. All of it works on 64 points and nine knots in sequence, with no
//! division of work that a GPU thread could not do.

use super::samples::{COUNT, Samples, unit};

/// Knots of a curve.
pub const KNOTS: usize = 9;
const LAST: usize = KNOTS - 1;
/// By how many points a knot tries to move, sweep after sweep.
const MOVES: [usize; 4] = [4, 2, 1, 1];

/// How many depth codes are tried to either side of the wanted one: opacity has coarser codes, and
/// a knot at a nearby depth may lie closer to one.
const NEAR: u32 = 2;

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
        Self {
            depth: self.depth.max(a.depth).min(b.depth),
            opacity: self.opacity.max(a.opacity).min(b.opacity),
        }
    }
}

/// Squared error as a function of a knot's opacity: `least + steepness (opacity - best)^2`.
struct Parabola {
    best: f32,
    least: f32,
    steepness: f32,
}

impl Parabola {
    fn at(&self, opacity: f32) -> f32 {
        let off = opacity - self.best;
        self.least + self.steepness * off * off
    }
}

/// Nine knots and the points that they approximate.
#[derive(Debug)]
pub struct Fit {
    samples: Samples,
    /// Index of the point at which each knot stands before it is rounded.
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
        for step in MOVES {
            for j in 0..KNOTS {
                fit.move_knot(j, step);
            }
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
        let neighbours =
            [self.knots[j - 1], self.knots[j + 1]].map(|knot| knot.held_between(around));
        let [most_depth, most_opacity] = bits.map(|bits| ((1_u32 << bits) - 1) as f32);
        let wanted = share(self.knots[j].depth, around.map(|knot| knot.depth)) * most_depth;
        let (mut least, mut codes) = (f32::INFINITY, [0.0, 0.0]);
        let nearest = wanted.floor() + 1.0 - NEAR as f32;
        for offset in 0..2 * NEAR {
            let depth = nearest + offset as f32;
            if !(0.0..=most_depth).contains(&depth) {
                continue;
            }
            let knot = Knot::between(around, depth / most_depth, 0.5);
            let held = knot.held_between(neighbours);
            let parabola = self.error(j, neighbours, held.depth);
            let opacity = share(parabola.best, around.map(|knot| knot.opacity));
            let opacity = (opacity * most_opacity).round();
            let coded = Knot::between(around, depth / most_depth, opacity / most_opacity);
            // A depth beyond a neighbour is taken only if there is no other.
            let beyond = if held.depth == knot.depth { 0.0 } else { 1e3 };
            let error = parabola.at(coded.opacity) + beyond;
            if error < least {
                (least, codes) = (error, [depth, opacity]);
            }
        }
        self.knots[j] = Knot::between(around, codes[0] / most_depth, codes[1] / most_opacity);
        codes.map(|code| code as u32)
    }

    /// Moves knot `j` by `step` points to either side if that lowers the error.
    fn move_knot(&mut self, j: usize, step: usize) {
        let low = if j == 0 { 0 } else { self.at[j - 1] };
        let high = if j == LAST { COUNT - 1 } else { self.at[j + 1] };
        let here = self.at[j];
        let mut least = f32::INFINITY;
        for at in [here, here.saturating_sub(step).max(low), (here + step).min(high)] {
            let depth = self.samples.depth[at];
            let (error, opacity) = if j == 0 {
                (self.line_error([Knot { depth, opacity: 0.0 }, self.knots[1]], 0, high), 0.0)
            } else if j == LAST {
                let line = [self.knots[LAST - 1], Knot { depth, opacity: 1.0 }];
                (self.line_error(line, low, COUNT - 1), 1.0)
            } else {
                let neighbours = [self.knots[j - 1], self.knots[j + 1]];
                let parabola = self.error(j, neighbours, depth);
                let opacity = parabola.best.max(neighbours[0].opacity).min(neighbours[1].opacity);
                (parabola.at(opacity), opacity)
            };
            if error < least {
                least = error;
                self.at[j] = at;
                self.knots[j] = Knot { depth, opacity };
            }
        }
    }

    /// Squared error between the neighbours of knot `j` if it stands at `depth` between the knots
    /// `a` and `b`.
    fn error(&self, j: usize, [a, b]: [Knot; 2], depth: f32) -> Parabola {
        // Computed relative to a guess, so that small errors keep their digits.
        let guess = self.knots[j].opacity;
        let [rise, fall] = [inverse(depth - a.depth), inverse(b.depth - depth)];
        // So small that it matters only where no point has influence; then the best opacity is
        // halfway.
        let mut steepness = 1e-9_f32;
        let mut slope = steepness * (0.5 * (a.opacity + b.opacity) - guess);
        let mut sum = 0.0;
        for i in self.at[j - 1]..=self.at[j + 1] {
            let at = self.samples.depth[i];
            let (influence, far) = if at <= depth {
                ((at - a.depth) * rise, a.opacity)
            } else {
                ((b.depth - at) * fall, b.opacity)
            };
            let influence = influence.max(0.0);
            let off = self.samples.opacity[i] - (far + (guess - far) * influence);
            let weighted = self.samples.weight[i] * influence;
            steepness += weighted * influence;
            slope += weighted * off;
            sum += self.samples.weight[i] * off * off;
        }
        let change = slope / steepness;
        Parabola { best: guess + change, least: (sum - slope * change).max(0.0), steepness }
    }

    /// Squared error of a line from `a` to `b`, constant beyond them, at the points `from` to `to`.
    fn line_error(&self, [a, b]: [Knot; 2], from: usize, to: usize) -> f32 {
        let per_depth = inverse(b.depth - a.depth);
        let points = from..=to;
        points
            .map(|i| {
                let share = unit((self.samples.depth[i] - a.depth) * per_depth);
                let line = a.opacity + (b.opacity - a.opacity) * share;
                let off = self.samples.opacity[i] - line;
                self.samples.weight[i] * off * off
            })
            .sum()
    }
}

/// Points for nine knots: the ends, then repeatedly the point farthest from the polyline so far
/// (Douglas and Peucker 1973).
fn farthest_points(samples: &Samples) -> [usize; KNOTS] {
    let mut at = [COUNT - 1; KNOTS];
    at[0] = 0;
    for count in 2..KNOTS {
        let (mut most, mut after, mut farthest) = (-1.0, 0, 0);
        for j in 0..count - 1 {
            let [from, to] = [at[j], at[j + 1]];
            let point = |i: usize| (samples.depth[i], samples.opacity[i]);
            let (a, b) = (point(from), point(to));
            let slope = (b.1 - a.1) * inverse(b.0 - a.0);
            for i in from + 1..to {
                let off = (point(i).1 - a.1 - (point(i).0 - a.0) * slope).abs();
                if off > most {
                    (most, after, farthest) = (off, j, i);
                }
            }
        }
        at[after + 1..=count].rotate_right(1);
        at[after + 1] = farthest;
    }
    at
}

/// 1 / `length`; 0 if `length` is 0.
fn inverse(length: f32) -> f32 {
    if length > 0.0 { 1.0 / length } else { 0.0 }
}

/// Position of `x` between `a` and `b`, as a share of the way.
fn share(x: f32, [a, b]: [f32; 2]) -> f32 {
    unit((x - a) * inverse(b - a))
}
