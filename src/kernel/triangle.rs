//! Triangles as the texels of a map see them: which texels' central rays meet one, and at what
//! depth.

use glam::{Vec2, Vec3};

use super::coverage::{NEAREST, distance_of};
use super::light::light_coordinates;
use super::ray::Ray;
use crate::frame::Frame;
use crate::math::Each;

/// A triangle in a map. A part behind a light with a position is cut off, which leaves up to four
/// corners.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapTriangle {
    /// Its corners in texels, in order around it; the last one is repeated where there are three.
    pub corners: [Vec2; 4],
    /// A point of its plane in frame space, and the plane's normal, of any length.
    pub point: Vec3,
    /// See `point`.
    pub normal: Vec3,
    /// Optical depth of a crossing.
    pub optical_depth: f32,
}

/// The triangle between `corners` (frame space) in the map; `None` behind a light with a position,
/// or if it has no area.
pub fn triangle_of(frame: &Frame, corners: [Vec3; 3], optical_depth: f32) -> Option<MapTriangle> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    if optical_depth <= 0.0 || normal == Vec3::ZERO {
        return None;
    }
    let size = frame.map.size as f32;
    let project = |p: Vec3| light_coordinates(frame, p).truncate() * size;
    let outline = if frame.light.spread == 0 {
        let [a, b, c] = corners.each(project);
        [a, b, c, c]
    } else {
        let distance = |p: Vec3| distance_of(frame, p);
        let farthest = distance(a).max(distance(b)).max(distance(c));
        let nearest = NEAREST * (b - a).length().max((c - a).length());
        if farthest <= nearest {
            return None;
        }
        let mut kept = [Vec2::ZERO; 4];
        let mut count = 0;
        for i in 0..3 {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let (df, dt) = (distance(from), distance(to));
            if df >= nearest {
                kept[count] = project(from);
                count += 1;
            }
            if (df >= nearest) != (dt >= nearest) {
                kept[count] = project(from + (to - from) * ((nearest - df) / (dt - df)));
                count += 1;
            }
        }
        for i in count..4 {
            kept[i] = kept[count.max(1) - 1];
        }
        kept
    };
    outline.iter().all(|corner| corner.is_finite()).then_some(MapTriangle {
        corners: outline,
        point: a,
        normal,
        optical_depth,
    })
}

/// The depth where a texel's central ray meets a triangle; `center` is the texel's middle. `None`
/// if it passes by. Of the triangles at an edge only one is met.
pub fn triangle_depth(triangle: &MapTriangle, center: Vec2, ray: &Ray) -> Option<f32> {
    let mut sides = [0; 2];
    for i in 0..4 {
        let (a, b) = (triangle.corners[i], triangle.corners[(i + 1) % 4]);
        if a != b {
            sides[usize::from(is_left(a, b, center))] += 1;
        }
    }
    if sides[0] > 0 && sides[1] > 0 {
        return None;
    }
    let slope = triangle.normal.dot(ray.direction);
    let depth = triangle.normal.dot(triangle.point - ray.origin) / slope;
    (depth.is_finite() && depth >= 0.0).then_some(depth)
}

/// Whether a place is on the left of a line. One on it counts as a little above it or, where the
/// line is upright, on its right. Lines in opposite directions give opposite answers.
fn is_left(from: Vec2, to: Vec2, place: Vec2) -> bool {
    let forward = from.x < to.x || (from.x == to.x && from.y <= to.y);
    let (a, b) = if forward { (from - place, to - place) } else { (to - place, from - place) };
    let area = a.perp_dot(b);
    let left = area > 0.0 || (area == 0.0 && b.x > a.x);
    left == forward
}
