//! Places of a ray that need not be sampled, because they lie in empty bricks, and how long steps
//! may be elsewhere, as media change more or less.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::ray::Ray;
use crate::math::Each;
use crate::scene::{EMPTY, Occupancy, ROUGHEST};

/// Steps that a pass takes after each look, one after the other and all as long as each other.
pub const BATCH: u32 = 4;
/// How far beyond an empty brick a ray goes on, in shortest steps: rounding must not leave it
/// inside.
pub const LEAP: f32 = 0.1;
/// Steps at least, as a share of the ray's end: what rounding still tells apart.
pub const LEAST_SHARE: f32 = 2e-6;

/// What the samples of cut steps of a camera ray aim at, as a share of the limit: where one is
/// thick, others are.
pub const CUT_SHARE: f32 = 0.33;
/// What the samples of cut steps may hold, as a share of the limit.
pub const CUT_LIMIT: f32 = 0.5;
/// How much longer than made for the steepest place steps may be before ends of batches are looked
/// at.
pub const HIDING: f32 = 3.0;
/// What steps that are cut become at least, as a share of themselves.
pub const SHORTEST_CUT: f32 = 0.125;
/// The same at most.
pub const LONGEST_CUT: f32 = 0.75;

/// A ray on its way through the bricks.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    occupancy: &'a Occupancy,
    origin: Vec3,
    edge: f32,
    last: Vec3,
    ray: Ray,
    /// One over its direction, bricks and not voxels.
    inverse: Vec3,
    /// Where the ray ends.
    exit: f32,
    /// World lengths of a step: at least, where the media change most, at most.
    lengths: [f32; 3],
    /// Up to here along the ray nothing changes.
    end: f32,
    /// Length of a step there.
    step: f32,
}

impl<'a> Walk<'a> {
    /// A ray in index space that ends at distance `exit`. World lengths of its steps: at least,
    /// where the media change most, at most.
    pub fn new(
        occupancy: &'a Occupancy,
        ray: &Ray,
        exit: f32,
        [least, rough, most]: [f32; 3],
    ) -> Self {
        let (origin, edge) = (occupancy.origin().as_vec3(), occupancy.edge() as f32);
        let direction = ray.direction / edge;
        let tiny = Vec3::splat(1e-30);
        let direction = Vec3::select(direction.abs().cmplt(tiny), tiny, direction);
        let least = least.max(LEAST_SHARE * exit);
        Self {
            occupancy,
            origin,
            edge,
            last: Vec3::from_array(occupancy.dims().each(|n| (n - 1) as f32)),
            ray: *ray,
            inverse: direction.recip(),
            exit,
            lengths: [least, rough, most],
            end: f32::NEG_INFINITY,
            step: least,
        }
    }

    /// The first place from distance `start` on that may hold anything; the ray's end or more if
    /// none before does.
    #[inline]
    pub fn next_place(&mut self, start: f32) -> f32 {
        let mut t = start;
        let leap = LEAP * self.lengths[0];
        while t < self.exit * (1.0 - LEAST_SHARE) {
            if t < self.end || !self.look(t) {
                return (t - leap).max(start);
            }
            t = self.end.max(t) + leap;
        }
        self.exit.max(start)
    }

    /// How long the [`BATCH`] steps from `t` on are, which a pass may take before it asks again.
    /// The last one ends where the ray does, rounding or not.
    #[inline]
    pub fn step_from(&self, t: f32) -> f32 {
        let left = (self.exit - t) / BATCH as f32;
        if left < 1.001 * self.step { left } else { self.step }
    }

    /// Whether steps are so long, beside those that are made for the steepest place of the media,
    /// that something dense may begin between the last one's middle and its end.
    #[inline]
    pub fn hides(&self, step: f32) -> bool {
        step > HIDING * self.lengths[1]
    }

    /// What steps of a length become that must be cut to `share` of it: as long as they are if
    /// `share` is 1 or more, or if rounding tells no shorter ones apart.
    #[inline]
    pub fn cut(&self, step: f32, share: f32) -> f32 {
        if share >= 1.0 {
            return step;
        }
        let shorter = step * share.clamp(SHORTEST_CUT, LONGEST_CUT);
        shorter.max(LEAST_SHARE * self.exit).min(step)
    }

    /// Whether the brick at distance `t` is empty; `end` becomes where the ray leaves it, or the
    /// empty block around it.
    fn look(&mut self, t: f32) -> bool {
        let place = (self.ray.at(t) - self.origin) / self.edge;
        // Rounded down, as it is not below zero; conversion to i32 is the fastest.
        let cell = place.clamp(Vec3::ZERO, self.last).to_array().each(|c| c as i32);
        let brick = Vec3::from_array(cell.each(|c| c as f32));
        let [nx, ny, _] = self.occupancy.dims();
        let [x, y, z] = cell.each(|c| c as usize);
        let code = self.occupancy.codes()[(z * ny + y) * nx + x];
        let around = f32::from(code.max(EMPTY) - EMPTY);
        let forward = self.inverse.cmpgt(Vec3::ZERO);
        let border = Vec3::select(forward, brick + (1.0 + around), brick - around);
        let left = ((border - place) * self.inverse).min_element();
        self.end = t + left.max(0.0);
        let longer = f32::from(code) / f32::from(ROUGHEST);
        let [least, rough, most] = self.lengths;
        self.step = (longer * rough).min(most).max(least);
        code >= EMPTY
    }
}

/// How long the four steps of a light ray are, and their optical depths: `depths` tells those of
/// steps of a length, which begins with `step` and is cut until optical depth bends no more from
/// step to step than `limit` over the share of light that gets to them, behind the optical depth
/// `tau`. Where steps are longer than [`Walk::hides`] allows, `end` tells the optical depth of a
/// step like the place where they end: what begins behind the last one's middle is seen there.
#[inline]
pub fn cut_to_bend(
    walk: &Walk<'_>,
    mut step: f32,
    [limit, tau]: [f32; 2],
    depths: impl Fn(f32) -> Vec4,
    end: impl Fn(f32) -> f32,
) -> (f32, Vec4) {
    loop {
        let taus = depths(step);
        let mut bend = (taus.yzw() - taus.xyz()).abs().max_element();
        if walk.hides(step) {
            // Half a step on.
            bend = bend.max(2.0 * (end(step) - taus.w).abs());
        }
        if bend <= limit {
            return (step, taus);
        }
        // Half of a step's length is a quarter of the bend.
        let shorter = walk.cut(step, (limit / (bend * (-tau).exp())).sqrt());
        if shorter >= step {
            return (step, taus);
        }
        step = shorter;
    }
}
