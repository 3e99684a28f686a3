//! Pass `trace_threshold`: from the light through every texel of the map.

use glam::Vec3;
use rayon::prelude::*;

use crate::frame::{Frame, LIGHT_STEPS_PER_VOXEL};
use crate::kernel::light::light_ray;
use crate::kernel::media::{Sampler, density_along};
use crate::kernel::occupancy::Walk;
use crate::kernel::ray::{intersect_box, step_count};
use crate::kernel::threshold::{LARGEST_OPTICAL_DEPTH, crossing_depth, levels};
use crate::progress::Progress;
use crate::scene::Media;

/// All texels, row 0 at v = 0: depths of three opacities and the largest opacity.
pub(super) fn trace_threshold(
    media: &Media,
    frame: &Frame,
    progress: &dyn Progress,
) -> Vec<[f32; 4]> {
    let size = frame.sizes[3] as usize;
    progress.begin("shadow map", size as u64);
    let sampler = Sampler::of(media);
    let mut texels = vec![[0.0; 4]; size * size];
    texels.par_chunks_exact_mut(size).enumerate().for_each_init(Vec::new, |reached, (y, row)| {
        for (x, texel) in row.iter_mut().enumerate() {
            let at = |i: usize| (i as f32 + 0.5) / size as f32;
            *texel = trace_texel(&sampler, frame, [at(x), at(y)], reached);
        }
        progress.advance(1);
    });
    texels
}

/// One texel. `reached` is scratch: steps and the optical depths behind them.
fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    reached: &mut Vec<(u32, f32)>,
) -> [f32; 4] {
    let ray = light_ray(frame, u, v);
    let index_ray = ray.transformed(&frame.index_from_frame);
    let (min, max) = (frame.domain_min.truncate(), frame.domain_max.truncate());
    let (enter, exit) = intersect_box(&index_ray, min, max);
    if exit <= enter {
        return [0.0; 4];
    }
    let length = exit - enter;
    let voxels = length * index_ray.direction.length();
    let count = step_count(voxels, LIGHT_STEPS_PER_VOXEL, frame.steps[0], frame.steps[1]);
    let step = length / count as f32;
    let extinction_step = frame.domain_min.w * step;

    reached.clear();
    let mut tau = 0.0;
    let mut walk = Walk::new(sampler.occupancy, frame, &index_ray, [enter, step]);
    let mut i = walk.next_step(0, count);
    while i < count && tau < LARGEST_OPTICAL_DEPTH {
        let t = enter + (i as f32 + 0.5) * step;
        tau += density_along(sampler, &index_ray, t, 0.5 * step) * extinction_step;
        reached.push((i, tau));
        i = walk.next_step(i + 1, count);
    }
    let largest = 1.0 - (-tau).exp();

    let depth_of = |level: f32| {
        let target = -(1.0 - level).ln();
        let k = reached.partition_point(|&(_, tau)| tau < target);
        let Some(&(i, behind)) = reached.get(k) else { return exit };
        let before = if k == 0 { 0.0 } else { reached[k - 1].1 };
        let ends = [enter + i as f32 * step, enter + (i + 1) as f32 * step];
        crossing_depth(frame.methods[0], ends, target, [before, behind])
    };
    let thresholds = frame.thresholds.truncate();
    let paper = frame.methods[1] == 1;
    let depths = if paper {
        thresholds.map(|t| if t <= largest { depth_of(t) } else { exit })
    } else if largest > 0.0 {
        levels(largest, thresholds).map(depth_of)
    } else {
        Vec3::splat(exit)
    };
    depths.extend(largest).to_array()
}
