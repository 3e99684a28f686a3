//! Segments of strands as the texels of a map see them: the area of a texel that a segment covers,
//! and the depths between which it does.
//!
//! ```text
//!      side            a segment is drawn as a quadrangle around its axis, as wide as the strand
//!   +--------+--___    seen from the light. The ends of a strand stick out by pi/4 of its
//!   a ------------- b  radius, so that they cover the area of half a disc.
//!   +--------+--"""
//! ```

use std::f32::consts::FRAC_PI_4;

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

use super::light::light_coordinates;
use crate::frame::{CELLS, Frame};
use crate::math::Each;

/// Segments are cut where they come nearer than this share of their length to the plane through a
/// light with a position, across its view.
pub const NEAREST: f32 = 1e-4;
/// Strands are also cut where they come nearer to that plane than this many of their radii.
pub const NEAREST_RADII: f32 = 1.5;
/// The ends of strands stick out where they are farther from a light than this many radii.
pub const FAR_RADII: f32 = 40.0;
/// A strand appears at most the root of 2 times as wide as it is.
pub const LEAST_SQUARE: f32 = 0.5;
/// Areas of texels up to this are nothing but rounding.
pub const LEAST_AREA: f32 = 1e-6;
/// Lengths below this count as zero where directions are computed.
pub const SHORTEST: f32 = 1e-30;

/// A segment of a strand in a map. Lengths are in texels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stroke {
    /// The corners of its outline, in order around it.
    pub outline: [Vec2; 4],
    /// The sides of its outline.
    pub sides: Sides,
    /// The ends of its axis.
    pub ends: [Vec2; 2],
    /// How far its outline reaches beyond its axis along u and v, at most.
    pub reach: Vec2,
    /// The ends of its axis in frame space.
    pub points: [Vec3; 2],
    /// Their distances along the axis of the light's view; 1 for parallel light.
    pub distances: [f32; 2],
    /// The shares of the segment where its ends are; 0 and 1 unless a light is so close that it is
    /// cut.
    pub shares: [f32; 2],
}

/// The stroke of a segment between two points of a strand (position and radius, in frame space);
/// `caps` says where the strand ends. `None` behind a light with a position.
pub fn stroke_of(frame: &Frame, [a, b]: [Vec4; 2], caps: [bool; 2]) -> Option<Stroke> {
    let ([a, b], shares) = in_front(frame, [a, b])?;
    let size = frame.map.size as f32;
    let project = |p: Vec3| light_coordinates(frame, p).truncate() * size;
    let axis = (b - a).xyz();
    let end = |point: Vec4, outwards: f32| {
        let (center, radius) = (point.xyz(), point.w);
        let ray = match frame.light.spread {
            0 => frame.light.direction.truncate(),
            _ => center - frame.light.position,
        };
        let side = direction(axis.cross(ray), ray);
        let along = direction(ray.cross(side), ray);
        // Close to a light, rays spread so much that what sticks out would have other flanks.
        let far = frame.light.spread == 0 || ray.length() > FAR_RADII * radius;
        let beyond = if far { outwards * FRAC_PI_4 * radius } else { 0.0 };
        let tip = center + along * (beyond * along.dot(axis).signum());
        // What sticks out goes on as the strand does, so that its flanks stay where they are.
        let slope = (b.w - a.w) / along.dot(axis).abs().max(b.w.max(a.w)).max(SHORTEST);
        let wide = (radius + slope * beyond).max(0.0) * widening(frame, axis, ray, radius);
        let wide = side * wide;
        (tip, project(tip - wide), project(tip + wide))
    };
    let (tip_a, right_a, left_a) = end(a, if caps[0] { -1.0 } else { 0.0 });
    let (tip_b, right_b, left_b) = end(b, if caps[1] { 1.0 } else { 0.0 });
    let ends = [tip_a, tip_b].each(project);
    let reach = [(right_a, 0), (left_a, 0), (right_b, 1), (left_b, 1)];
    let reach = reach.each(|(corner, i)| (corner - ends[i]).abs());
    let outline = [right_a, left_a, left_b, right_b];
    Some(Stroke {
        outline,
        sides: sides_of(&outline),
        ends,
        reach: reach[0].max(reach[1]).max(reach[2]).max(reach[3]),
        points: [tip_a, tip_b],
        distances: [tip_a, tip_b].each(|p| distance_of(frame, p)),
        shares,
    })
}

/// How much wider than its radius a strand appears from a light so close that rays which touch it
/// pass in front of its axis; `ray` goes from the light to a point of the axis.
fn widening(frame: &Frame, axis: Vec3, ray: Vec3, radius: f32) -> f32 {
    if frame.light.spread == 0 {
        return 1.0;
    }
    let distance = ray.cross(axis).length() / axis.length().max(SHORTEST);
    let share = radius / distance.max(SHORTEST);
    (1.0 - share * share).max(LEAST_SQUARE).sqrt().recip()
}

