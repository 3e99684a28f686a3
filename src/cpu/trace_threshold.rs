//! Pass `trace_threshold`: marches from the light through every texel of the map.

use std::cell::Cell;

use glam::{Vec3, Vec4};

use super::raster_surfaces::SurfaceRaster;
use super::tiles;
use super::trace_slices::trace_texel as trace_nodes;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::fragments::Node;
use crate::kernel::light::{light_extent, light_ray};
use crate::kernel::media::{Sampler, density_along, four_along};
use crate::kernel::occupancy::{BATCH, Walk, cut_to_bend};
use crate::kernel::ray::{intersect_box, step_count, voxels_over};
use crate::kernel::threshold::{LARGEST_OPTICAL_DEPTH, crossing_depth, levels};
use crate::math::Each;
use crate::progress::Progress;
use crate::scene::Casters;

/// All texels, row 0 at v = 0: depths of three opacities and the largest opacity.
pub(super) fn trace_threshold(
    casters: Casters<'_>,
    frame: &Frame,
    progress: &dyn Progress,
) -> Result<Vec<[f32; 4]>> {
    let size = frame.map.size as usize;
    progress.begin("shadow map", size as u64);
    let sampler = Sampler::of_extinction(casters.media);
    let mut texels = vec![[0.0; 4]; size * size];
    let place = |place: [usize; 2]| place.each(|i| (i as f32 + 0.5) / size as f32);
    let Some(surfaces) = SurfaceRaster::new(casters, frame)? else {
        tiles::fill(&mut texels, size, progress, Vec::new, |batches, at| {
            trace_texel(&sampler, frame, place(at), batches)
        });
        return tiles::finished(progress).map(|()| texels);
    };
    // What surfaces leave stands between the medium's slabs, all of which are needed then.
    let (all, around) = (frame.with_all_slabs(), frame.around(casters));
    tiles::fill_tiles(&mut texels, size, progress, |columns, rows| {
        let lists = surfaces.tile(columns.clone(), rows.clone());
        let mut nodes = Vec::new();
        let places = rows.flat_map(|y| columns.clone().map(move |x| [x, y]));
        let texel = |(index, at): (usize, [usize; 2])| {
            trace_nodes(&sampler, &all, place(at), lists.of(index), &mut nodes);
            let [u, v] = place(at);
            of_nodes(frame, &nodes, light_extent(&around, u, v).1)
        };
        places.enumerate().map(texel).collect()
    });
    tiles::finished(progress).map(|()| texels)
}

/// The four numbers of a texel with these nodes, whose ray ends at `exit`.
fn of_nodes(frame: &Frame, nodes: &[Node], exit: f32) -> [f32; 4] {
    let Some(last) = nodes.last() else { return [0.0; 4] };
    let reached = |target: f32| {
        let k = nodes.partition_point(|node| node.optical_depth < target);
        match (k.checked_sub(1).and_then(|before| nodes.get(before)), nodes.get(k)) {
            (Some(a), Some(b)) => {
                let share = (target - a.optical_depth) / (b.optical_depth - a.optical_depth);
                a.depth + (b.depth - a.depth) * share
            }
            (None, Some(b)) => b.depth,
            (_, None) => exit,
        }
    };
    four_numbers(frame, 1.0 - (-last.optical_depth).exp(), exit, reached)
}

/// Four steps of a ray in sequence.
#[derive(Clone, Copy)]
struct Batch {
    /// Depth where they begin, and the length of each.
    begin: f32,
    step: f32,
    /// Optical depth in front of them, and that of each.
    before: f32,
    taus: Vec4,
}

impl Batch {
    /// Optical depths at the begin of each step, and at the end of the last one.
    fn reached(&self) -> [f32; 5] {
        let mut reached = [self.before; 5];
        for (i, tau) in self.taus.to_array().into_iter().enumerate() {
            reached[i + 1] = reached[i] + tau;
        }
        reached
    }

    /// The depth where the optical depth `wanted` is reached, which must be in the batch.
    fn depth_of(&self, crossing: u32, wanted: f32) -> f32 {
        let reached = self.reached();
        let [a, b, c, d] = self.taus.to_array();
        let bends = [b - a, 0.5 * (c - a), 0.5 * (d - b), d - c];
        let k = reached[1..4].partition_point(|&tau| tau < wanted);
        let ends = [k, k + 1].each(|i| self.begin + i as f32 * self.step);
        crossing_depth(crossing, ends, wanted, [reached[k], reached[k + 1]], bends[k])
    }
}

/// The four numbers of a texel. `batches` is scratch memory.
fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    batches: &mut Vec<Batch>,
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

    batches.clear();
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
        if taus.max_element() > 0.0 {
            let batch = Batch { begin: t, step, before: tau, taus };
            batches.push(batch);
            tau = batch.reached()[4];
        }
        t = walk.next_place(t + BATCH as f32 * step);
    }
    four_numbers(frame, 1.0 - (-tau).exp(), exit, |target| {
        let k = batches.partition_point(|batch| batch.reached()[4] < target);
        batches.get(k).map_or(exit, |batch| batch.depth_of(frame.map.crossing, target))
    })
}

/// The four numbers of a texel with the opacity `largest`, whose ray ends at `exit`; `reached` is
/// the depth where an optical depth is reached.
fn four_numbers(frame: &Frame, largest: f32, exit: f32, reached: impl Fn(f32) -> f32) -> [f32; 4] {
    let depth_of = |level: f32| reached(-(1.0 - level).ln());
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
