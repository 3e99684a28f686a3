//! Normals at the corners of triangles.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

/// Where more corners meet than this, each keeps the normal of its triangle, so that the work is
/// bounded.
const MOST_MEETING: usize = 512;

/// The normal of a triangle's plane; zero if it has no area.
pub(super) fn flat(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

/// Given normals of unit length, and a triangle's own where one has no direction.
pub(super) fn complete(given: [Vec3; 3], corners: [Vec3; 3]) -> [Vec3; 3] {
    given.map(|normal| {
        let unit = normal.as_dvec3().try_normalize().map(DVec3::as_vec3);
        unit.filter(|unit| unit.is_finite()).unwrap_or_else(|| flat(corners))
    })
}

/// The normals at the corners of all triangles: the mean of those triangles that meet at the
/// corner's position and lie within the angle `crease` (radians) of the corner's own, weighted by
/// their angles there (Thürmer and Wüthrich 1998).
pub(super) fn smooth(
    count: usize,
    corners: impl Fn(usize) -> [Vec3; 3],
    crease: f64,
) -> Vec<[Vec3; 3]> {
    let mut meeting: HashMap<[u32; 3], Vec<(u32, u8)>> = HashMap::new();
    let (mut planes, mut angles) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for triangle in 0..count {
        let own = corners(triangle);
        for (corner, position) in (0..).zip(own) {
            // Zero may have either sign.
            let place = (position + 0.0).to_array().map(f32::to_bits);
            meeting.entry(place).or_default().push((triangle as u32, corner));
        }
        planes.push(flat(own));
        let at = |i: usize| {
            let [p, q, r] = [0, 1, 2].map(|k| own[(i + k) % 3].as_dvec3());
            let angle = (q - p).angle_between(r - p);
            if angle.is_finite() { angle } else { 0.0 }
        };
        angles.push([at(0), at(1), at(2)]);
    }
    let mut normals: Vec<[Vec3; 3]> = planes.iter().map(|&plane| [plane; 3]).collect();
    let least = crease.cos();
    for around in meeting.values().filter(|around| around.len() <= MOST_MEETING) {
        for &(triangle, corner) in around {
            let own = planes[triangle as usize].as_dvec3();
            let near = around.iter().filter_map(|&(other, at)| {
                let plane = planes[other as usize].as_dvec3();
                let weight = angles[other as usize][usize::from(at)];
                (plane.dot(own) >= least).then_some(weight * plane)
            });
            if let Some(mean) = near.sum::<DVec3>().try_normalize() {
                normals[triangle as usize][usize::from(corner)] = mean.as_vec3();
            }
        }
    }
    normals
}
