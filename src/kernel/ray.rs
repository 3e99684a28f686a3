//! Intersections of rays and boxes, and the number of steps along a ray.

use glam::{Vec3, Vec4};

use crate::frame::Frame;
use crate::math::Each;

/// A ray, in frame space unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Its direction, of unit length in frame space.
    pub direction: Vec3,
}

impl Ray {
    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// The same ray in another space, given the rows of the transform to that space. Its direction
    /// is no longer of unit length, so that `t` still counts frame-space lengths.
    #[must_use]
    #[inline]
    pub fn transformed(&self, rows: &[Vec4; 3]) -> Self {
        let (origin, direction) = (self.origin.extend(1.0), self.direction.extend(0.0));
        Self {
            origin: Vec3::from_array(rows.each(|row| row.dot(origin))),
            direction: Vec3::from_array(rows.each(|row| row.dot(direction))),
        }
    }
}

/// The part of a ray inside a box, as distances (enter, exit) with 0 <= enter; empty if exit <=
/// enter. A direction of zero along an axis is inside the box's slab for all distances or for none.
#[inline]
pub fn intersect_box(ray: &Ray, min: Vec3, max: Vec3) -> (f32, f32) {
    // A tiny slope in place of zero avoids 0 / 0 and moves nothing that f32 can resolve.
    let d = ray.direction;
    let tiny = Vec3::splat(1e-30);
    let d = Vec3::select(d.abs().cmplt(tiny), tiny, d);
    let a = (min - ray.origin) / d;
    let b = (max - ray.origin) / d;
    let enter = a.min(b).max_element().max(0.0);
    (enter, a.max(b).min_element())
}

/// The number of voxel lengths along `length` of a ray in voxel indices that is `extent` long in
/// the medium; at most as many as the frame allows for the whole ray.
#[inline]
pub fn voxels_over(frame: &Frame, ray: &Ray, length: f32, extent: f32) -> f32 {
    let most = frame.media.most_voxels / extent.max(length).max(f32::MIN_POSITIVE);
    length * ray.direction.length().min(most)
}

/// How many steps to take over `voxels` voxel lengths with `per_voxel` steps each: at least
/// `least`, at most `most`.
#[inline]
pub fn step_count(voxels: f32, per_voxel: f32, least: u32, most: u32) -> u32 {
    ((voxels * per_voxel).ceil().min(16_777_216.0) as u32).clamp(least, most)
}
