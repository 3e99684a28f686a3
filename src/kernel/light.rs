//! The light's rays, the position of a point in the light's map, and the irradiance there.

use glam::{Vec3, Vec4};

use super::ray::{Ray, intersect_box};
use crate::frame::Frame;
use crate::math::Each;

/// The light ray through map position `(u, v)`, each 0..1, in frame space. Distances along it are
/// the map's depths.
pub fn light_ray(frame: &Frame, u: f32, v: f32) -> Ray {
    let at = |base: Vec4, du: Vec4, dv: Vec4| (base + u * du + v * dv).truncate();
    Ray {
        origin: at(frame.light.origin, frame.light.origin_u, frame.light.origin_v),
        direction: at(frame.light.direction, frame.light.direction_u, frame.light.direction_v)
            .normalize(),
    }
}

/// Depths where the light ray through `(u, v)` enters and leaves the volume; it misses if exit <=
/// enter.
pub fn light_extent(frame: &Frame, u: f32, v: f32) -> (f32, f32) {
    let ray = light_ray(frame, u, v).transformed(&frame.media.index_from_frame);
    intersect_box(&ray, frame.media.domain_min, frame.media.domain_max)
}

/// (u, v, depth) of a point in frame space. A point behind a point or spot light has u = -1, which
/// is outside of every map.
#[inline]
pub fn light_coordinates(frame: &Frame, point: Vec3) -> Vec3 {
    let p = point.extend(1.0);
    let [u, v, depth, w] = frame.light.from_frame.each(|row| row.dot(p));
    if frame.light.spread == 0 {
        return Vec3::new(u, v, depth);
    }
    if w <= 0.0 {
        return Vec3::new(-1.0, -1.0, 0.0);
    }
    Vec3::new(u / w, v / w, (point - frame.light.position).length())
}

/// The direction in which light travels at a point, of unit length.
#[inline]
pub fn light_direction_at(frame: &Frame, point: Vec3) -> Vec3 {
    if frame.light.spread == 0 {
        return frame.light.direction.truncate();
    }
    (point - frame.light.position).normalize_or_zero()
}

/// Unshadowed irradiance at a point, on a plane that faces the light, per channel.
#[inline]
pub fn irradiance_at(frame: &Frame, point: Vec3) -> Vec3 {
    if frame.light.spread == 0 {
        return frame.light.irradiance;
    }
    let from_light = point - frame.light.position;
    if frame.light.spread > 1 && face_of(from_light) != frame.light.spread - 2 {
        return Vec3::ZERO;
    }
    let squared = from_light.length_squared().max(1e-30);
    frame.light.irradiance * (cone_share(frame, light_direction_at(frame, point)) / squared)
}

/// The share of a spot light's intensity in a direction; 1 for a point light.
#[inline]
fn cone_share(frame: &Frame, direction: Vec3) -> f32 {
    let (inner, outer) = (frame.light.cone_inner, frame.light.cone_outer);
    let cosine = direction.dot(frame.light.axis);
    let x = ((cosine - outer) / (inner - outer).max(1e-6)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Mean unshadowed irradiance over a piece of a ray, given its begin, middle and end, per channel,
/// for a light among the media: close to such a light irradiance changes much over the piece. The
/// integral of one over the squared distance is the angle that the piece subtends at the light,
/// divided by the light's distance from the ray. The cone's share is averaged over that angle.
pub fn irradiance_over(frame: &Frame, [begin, middle, end]: [Vec3; 3]) -> Vec3 {
    let [a, m, b] = [begin, middle, end].each(|point| point - frame.light.position);
    if face_of(m) != frame.light.spread - 2 {
        return Vec3::ZERO;
    }
    let (area, lengths) = (a.cross(b).length(), (a.length_squared() * b.length_squared()).sqrt());
    if area <= 1e-3 * lengths {
        let share = cone_share(frame, m.normalize_or_zero());
        return frame.light.irradiance * (share / lengths.max(1e-30));
    }
    let angle = area.atan2(a.dot(b));
    let (along, across) = (a.normalize(), (b - a * (a.dot(b) / a.length_squared())).normalize());
    let parts = ((angle / ANGLE).ceil() as u32).clamp(1, MOST_ANGLES);
    let mut share = 0.0;
    for i in 0..parts {
        let turned = angle * (i as f32 + 0.5) / parts as f32;
        share += cone_share(frame, turned.cos() * along + turned.sin() * across);
    }
    frame.light.irradiance * (share / parts as f32 * angle / area)
}

/// Angle in radians over which one sample of a cone's share stands.
pub const ANGLE: f32 = 0.05;
/// The largest number of samples of a cone's share over a piece of a ray.
pub const MOST_ANGLES: u32 = 64;

/// The face of a cube that a direction from its centre passes through: +x, -x, +y, -y, +z, -z are 0
/// to 5. Each edge belongs to exactly one face.
pub fn face_of(direction: Vec3) -> u32 {
    let far = direction.abs();
    if far.x >= far.y && far.x >= far.z {
        u32::from(direction.x < 0.0)
    } else if far.y >= far.z {
        2 + u32::from(direction.y < 0.0)
    } else {
        4 + u32::from(direction.z < 0.0)
    }
}
