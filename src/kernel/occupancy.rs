//! Steps of a ray that need not be taken, because they lie in empty bricks.

use glam::Vec3;

use super::ray::Ray;
use crate::frame::Frame;
use crate::scene::Occupancy;

/// A ray cut into equal steps, of which those in empty bricks are jumped over.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    occupancy: &'a Occupancy,
    origin: Vec3,
    per_voxel: f32,
    last: Vec3,
    ray: Ray,
    /// One over its direction, bricks and not voxels.
    inverse: Vec3,
    enter: f32,
    step: f32,
    /// Up to here along the ray nothing changes.
    end: f32,
}

impl<'a> Walk<'a> {
    /// The steps of length `step` from `enter` on along a ray in index space.
    pub fn new(
        occupancy: &'a Occupancy,
        frame: &Frame,
        ray: &Ray,
        [enter, step]: [f32; 2],
    ) -> Self {
        let per_voxel = 1.0 / frame.bricks.w;
        let direction = ray.direction * per_voxel;
        let tiny = Vec3::splat(1e-30);
        let direction = Vec3::select(direction.abs().cmplt(tiny), tiny, direction);
        Self {
            occupancy,
            origin: frame.bricks.truncate(),
            per_voxel,
            last: Vec3::from_array(occupancy.dims().map(|n| (n - 1) as f32)),
            ray: *ray,
            inverse: direction.recip(),
            enter,
            step,
            end: f32::NEG_INFINITY,
        }
    }

    /// The first step from `i` on that may hold anything; `count` or more if none before does.
    #[inline]
    pub fn next_step(&mut self, mut i: u32, count: u32) -> u32 {
        while i < count {
            let t = self.enter + i as f32 * self.step;
            if t < self.end {
                return i;
            }
            let empty = self.look(t);
            let next = ((self.end - self.enter) / self.step) as u32;
            if !empty || next <= i {
                return i;
            }
            i = next;
        }
        i
    }

    /// Whether the brick at distance `t` is empty; `end` becomes where the ray leaves it, or the empty
    /// block around it.
    fn look(&mut self, t: f32) -> bool {
        let place = (self.ray.at(t) - self.origin) * self.per_voxel;
        let brick = place.floor().clamp(Vec3::ZERO, self.last);
        let [nx, ny, _] = self.occupancy.dims();
        let [x, y, z] = brick.to_array().map(|c| c as usize);
        let distance = self.occupancy.distances()[(z * ny + y) * nx + x];
        let around = f32::from(distance.max(1) - 1);
        let forward = self.inverse.cmpgt(Vec3::ZERO);
        let border = Vec3::select(forward, brick + (1.0 + around), brick - around);
        let left = ((border - place) * self.inverse).min_element();
        self.end = t + left.max(0.0);
        distance > 0
    }
}