/// The part of a segment in front of a light with a position, and where on the segment it begins and
/// ends.
fn in_front(frame: &Frame, [a, b]: [Vec4; 2]) -> Option<([Vec4; 2], [f32; 2])> {
    if frame.light.spread == 0 {
        return Some(([a, b], [0.0, 1.0]));
    }
    let (da, db) = (distance_of(frame, a.xyz()), distance_of(frame, b.xyz()));
    // What is as wide as the strand must not reach behind the light either.
    let nearest = NEAREST * (b - a).xyz().length() + NEAREST_RADII * a.w.max(b.w);
    if da.max(db) <= nearest {
        return None;
    }
    let share = (nearest - da) / (db - da);
    let cut = a + (b - a) * share;
    Some(match (da < nearest, db < nearest) {
        (true, _) => ([cut, b], [share, 1.0]),
        (_, true) => ([a, cut], [0.0, share]),
        _ => ([a, b], [0.0, 1.0]),
    })
}

/// A point's distance from the light along the axis of its view; 1 for parallel light.
pub(super) fn distance_of(frame: &Frame, point: Vec3) -> f32 {
    if frame.light.spread == 0 { 1.0 } else { frame.light.from_frame[3].dot(point.extend(1.0)) }
}

/// A vector's direction; where it has none, one across `ray`.
fn direction(vector: Vec3, ray: Vec3) -> Vec3 {
    let length = vector.length();
    if length > SHORTEST {
        return vector / length;
    }
    let other = if ray.x.abs() < ray.y.abs() { Vec3::X } else { Vec3::Y };
    let across = ray.cross(other);
    across / across.length().max(SHORTEST)
}

/// The four sides of an outline: where they begin and end, and how u changes over v along each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sides {
    /// u where each begins.
    pub u: Vec4,
    /// v where each begins.
    pub v: Vec4,
    /// v where each ends.
    pub end: Vec4,
    /// Change of u over v; 0 for level ones, whose area is 0.
    pub slopes: Vec4,
}

/// The sides of a convex quadrangle.
pub fn sides_of(outline: &[Vec2; 4]) -> Sides {
    let [a, b, c, d] = *outline;
    let (u, v) = (Vec4::new(a.x, b.x, c.x, d.x), Vec4::new(a.y, b.y, c.y, d.y));
    let (end_u, end) = (u.yzwx(), v.yzwx());
    let rises = end - v;
    let level = rises.cmpeq(Vec4::ZERO);
    let slopes =
        Vec4::select(level, Vec4::ZERO, (end_u - u) / Vec4::select(level, Vec4::ONE, rises));
    Sides { u, v, end, slopes }
}

/// The area that a convex quadrangle covers of the texel whose upper left corner is `texel`, 0..1:
/// the sum over its sides of the area between each and the texel's left side, negative for sides
/// upwards.
#[inline]
pub fn covered(sides: &Sides, texel: Vec2) -> f32 {
    let (u, v) = (sides.u - texel.x, sides.v - texel.y);
    let (top, bottom) =
        (v.clamp(Vec4::ZERO, Vec4::ONE), (sides.end - texel.y).clamp(Vec4::ZERO, Vec4::ONE));
    let ends = [u + (top - v) * sides.slopes, u + (bottom - v) * sides.slopes];
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let (left, right) = (low.clamp(Vec4::ZERO, Vec4::ONE), high.clamp(Vec4::ZERO, Vec4::ONE));
    let lengths = high - low;
    // The mean of each side's u, clamped to the texel.
    let beyond = (high - low.max(Vec4::ONE)).max(Vec4::ZERO);
    let sums = (right - left) * (right + left) * 0.5 + beyond;
    let upright = lengths.cmplt(Vec4::splat(1e-6));
    let means = Vec4::select(upright, left, sums / Vec4::select(upright, Vec4::ONE, lengths));
    (means * (bottom - top)).element_sum().abs().min(1.0)
}

/// Which of the 8 x 8 cells of the texel whose upper left corner is `texel` have their middle in a
/// convex quadrangle; bit 8 y + x for column x and row y (the mask of an A-buffer, Carpenter 1984).
#[inline]
pub fn cells_of(sides: &Sides, texel: Vec2) -> u64 {
    let mut cells = 0;
    for row in 0..CELLS {
        let v = texel.y + (row as f32 + 0.5) / CELLS as f32;
        let at = Vec4::splat(v);
        let crosses = sides.v.cmple(at) ^ sides.end.cmple(at);
        let u = sides.u + (at - sides.v) * sides.slopes;
        let low = Vec4::select(crosses, u, Vec4::INFINITY).min_element();
        let high = Vec4::select(crosses, u, Vec4::NEG_INFINITY).max_element();
        let cell = |u: f32| ((u - texel.x) * CELLS as f32 + 0.5).clamp(0.0, CELLS as f32) as u32;
        let (first, end) = (cell(low), cell(high));
        if first < end {
            cells |= ((1_u64 << (end - first)) - 1) << (CELLS * row + first);
        }
    }
    cells
}

