//! Steps of a ray that need not be taken, because they lie in empty bricks, and steps that may be joined,
//! because the media hardly change.

use glam::Vec3;

use super::ray::Ray;
use crate::frame::Frame;
use crate::scene::{EMPTY, Occupancy, ROUGHEST};

/// Steps that a pass takes after each look, one after the other and all as long as each other.
pub const BATCH: u32 = 4;

/// A ray cut into equal steps, of which those in empty bricks are jumped over and others are joined.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    occupancy: &'a Occupancy,
    origin: Vec3,
    edge: f32,
    last: Vec3,
    ray: Ray,
    /// One over its direction, bricks and not voxels.
    inverse: Vec3,
    enter: f32,
    step: f32,
    /// How many steps may be joined where the media change most; less than 1 where they are too long.
    least: f32,
    /// And anywhere.
    most: f32,
    /// Up to here along the ray nothing changes.
    end: f32,
    joined: u32,
}

impl<'a> Walk<'a> {
    /// The steps of length `step` from `enter` on along a ray in index space. Where the media change most,
    /// steps may be as long as `length`.
    pub fn new(
        occupancy: &'a Occupancy,
        frame: &Frame,
        ray: &Ray,
        [enter, step]: [f32; 2],
        length: f32,
    ) -> Self {
        let direction = ray.direction / frame.bricks.w;
        let tiny = Vec3::splat(1e-30);
        let direction = Vec3::select(direction.abs().cmplt(tiny), tiny, direction);
        Self {
            occupancy,
            origin: frame.bricks.truncate(),
            edge: frame.bricks.w,
            last: Vec3::from_array(occupancy.dims().map(|n| (n - 1) as f32)),
            ray: *ray,
            inverse: direction.recip(),
            enter,
            step,
            least: length / step,
            most: frame.lengths.w / step,
            end: f32::NEG_INFINITY,
            joined: 1,
        }
    }

    /// The first step from `i` on that may hold anything, and how many may be joined to one there; `count`
    /// or more if none before does. A pass may take [`BATCH`] such steps before it asks again.
    #[inline]
    pub fn next_step(&mut self, mut i: u32, count: u32) -> (u32, u32) {
        while i < count {
            let t = self.enter + i as f32 * self.step;
            if t < self.end {
                break;
            }
            let empty = self.look(t);
            let next = ((self.end - self.enter) / self.step) as u32;
            if !empty || next <= i {
                break;
            }
            i = next;
        }
        (i, self.joined)
    }

    /// Forgets where it was: what follows depends on the next step alone.
    pub fn restart(&mut self) {
        self.end = f32::NEG_INFINITY;
    }

    /// Whether the brick at distance `t` is empty; `end` becomes where the ray leaves it, or the empty
    /// block around it.
    fn look(&mut self, t: f32) -> bool {
        let place = (self.ray.at(t) - self.origin) / self.edge;
        // Rounded down, as it is not below zero; conversion to i32 is the fastest.
        let cell = place.clamp(Vec3::ZERO, self.last).to_array().map(|c| c as i32);
        let brick = Vec3::from_array(cell.map(|c| c as f32));
        let [nx, ny, _] = self.occupancy.dims();
        let [x, y, z] = cell.map(|c| c as usize);
        let code = self.occupancy.codes()[(z * ny + y) * nx + x];
        let around = f32::from(code.max(EMPTY) - EMPTY);
        let forward = self.inverse.cmpgt(Vec3::ZERO);
        let border = Vec3::select(forward, brick + (1.0 + around), brick - around);
        let left = ((border - place) * self.inverse).min_element();
        self.end = t + left.max(0.0);
        let empty = code >= EMPTY;
        let longer = f32::from(if empty { ROUGHEST } else { code }) / f32::from(ROUGHEST);
        self.joined = (longer * self.least).min(self.most).max(1.0) as u32;
        empty
    }
}
