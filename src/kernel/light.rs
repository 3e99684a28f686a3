//! The light's rays, where a point lies in its map, and how bright it shines there.

use glam::{Vec3, Vec4};

use super::ray::{Ray, intersect_box};
use crate::frame::Frame;

/// The light ray through map position `(u, v)`, 0..1. Distances along it are the map's depths.
pub fn light_ray(frame: &Frame, u: f32, v: f32) -> Ray {
    let at = |base: Vec4, du: Vec4, dv: Vec4| (base + u * du + v * dv).truncate();
    Ray {
        origin: at(frame.light.origin, frame.light.origin_u, frame.light.origin_v),
        direction: at(frame.light.direction, frame.light.direction_u, frame.light.direction_v)
            .normalize(),
    }
}

/// Depths where the light ray through `(u, v)` enters and leaves the volume; it misses if the second
/// is not greater.
pub fn light_extent(frame: &Frame, u: f32, v: f32) -> (f32, f32) {
    let ray = light_ray(frame, u, v).transformed(&frame.media.index_from_frame);
    intersect_box(&ray, frame.media.domain_min, frame.media.domain_max)
}

/// (u, v, depth) of a point; u = -1 (outside of every map) behind a point or spot light.
pub fn light_coordinates(frame: &Frame, point: Vec3) -> Vec3 {
    let p = point.extend(1.0);
    let [u, v, depth, w] = frame.light.from_frame.map(|row| row.dot(p));
    if frame.light.has_position == 0 {
        return Vec3::new(u, v, depth);
    }
    if w <= 0.0 {
        return Vec3::new(-1.0, -1.0, 0.0);
    }
    Vec3::new(u / w, v / w, (point - frame.light.position).length())
}

/// The way light travels at a point, unit length.
pub fn light_direction_at(frame: &Frame, point: Vec3) -> Vec3 {
    if frame.light.has_position == 0 {
        return frame.light.direction.truncate();
    }
    (point - frame.light.position).normalize_or_zero()
}

/// Unshadowed irradiance at a point on a plane that faces the light, per channel.
pub fn irradiance_at(frame: &Frame, point: Vec3) -> Vec3 {
    let irradiance = frame.light.irradiance;
    if frame.light.has_position == 0 {
        return irradiance;
    }
    let squared = (point - frame.light.position).length_squared().max(1e-30);
    let cosine = light_direction_at(frame, point).dot(frame.light.axis);
    let (inner, outer) = (frame.light.cone_inner, frame.light.cone_outer);
    let x = ((cosine - outer) / (inner - outer).max(1e-6)).clamp(0.0, 1.0);
    irradiance * (x * x * (3.0 - 2.0 * x) / squared)
}
