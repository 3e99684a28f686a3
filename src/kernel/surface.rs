//! How surfaces reflect light: triangles as Lambertian surfaces, strands as Kajiya and Kay 1989,
//! section 4, describe. Both are scaled alike, so that a strand across the light is as bright as a
//! surface of its albedo that faces it.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::coverage::distance_of;
use crate::frame::Frame;

/// Points on strands are looked up this many radii nearer to the light.
pub const OFF_RADII: f32 = 2.0 * crate::scene::OFF_STRANDS as f32;
/// Texels from a lookup's place to those that it reads, as a share of the filter's width, and for
/// filters of at most this width.
pub const REACH: f32 = 0.75;
pub const LEAST_WIDTH: f32 = 2.0;
/// Points of triangles are moved off them by at least this share of a texel.
pub const LEAST_OFF: f32 = 0.1;

/// The share of white light that a triangle reflects per unit of solid angle; `normal` is the one
/// that it is shaded with.
pub fn triangle_reflectance(normal: Vec3, to_light: Vec3) -> f32 {
    normal.dot(to_light).max(0.0) * FRAC_1_PI
}

/// Where shadows fall on a point of a triangle that stands for a smooth surface: the point raised to
/// the planes through the triangle's corners, across their normals, by the corners' weights (Hanika
/// 2021, "Hacking the shadow terminator").
pub fn smooth_place(corners: [Vec3; 3], normals: [Vec3; 3], weights: Vec3, point: Vec3) -> Vec3 {
    let mut place = Vec3::ZERO;
    for i in 0..3 {
        let below = (point - corners[i]).dot(normals[i]).min(0.0);
        place += weights[i] * (point - below * normals[i]);
    }
    place
}

/// The share of light that a strand reflects per unit of solid angle, per channel: a diffuse part
/// with the sine of the angle between light and strand, and a highlight of height `specular` where
/// the view is near the cone of reflected rays.
pub fn strand_reflectance(
    tangent: Vec3,
    [to_light, to_camera]: [Vec3; 2],
    albedo: Vec3,
    [specular, shininess]: [f32; 2],
) -> Vec3 {
    let sine = |cosine: f32| (1.0 - cosine * cosine).max(0.0).sqrt();
    let (lit, seen) = (tangent.dot(to_light), tangent.dot(to_camera));
    let cone = (sine(lit) * sine(seen) - lit * seen).max(0.0);
    let highlight = if specular > 0.0 { specular * cone.powf(shininess) } else { 0.0 };
    (albedo * sine(lit) + highlight) * FRAC_1_PI
}

/// The weights of a triangle's corners at a point of it.
pub fn corner_weights([a, b, c]: [Vec3; 3], point: Vec3) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let part = |p: Vec3, q: Vec3| (p - point).cross(q - point).dot(normal).max(0.0);
    let parts = Vec3::new(part(b, c), part(c, a), part(a, b));
    parts / parts.element_sum().max(f32::MIN_POSITIVE)
}

/// How far to move a point of a triangle off its plane (unit normal `plane`), so that the texels that
/// a lookup reads do not take the plane for something in front of it: the farther, the more light
/// grazes it.
pub fn off_plane(frame: &Frame, point: Vec3, plane: Vec3, to_light: Vec3) -> f32 {
    let reach = REACH * (frame.map.window as f32).max(LEAST_WIDTH);
    let cosine = plane.dot(to_light);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    texel_length(frame, point) * (LEAST_OFF + reach * sine)
}

/// The longer edge of a map's texel at a point, in frame space.
pub fn texel_length(frame: &Frame, point: Vec3) -> f32 {
    let light = &frame.light;
    let edges = if light.spread == 0 {
        [light.origin_u, light.origin_v]
    } else {
        [light.direction_u, light.direction_v].map(|edge| edge * distance_of(frame, point))
    };
    let [across, down] = edges.map(|edge| edge.truncate().length());
    across.max(down) / frame.map.size as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strand_across_the_light_is_as_bright_as_a_surface_that_faces_it() {
        let albedo = Vec3::new(0.2, 0.5, 0.9);
        let seen = strand_reflectance(Vec3::X, [Vec3::Y, Vec3::Z], albedo, [0.0, 40.0]);
        assert_eq!(seen, albedo * triangle_reflectance(Vec3::Y, Vec3::Y));
        assert_eq!(strand_reflectance(Vec3::X, [Vec3::X, Vec3::Z], albedo, [0.0, 1.0]), Vec3::ZERO);
    }

    /// The highlight is largest where the angles to the strand are equal and on opposite sides.
    #[test]
    fn highlights_lie_on_the_cone_of_reflection() {
        let at =
            |degrees: f32| Vec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let of = |view: f32| {
            strand_reflectance(Vec3::X, [at(60.0), at(view)], Vec3::ZERO, [1.0, 20.0]).x
        };
        assert!((of(120.0) - FRAC_1_PI).abs() < 1e-6);
        assert!(of(110.0) < of(119.0) && of(119.0) > of(60.0));
        let tilted = 20.0_f32.to_radians().cos().powi(20) * FRAC_1_PI;
        assert!((of(100.0) - tilted).abs() < 1e-5, "{} {tilted}", of(100.0));
    }

    /// Points of a triangle in a ball are raised to about the ball; those of a flat one stay.
    #[test]
    fn points_are_raised_to_the_surface_that_a_triangle_stands_for() {
        let corners =
            [Vec3::new(0.3, 1.0, 0.0), Vec3::new(-0.2, 1.0, 0.3), Vec3::new(-0.1, 1.0, -0.3)]
                .map(Vec3::normalize);
        let weights = Vec3::new(0.3, 0.4, 0.3);
        let point = corners[0] * 0.3 + corners[1] * 0.4 + corners[2] * 0.3;
        let place = smooth_place(corners, corners, weights, point);
        let (inside, outside) = (1.0 - point.length(), place.length() - 1.0);
        assert!(outside > 0.0 && outside < inside, "{inside} {outside}");
        let plane = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        assert!(smooth_place(corners, [plane; 3], weights, point).abs_diff_eq(point, 1e-6));
    }

    #[test]
    fn weights_of_corners_are_affine() {
        let corners =
            [Vec3::new(1.0, 0.0, 2.0), Vec3::new(4.0, 1.0, 0.0), Vec3::new(0.0, 3.0, 1.0)];
        let weights = Vec3::new(0.2, 0.5, 0.3);
        let point = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
        assert!(corner_weights(corners, point).abs_diff_eq(weights, 1e-6));
    }
}
