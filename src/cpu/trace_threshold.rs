//! Pass `trace_threshold`: from the light through every texel of the map.

use std::cell::Cell;

use glam::{Vec3, Vec4};

use super::tiles;
use crate::frame::Frame;
use crate::kernel::light::light_ray;
use crate::kernel::media::{Sampler, density_along, four_along};
use crate::kernel::occupancy::{BATCH, Walk, cut_to_bend};
use crate::kernel::ray::{intersect_box, step_count, voxels_over};
use crate::kernel::threshold::{LARGEST_OPTICAL_DEPTH, crossing_depth, levels};
use crate::progress::Progress;
use crate::scene::Media;

/// All texels, row 0 at v = 0: depths of three opacities and the largest opacity.
pub(super) fn trace_threshold(
    media: &Media,
    frame: &Frame,
    progress: &dyn Progress,
) -> Vec<[f32; 4]> {
    let size = frame.map.size as usize;
    progress.begin("shadow map", size as u64);
    let sampler = Sampler::of_extinction(media);
    let mut texels = vec![[0.0; 4]; size * size];
    tiles::fill(&mut texels, size, progress, Vec::new, |reached, place| {
        let [u, v] = place.map(|i| (i as f32 + 0.5) / size as f32);
        trace_texel(&sampler, frame, [u, v], reached)
    });
    texels
}

/// Depths where a step begins and ends, and the optical depths there.
type Reached = ([f32; 2], [f32; 2]);

/// One texel. `reached` is scratch.
fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    reached: &mut Vec<Reached>,
) -> [f32; 4] {
    let ray = light_ray(frame, u, v);
    let index_ray = ray.transformed(&frame.media.index_from_frame);
    let (min, max) = (frame.media.domain_min, frame.media.domain_max);
    let (enter, exit) = intersect_box(&index_ray, min, max);
    if exit <= enter {
        return [0.0; 4];
    }
    let length = exit - enter;
    let voxels = voxels_over(frame, &index_ray, length, length);
    let count =
        step_count(voxels, frame.map.rays.per_voxel, frame.map.rays.least, frame.map.rays.most);
    let lengths = [length / count as f32, frame.map.rays.rough, frame.map.rays.longest];
    let mut walk = Walk::new(sampler.occupancy, &index_ray, exit, lengths);

    reached.clear();
    let met = Cell::default();
    let (mut tau, mut t) = (0.0_f32, walk.next_place(enter));
    while t < exit && tau < LARGEST_OPTICAL_DEPTH {
        let depths = |step: f32| {
            let at = t + step * Vec4::new(0.5, 1.5, 2.5, 3.5);
            let densities = four_along(sampler, &index_ray, at, Vec4::splat(0.5 * step), &met);
            densities * (frame.media.extinction * step)
        };
        let end = |step: f32| {
            let density = density_along(sampler, &index_ray, t + BATCH as f32 * step, 0.5 * step);
            density * (frame.media.extinction * step)
        };
        let limits = [frame.map.rays.limit, tau];
        let (step, taus) = cut_to_bend(&walk, walk.step_from(t), limits, depths, end);
        for k in 0..BATCH as usize {
            if taus[k] > 0.0 {
                let before = tau;
                tau += taus[k];
                let begin = t + k as f32 * step;
                reached.push(([begin, begin + step], [before, tau]));
            }
        }
        t = walk.next_place(t + BATCH as f32 * step);
    }
    let largest = 1.0 - (-tau).exp();

    let depth_of = |level: f32| {
        let target = -(1.0 - level).ln();
        let k = reached.partition_point(|&(_, [_, tau])| tau < target);
        let Some(&(ends, taus)) = reached.get(k) else { return exit };
        crossing_depth(frame.map.crossing, ends, target, taus)
    };
    let thresholds = frame.map.thresholds;
    let paper = frame.map.lookup == 1;
    let depths = if paper {
        thresholds.map(|t| if t <= largest { depth_of(t) } else { exit })
    } else if largest > 0.0 {
        levels(largest, thresholds).map(depth_of)
    } else {
        Vec3::splat(exit)
    };
    depths.extend(largest).to_array()
}
