//! Sums over ranges of a curve's points, four points at a time, and the best of four.
//!
//! The error of a knot at any point of a range follows from sums in front of it and behind it, so
//! one pass over the points serves all places.

use glam::{Mat4, Vec4};

use super::samples::{COUNT, LANES, PADDED, Samples};

/// Four quantities of each point of a range, added up from its first point on.
pub struct Sums {
    /// For each point of the range the sums up to and with it.
    rows: [Vec4; PADDED],
    first: usize,
    /// The sums of the whole range.
    pub all: Vec4,
}

impl Sums {
    /// Without points.
    pub fn new() -> Self {
        Self { rows: [Vec4::ZERO; PADDED], first: 0, all: Vec4::ZERO }
    }

    /// Adds up what `parts` makes of depths, opacities and weights of the points first..end.
    #[inline]
    pub fn add(
        &mut self,
        samples: &Samples,
        [first, end]: [usize; 2],
        parts: impl Fn(Vec4, Vec4, Vec4) -> [Vec4; 4],
    ) {
        let mut sum = Vec4::ZERO;
        let mut i = first;
        while i < end {
            let [depth, opacity, weight] = samples.four(i);
            let [a, b, c, d] = transposed(parts(depth, opacity, weight));
            let at = (i - first) % COUNT;
            let rows = &mut self.rows[at..at + 4];
            rows[0] = sum + a;
            rows[1] = rows[0] + b;
            rows[2] = rows[1] + c;
            rows[3] = rows[2] + d;
            sum = rows[3];
            i += 4;
        }
        self.first = first;
        self.all = self.rows[(end - 1 - first) % COUNT];
    }

    /// The point of from..end, within the range, at which `score` is largest. For four points
    /// `score` gets how far they are behind `from`, their depths and their sums; it returns at
    /// least 0.
    #[inline]
    pub fn best(
        &self,
        samples: &Samples,
        [from, end]: [usize; 2],
        mut score: impl FnMut(usize, Vec4, [Vec4; 4]) -> Vec4,
    ) -> usize {
        let mut best = Vec4::ZERO;
        let mut i = from;
        while i < end {
            let at = (i - self.first) % COUNT;
            let rows = &self.rows[at..at + 4];
            let sums = transposed([rows[0], rows[1], rows[2], rows[3]]);
            let scores = score(i - from, four(&samples.depth, i), sums);
            best = best.max(tagged(scores, i, end));
            i += 4;
        }
        tag(best).clamp(from, end - 1)
    }
}

impl Samples {
    /// Depth, opacity and weight of four points from `first` on.
    #[inline]
    pub fn four(&self, first: usize) -> [Vec4; 3] {
        [four(&self.depth, first), four(&self.opacity, first), four(&self.weight, first)]
    }
}

/// Four neighbouring numbers.
#[inline]
fn four(all: &[f32; PADDED], first: usize) -> Vec4 {
    let first = first % COUNT;
    Vec4::from_slice(&all[first..first + 4])
}

/// Rows of a 4 x 4 matrix as columns.
#[inline]
pub fn transposed([a, b, c, d]: [Vec4; 4]) -> [Vec4; 4] {
    let rows = Mat4::from_cols(a, b, c, d).transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis]
}

/// Scores, at least 0, of the points from `first` on, with each point's index in the lowest bits,
/// which a score can spare; 0 from point `end` on.
#[inline]
pub fn tagged(scores: Vec4, first: usize, end: usize) -> Vec4 {
    let points = LANES + first as i32 as f32;
    let scores = Vec4::select(points.cmplt(Vec4::splat(end as i32 as f32)), scores, Vec4::ZERO);
    let [a, b, c, d] = scores.to_array();
    let mark = |score: f32, lane: u32| {
        f32::from_bits(score.to_bits() & !(COUNT as u32 - 1) | (first as u32 + lane))
    };
    Vec4::new(mark(a, 0), mark(b, 1), mark(c, 2), mark(d, 3))
}

/// The point with the largest tagged score.
#[inline]
pub fn tag(scores: Vec4) -> usize {
    scores.max_element().to_bits() as usize % COUNT
}
