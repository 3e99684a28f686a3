//! The camera's rays, sample positions within pixels, and the ground.

use glam::{Vec3, Vec4};

use super::light::{irradiance_at, light_direction_at};
use super::ray::Ray;
use crate::frame::Frame;

/// The camera ray through picture position `(x, y)`, each 0..1 from the upper left corner, in frame
/// space.
#[inline]
pub fn camera_ray(frame: &Frame, x: f32, y: f32) -> Ray {
    let at = |base: Vec4, dx: Vec4, dy: Vec4| (base + x * dx + y * dy).truncate();
    Ray {
        origin: at(frame.view.origin, frame.view.origin_x, frame.view.origin_y),
        direction: at(frame.view.direction, frame.view.direction_x, frame.view.direction_y)
            .normalize(),
    }
}

/// Distance along a ray to the ground; negative if the ray misses it.
#[inline]
pub fn ground_distance(frame: &Frame, ray: &Ray) -> f32 {
    let ground = &frame.view.ground;
    if ground.exists == 0 || ray.direction.y.abs() < 1e-20 {
        return -1.0;
    }
    let t = (ground.height - ray.origin.y) / ray.direction.y;
    let from_middle = (ray.at(t) - frame.view.world_origin).abs();
    let hit = t > 0.0 && t < 1e30 && from_middle.x.max(from_middle.z) <= ground.half_extent;
    if hit { t } else { -1.0 }
}

/// Radiance of the ground at a point, per channel, where `transmittance` of the light arrives.
pub fn ground_radiance(frame: &Frame, point: Vec3, transmittance: f32) -> Vec3 {
    let cosine = (-light_direction_at(frame, point).y).max(0.0);
    let direct =
        irradiance_at(frame, point) * (cosine * transmittance * std::f32::consts::FRAC_1_PI);
    frame.view.ground.albedo * (direct + frame.view.ambient)
}

/// The depth at which to look up the shadow of a point of a surface, where `light` is the point's
/// (u, v, depth) in the map.
#[inline]
pub fn surface_depth(frame: &Frame, light: Vec3) -> f32 {
    light.z - frame.map.bias
}
