//! Empty-space skipping and adaptive step lengths: a ray jumps over empty bricks, and takes longer
//! steps where the media change less.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::exponential::transmitted;
use super::ray::Ray;
use crate::math::Each;
use crate::scene::{EMPTY, Occupancy, ROUGHEST};

/// Steps of equal length that a pass takes in a row before it looks at the bricks again.
pub const BATCH: u32 = 4;
/// How far a ray continues beyond an empty brick, in shortest steps, so that rounding does not
/// leave it inside.
pub const LEAP: f32 = 0.1;
/// Length of the shortest step as a share of the distance to the ray's end: f32 cannot resolve
/// shorter ones.
pub const LEAST_SHARE: f32 = 2e-6;

/// The optical depth that samples of shortened steps of a camera ray aim at, as a share of the
/// limit. It is well below 1 because dense samples have dense neighbours.
pub const CUT_SHARE: f32 = 0.33;
/// The largest optical depth of those samples, as a share of the limit.
pub const CUT_LIMIT: f32 = 0.5;
/// Steps that are more than this many times as long as those made for the steepest place also
/// sample the density at the end of their batch.
pub const HIDING: f32 = 3.0;
/// Shortest result of one shortening, as a share of the step's length.
pub const SHORTEST_CUT: f32 = 0.125;
/// Longest result of one shortening, as a share of the step's length.
pub const LONGEST_CUT: f32 = 0.75;

/// A ray on its way through the bricks.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    occupancy: &'a Occupancy,
    origin: Vec3,
    edge: f32,
    last: Vec3,
    ray: Ray,
    /// One over the ray's direction, in bricks instead of voxels.
    inverse: Vec3,
    /// Distance where the ray ends.
    exit: f32,
    /// World lengths of steps: the shortest, that where the media change most, and the longest.
    lengths: [f32; 3],
    /// Up to this distance along the ray the current brick, or empty block, goes on.
    end: f32,
    /// Length of a step up to there.
    step: f32,
}

impl<'a> Walk<'a> {
    /// A walk along a ray in index space that ends at distance `exit`. The last argument holds
    /// world lengths of steps: the shortest, that where the media change most, and the longest.
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

    /// The first distance from `start` on where the media may not be empty; the distance of the
    /// ray's end, or more, if there is none.
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

    /// Length of each of the [`BATCH`] steps that a pass may take from `t` on before it asks again.
    /// The last one ends exactly at the ray's end, whatever rounding does.
    #[inline]
    pub fn step_from(&self, t: f32) -> f32 {
        let left = (self.exit - t) / BATCH as f32;
        if left < 1.001 * self.step { left } else { self.step }
    }

    /// Whether steps are so much longer than those made for the steepest place of the media that
    /// something dense may begin between the last one's middle and its end and be missed.
    #[inline]
    pub fn hides(&self, step: f32) -> bool {
        step > HIDING * self.lengths[1]
    }

    /// The new length of steps of length `step` that must be shortened to `share` of it. It stays
    /// as it is if `share` is 1 or more, or if f32 cannot resolve shorter steps.
    #[inline]
    pub fn cut(&self, step: f32, share: f32) -> f32 {
        if share >= 1.0 {
            return step;
        }
        let shorter = step * share.clamp(SHORTEST_CUT, LONGEST_CUT);
        shorter.max(LEAST_SHARE * self.exit).min(step)
    }

    /// Whether the brick at distance `t` is empty. Sets `end` to where the ray leaves the brick, or
    /// the empty block around it.
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

/// The length of the four steps of a light ray, and their optical depths. The length begins as
/// `step` and is shortened until optical depth bends from step to step by no more than `limit` over
/// the share of light that reaches the steps; `tau` is the optical depth in front of them. `depths`
/// computes the optical depths of steps of a given length. Where steps are so long that
/// [`Walk::hides`] says so, `end` computes the optical depth of a step with the density found where
/// the four end, so that a medium that begins behind the last one's middle is seen.
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
            // `end` looks only half a step ahead.
            bend = bend.max(2.0 * (end(step) - taus.w).abs());
        }
        if bend <= limit {
            return (step, taus);
        }
        // Halving a step's length quarters the bend.
        let shorter = walk.cut(step, (limit / (bend * transmitted(tau))).sqrt());
        if shorter >= step {
            return (step, taus);
        }
        step = shorter;
    }
}
