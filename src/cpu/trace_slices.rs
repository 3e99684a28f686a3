//! Pass `trace_slices`: every slab of every texel's ray, in order, into nodes.

use rayon::prelude::*;

use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::fitting::Fitter;
use crate::kernel::fragments::Node;
use crate::kernel::media::Sampler;
use crate::kernel::occupancy::{BATCH, Walk};
use crate::kernel::slices::{four_optical_depths, joined_bounds, slabs_of};
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{Runs, truncate};

/// Nodes of all texels, row 0 at v = 0.
pub(super) fn trace_slices(media: &Media, frame: &Frame, progress: &dyn Progress) -> Result<Runs> {
    let sampler = Sampler::of(media);
    by_rows(frame, progress, |y| {
        let size = frame.sizes[3];
        let at = |i: u32| (i as f32 + 0.5) / size as f32;
        let mut row = Runs::default();
        let mut nodes = Vec::new();
        for x in 0..size {
            trace_texel(&sampler, frame, [at(x), at(y)], &mut nodes);
            row.push(&nodes)?;
        }
        Ok(row)
    })
}

/// The rows of a map, made by all threads, one after the other.
pub(super) fn by_rows<T: Copy + Default + Send>(
    frame: &Frame,
    progress: &dyn Progress,
    row: impl Fn(u32) -> Result<Runs<T>> + Sync,
) -> Result<Runs<T>> {
    let size = frame.sizes[3];
    progress.begin("shadow map", u64::from(size));
    let rows: Vec<Result<Runs<T>>> = (0..size)
        .into_par_iter()
        .map(|y| {
            let runs = row(y);
            progress.advance(1);
            runs
        })
        .collect();
    let mut all = Runs::default();
    for row in rows {
        all.append(&row?)?;
    }
    Ok(all)
}

/// One texel's nodes, in place of what `nodes` held.
pub(super) fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    nodes: &mut Vec<Node>,
) {
    let [.., tolerance, truncation] = frame.slices.to_array();
    let slabs = slabs_of(frame, u, v);
    let mut fitter = Fitter::new(tolerance);
    nodes.clear();
    let mut walk =
        Walk::new(sampler.occupancy, frame, &slabs.ray, [slabs.start, slabs.step], frame.lengths.y);
    let mut next = slabs.first;
    'ray: loop {
        let (i, joined) = walk.next_step(next, slabs.last);
        if i >= slabs.last {
            break;
        }
        next = i + BATCH * joined;
        let optical_depths = four_optical_depths(sampler, frame, &slabs, i, joined).to_array();
        for (k, optical_depth) in (0..).zip(optical_depths) {
            let begin = i + k * joined;
            if begin < slabs.last && optical_depth > 0.0 {
                let bounds = joined_bounds(&slabs, begin, joined);
                fitter.add(bounds, optical_depth, &mut |node| nodes.push(node));
                if fitter.is_dark() {
                    break 'ray;
                }
            }
        }
    }
    fitter.finish(&mut |node| nodes.push(node));
    if tolerance == 0.0 {
        truncate(nodes, truncation);
    }
}
