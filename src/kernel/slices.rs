//! A light ray cut into slabs, and the optical depth of each.

use std::cell::Cell;

use glam::Vec4;

use super::light::light_ray;
use super::media::{Sampler, density_along, four_along};
use super::mixture::Met;
use super::ray::{Ray, intersect_box, step_count, voxels_over};
use crate::frame::Frame;

/// The slabs of a texel's ray. Slab `i` lies between the depths `start + i step` and
/// `start + (i + 1) step`, clipped to the part of the ray inside the volume.
#[derive(Clone, Copy, Debug)]
pub struct Slabs {
    /// The ray in voxel indices; distances along it are depths in world lengths.
    pub ray: Ray,
    /// Depth where the ray enters the volume.
    pub enter: f32,
    /// Depth where it leaves; the ray misses if exit <= enter.
    pub exit: f32,
    /// Depth of the front of slab 0, before clipping.
    pub start: f32,
    /// Length of a slab.
    pub step: f32,
    /// Index of the first slab that reaches into the volume.
    pub first: u32,
    /// One past the index of the last such slab.
    pub last: u32,
    /// Density samples in each slab.
    pub samples: u32,
}

/// The slabs of the ray through map position `(u, v)`: either equal parts of the ray between its
/// entry and exit, or between planes across the light's axis that all rays share.
pub fn slabs_of(frame: &Frame, u: f32, v: f32) -> Slabs {
    let ray = light_ray(frame, u, v).transformed(&frame.media.index_from_frame);
    let (min, max) = (frame.media.domain_min, frame.media.domain_max);
    let (enter, exit) = intersect_box(&ray, min, max);
    let none = Slabs { ray, enter, exit, start: enter, step: 0.0, first: 0, last: 0, samples: 1 };
    if exit <= enter {
        return none;
    }
    let planes = frame.map.planes;
    if planes == 0 {
        let extent = exit - enter;
        let voxels = voxels_over(frame, &ray, extent, extent);
        let count = step_count(
            voxels,
            frame.map.slabs.per_voxel,
            frame.map.slabs.least,
            frame.map.slabs.most,
        );
        let step = extent / count as f32;
        return Slabs {
            step,
            last: count,
            samples: samples_over(frame, &ray, step, extent),
            ..none
        };
    }
    // How much longer a distance along this ray is than along the light's axis.
    let direction =
        frame.light.direction + u * frame.light.direction_u + v * frame.light.direction_v;
    let along = direction.truncate().length();
    let (start, step) =
        (frame.map.near * along, (frame.map.far - frame.map.near) * along / planes as f32);
    let first = (((enter - start) / step).max(0.0) as u32).min(planes - 1);
    let last = ((exit - start) / step).ceil().max(0.0) as u32;
    let samples = samples_over(frame, &ray, step, exit - enter);
    Slabs { start, step, first, last: last.clamp(first + 1, planes), samples, ..none }
}

/// The number of samples that a step of a ray, which is `extent` long in the medium, needs by its
/// voxel lengths. The small subtraction keeps rounding from adding one.
pub fn samples_over(frame: &Frame, ray: &Ray, step: f32, extent: f32) -> u32 {
    let voxels = voxels_over(frame, ray, step, extent);
    (voxels * frame.map.slabs.samples - 0.01).ceil().clamp(1.0, 65_536.0) as u32
}

/// Depths of the front and the back of slab `i`, clipped to the volume; the slab is empty if back
/// <= front.
#[inline]
pub fn slab_bounds(slabs: &Slabs, i: u32) -> [f32; 2] {
    let front = slabs.start + i as f32 * slabs.step;
    let back = slabs.start + (i + 1) as f32 * slabs.step;
    [front.max(slabs.enter), back.min(slabs.exit)]
}

/// Optical depth of slab `i`, by the midpoint rule.
#[inline]
pub fn slab_optical_depth(sampler: &Sampler<'_>, frame: &Frame, slabs: &Slabs, i: u32) -> f32 {
    ray_optical_depth(sampler, frame, &slabs.ray, slab_bounds(slabs, i), slabs.samples)
}

/// Optical depth of a ray in voxel indices between the depths `front` and `back`, by the midpoint
/// rule with `samples` samples.
pub fn ray_optical_depth(
    sampler: &Sampler<'_>,
    frame: &Frame,
    ray: &Ray,
    [front, back]: [f32; 2],
    samples: u32,
) -> f32 {
    let step = (back - front).max(0.0) / samples as f32;
    let mut sum = 0.0;
    for s in 0..samples {
        sum += density_along(sampler, ray, front + (s as f32 + 0.5) * step, 0.5 * step);
    }
    sum * step * frame.media.extinction
}

/// The depths where the four slabs of a batch begin and end, clipped to the volume.
#[derive(Clone, Copy, Debug)]
pub struct Batch {
    /// Where each begins.
    pub fronts: Vec4,
    /// Where each ends; a slab is empty if this is not behind its front.
    pub backs: Vec4,
    /// Where the last one ends, not clipped.
    pub end: f32,
    /// With planes: index of the slab that follows the batch.
    pub next: f32,
}

/// Four slabs of length `step` from depth `t` on. With planes: the four from the slab that contains
/// `t` on, but none in front of slab `next`.
#[inline]
pub fn batch_of(frame: &Frame, slabs: &Slabs, t: f32, step: f32, next: f32) -> Batch {
    let (start, first, step) = if frame.map.planes > 0 {
        // Rounding must not skip a slab; one too many is empty.
        let holds = ((t - slabs.start) / slabs.step - 1e-3).floor();
        (slabs.start, holds.max(next), slabs.step)
    } else {
        (t, 0.0, step)
    };
    let fronts = start + (first + Vec4::new(0.0, 1.0, 2.0, 3.0)) * step;
    let backs = start + (first + Vec4::new(1.0, 2.0, 3.0, 4.0)) * step;
    let (enter, exit) = (Vec4::splat(slabs.enter), Vec4::splat(slabs.exit));
    let (fronts, end) = (fronts.max(enter), backs.w);
    Batch { fronts, backs: backs.min(exit), end, next: first + 4.0 }
}

/// Optical depths of a batch's slabs. `met` is the cache of this ray.
#[inline]
pub fn four_optical_depths(
    sampler: &Sampler<'_>,
    frame: &Frame,
    slabs: &Slabs,
    batch: &Batch,
    met: &Cell<Met>,
) -> Vec4 {
    let steps = (batch.backs - batch.fronts).max(Vec4::ZERO) / slabs.samples as f32;
    let mut sums = Vec4::ZERO;
    for s in 0..slabs.samples {
        let at = batch.fronts + (s as f32 + 0.5) * steps;
        sums += four_along(sampler, &slabs.ray, at, 0.5 * steps, met);
    }
    sums * steps * frame.media.extinction
}

/// Optical depth of a slab as long as the last one of a batch, with the density found at its end.
#[inline]
pub fn end_optical_depth(
    sampler: &Sampler<'_>,
    frame: &Frame,
    slabs: &Slabs,
    batch: &Batch,
) -> f32 {
    let step = (batch.backs.w - batch.fronts.w).max(0.0);
    let half = 0.5 * step / slabs.samples as f32;
    density_along(sampler, &slabs.ray, batch.backs.w, half) * (step * frame.media.extinction)
}
