//! Random points on surfaces.

use glam::DVec3;

use super::random::Random;
use crate::scene::{OFF_STRANDS, Shape, Surface, Surfaces};

/// Points on triangles are nearer to the light by this share of the diagonal of what casts shadows.
const OFF_TRIANGLES: f64 = 1e-4;

/// `count` points, spread evenly over the lengths of strands and the areas of triangles, and how far
/// each is to be moved towards the light. Half of them are on strands where there are both.
pub(super) fn on_surfaces(
    surfaces: &Surfaces,
    count: usize,
    random: &mut Random,
) -> Vec<(DVec3, f64)> {
    let (strands, meshes): (Vec<&Surface>, Vec<&Surface>) =
        surfaces.iter().partition(|surface| matches!(surface.shape, Shape::Strands(_)));
    let on_strands = match (strands.is_empty(), meshes.is_empty()) {
        (true, _) => 0,
        (_, true) => count,
        _ => count / 2,
    };
    let mut points = spread(&parts(&strands), on_strands, random);
    points.extend(spread(&parts(&meshes), count - on_strands, random));
    points
}

/// A segment of a strand or a triangle in the world, and how far its points are moved towards the
/// light; a segment's last two corners are alike.
type Part = ([DVec3; 3], f64);

fn parts(surfaces: &[&Surface]) -> Vec<Part> {
    let mut parts = Vec::new();
    let boxes = surfaces.iter().map(|surface| surface.world_bounds().size().length());
    let off_triangles = OFF_TRIANGLES * boxes.fold(0.0, f64::max);
    for surface in surfaces {
        let to = |p: glam::Vec3| surface.world_from_object().transform_point3(p.as_dvec3());
        match &surface.shape {
            Shape::Mesh(mesh) => {
                let corners = |i: usize| (mesh.corners(i).map(to), off_triangles);
                parts.extend((0..mesh.triangles().len()).map(corners));
            }
            Shape::Strands(strands) => {
                for points in (0..strands.count()).map(|index| strands.strand(index)) {
                    let part = |first: usize| {
                        let segment = strands.segment(first);
                        let [a, b] = segment.ends.map(to);
                        let radius = f64::from(segment.radii[0].max(segment.radii[1]));
                        ([a, b, b], OFF_STRANDS * 2.0 * radius * surface.scale())
                    };
                    parts.extend((points.start..points.end - 1).map(part));
                }
            }
        }
    }
    parts
}

/// Random points of parts, by length or area.
fn spread(parts: &[Part], count: usize, random: &mut Random) -> Vec<(DVec3, f64)> {
    let mut sums = Vec::with_capacity(parts.len());
    let mut sum = 0.0;
    for ([a, b, c], _) in parts {
        sum += if b == c { (*b - *a).length() } else { (*b - *a).cross(*c - *a).length() };
        sums.push(sum);
    }
    if !(sum > 0.0 && sum.is_finite()) {
        return Vec::new();
    }
    let one = |_| {
        let place = random.unit() * sum;
        let part = sums.partition_point(|&upto| upto <= place).min(parts.len() - 1);
        let ([a, b, c], off) = parts[part];
        let (mut x, mut y) = (random.unit(), random.unit());
        if b != c && x + y > 1.0 {
            (x, y) = (1.0 - x, 1.0 - y);
        }
        (if b == c { a + (b - a) * x } else { a + (b - a) * x + (c - a) * y }, off)
    };
    (0..count).map(one).collect()
}
