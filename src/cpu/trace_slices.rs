//! Pass `trace_slices`: turns the slabs of every texel's ray, in order, into nodes.

use std::cell::Cell;

use super::tiles;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::fitting::Fitter;
use crate::kernel::fragments::Node;
use crate::kernel::media::Sampler;
use crate::kernel::occupancy::{LEAST_SHARE, Walk, cut_to_bend};
use crate::kernel::slices::{batch_of, end_optical_depth, four_optical_depths, slabs_of};
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{Runs, truncate};

/// The nodes of all texels, row 0 at v = 0.
pub(super) fn trace_slices(media: &Media, frame: &Frame, progress: &dyn Progress) -> Result<Runs> {
    let sampler = Sampler::of_extinction(media);
    let size = frame.map.size as usize;
    tiles::runs(size, progress, |columns, y| {
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        let (mut row, mut nodes) = (Runs::default(), Vec::new());
        for x in columns {
            trace_texel(&sampler, frame, [at(x), at(y)], &mut nodes);
            row.push(&nodes)?;
        }
        Ok(row)
    })
}

/// Replaces the contents of `nodes` by those of one texel.
pub(super) fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    nodes: &mut Vec<Node>,
) {
    let (tolerance, truncation) = (frame.map.tolerance, frame.map.truncation);
    let slabs = slabs_of(frame, u, v);
    let mut fitter = Fitter::new(tolerance);
    nodes.clear();
    let lengths = [slabs.step, frame.map.slabs.rough, frame.map.slabs.longest];
    // The last slab between planes may be as thin as rounding allows.
    let thin = if frame.map.planes > 0 { 2.0 * LEAST_SHARE } else { 0.0 };
    let end = slabs.exit * (1.0 + thin);
    let mut walk = Walk::new(sampler.occupancy, &slabs.ray, end, lengths);
    let (mut t, mut next) = (walk.next_place(slabs.enter), slabs.first as f32);
    let met = Cell::default();
    while t < slabs.exit {
        let of = |step: f32| batch_of(frame, &slabs, t, step, next);
        let depths = |step: f32| four_optical_depths(sampler, frame, &slabs, &of(step), &met);
        // Slabs between planes have a fixed length, so nothing is shortened there.
        let bend = if frame.map.planes > 0 { f32::INFINITY } else { frame.map.slabs.limit };
        let limits = [bend, fitter.optical_depth()];
        let end = |step: f32| end_optical_depth(sampler, frame, &slabs, &of(step));
        let (step, optical_depths) = cut_to_bend(&walk, walk.step_from(t), limits, depths, end);
        let batch = of(step);
        next = batch.next;
        fitter.add_four([batch.fronts, batch.backs], optical_depths, &mut |node| nodes.push(node));
        if fitter.is_dark() {
            break;
        }
        t = walk.next_place(batch.end.max(t + LEAST_SHARE * slabs.exit));
    }
    fitter.finish(&mut |node| nodes.push(node));
    if tolerance == 0.0 {
        truncate(nodes, truncation);
    }
}