/// The range of a stroke's axis, as shares of its length, in the texel whose upper left corner is
/// `texel` and as far around it as the stroke is wide, as far as places of the texel are nearest to
/// it: there, in their middles, rays cross the strand. Where the axis passes by, it is the place
/// nearest to the texel's middle.
pub fn range_over(stroke: &Stroke, texel: Vec2) -> [f32; 2] {
    let [a, b] = stroke.ends;
    let axis = b - a;
    let (low, high) = (texel - stroke.reach - a, texel + Vec2::ONE + stroke.reach - a);
    let square = axis.length_squared().max(SHORTEST);
    let middle = (texel + 0.5 - a).dot(axis) / square;
    let half = 0.5 * axis.abs().element_sum() / square;
    let (mut from, mut to) = ((middle - half).max(0.0), (middle + half).min(1.0));
    for i in 0..2 {
        if axis[i].abs() > 1e-6 {
            let (x, y) = (low[i] / axis[i], high[i] / axis[i]);
            from = from.max(x.min(y));
            to = to.min(x.max(y));
        }
    }
    if from <= to { [from, to] } else { [nearest_share(stroke, texel + 0.5); 2] }
}

/// The share of a stroke's axis, 0..1, at the place nearest to `place`.
pub fn nearest_share(stroke: &Stroke, place: Vec2) -> f32 {
    let [a, b] = stroke.ends;
    let axis = b - a;
    ((place - a).dot(axis) / axis.length_squared().max(SHORTEST)).clamp(0.0, 1.0)
}

/// Whether a convex quadrangle, in either order, holds a place.
pub fn holds(outline: &[Vec2; 4], place: Vec2) -> bool {
    let sides = [0, 1, 2, 3].each(|i: usize| {
        let (a, b) = (outline[i], outline[(i + 1) % 4]);
        (b - a).perp_dot(place - a)
    });
    sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
}

/// The share of the way along a stroke's axis, in space, of the place at a share of it as it appears
/// in the map: equal lengths of the map are longer farther from a light with a position.
pub fn share_along(stroke: &Stroke, share: f32) -> f32 {
    let [near, far] = stroke.distances;
    share * near / (far + share * (near - far)).max(SHORTEST)
}

/// The depth of the place at a share of the way along a stroke's axis, in space.
pub fn depth_along(frame: &Frame, stroke: &Stroke, share: f32) -> f32 {
    let [a, b] = stroke.points;
    light_coordinates(frame, a + (b - a) * share).z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_those_of_geometry() {
        let square = |x: f32, y: f32, w: f32, h: f32| {
            [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(Vec2::from)
        };
        let at = Vec2::new(3.0, 5.0);
        for (outline, area) in [
            (square(3.25, 5.5, 0.5, 0.25), 0.125),
            (square(-100.0, -100.0, 500.0, 500.0), 1.0),
            (square(2.5, 4.5, 1.0, 1.0), 0.25),
            (square(4.1, 5.0, 1.0, 1.0), 0.0),
            // A diagonal band, half a diagonal wide.
            ([[2.75, 5.25], [3.25, 4.75], [4.25, 5.75], [3.75, 6.25]].map(Vec2::from), 0.75),
            // A triangle over the lower right half.
            ([[3.0, 6.0], [4.0, 5.0], [4.0, 6.0], [4.0, 6.0]].map(Vec2::from), 0.5),
        ] {
            let found = covered(&sides_of(&outline), at);
            assert!((found - area).abs() < 1e-5, "{outline:?}: {found}, not {area}");
            let mut other = outline;
            other.reverse();
            assert!((covered(&sides_of(&other), at) - found).abs() < 1e-6);
        }
    }

    /// A band over part of a texel holds the cells whose middles lie in it.
    #[test]
    fn cells_are_those_whose_middles_are_inside() {
        let outline = [[3.2, 5.0], [3.7, 5.3], [3.4, 5.9], [2.7, 5.5]].map(Vec2::from);
        for texel in [Vec2::new(3.0, 5.0), Vec2::new(2.0, 5.0), Vec2::new(3.0, 6.0)] {
            let found = cells_of(&sides_of(&outline), texel);
            for (x, y) in (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y))) {
                let middle = texel + (Vec2::new(x as f32, y as f32) + 0.5) / CELLS as f32;
                let bit = found >> (CELLS * y + x) & 1 == 1;
                assert_eq!(bit, holds(&outline, middle), "{middle}");
            }
        }
    }

    #[test]
    fn the_texels_of_a_quadrangle_add_up_to_its_area() {
        let outline = [[1.3, 2.1], [9.7, 5.4], [9.2, 6.9], [0.9, 2.9]].map(Vec2::from);
        let cross = |i: usize| outline[i].perp_dot(outline[(i + 1) % 4]);
        let area = 0.5 * (0..4).map(cross).sum::<f32>();
        let texels = (0..144).map(|i| Vec2::new((i % 12) as f32, (i / 12) as f32));
        let sum: f32 = texels.map(|texel| covered(&sides_of(&outline), texel)).sum();
        assert!((sum - area.abs()).abs() < 1e-4, "{sum}, not {area}");
    }
}
