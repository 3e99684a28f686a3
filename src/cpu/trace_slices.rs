//! Pass `trace_slices`: turns the slabs of every texel's ray, in order, into nodes.

use std::cell::Cell;

use glam::Vec4;

use super::raster_surfaces::SurfaceRaster;
use super::tiles;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::fitting::Fitter;
use crate::kernel::fragments::Node;
use crate::kernel::media::Sampler;
use crate::kernel::occupancy::{LEAST_SHARE, Walk, cut_to_bend};
use crate::kernel::slices::{batch_of, end_optical_depth, four_optical_depths, slabs_of};
use crate::progress::Progress;
use crate::scene::Casters;
use crate::shadow::{Fragment, Merged, Runs, truncate};

/// The nodes of all texels, row 0 at v = 0.
pub(super) fn trace_slices(
    casters: Casters<'_>,
    frame: &Frame,
    progress: &dyn Progress,
) -> Result<Runs> {
    trace_lists(casters, frame, progress, |nodes, row: &mut Runs| row.push(nodes))
}

/// The lists that `keep` makes of the nodes of all texels, row 0 at v = 0.
pub(super) fn trace_lists<T: Copy + Default + Send>(
    casters: Casters<'_>,
    frame: &Frame,
    progress: &dyn Progress,
    keep: impl Fn(&[Node], &mut Runs<T>) -> Result<()> + Sync,
) -> Result<Runs<T>> {
    let sampler = Sampler::of_extinction(casters.media);
    let surfaces = SurfaceRaster::new(casters, frame)?;
    let size = frame.map.size as usize;
    tiles::runs(size, progress, |columns, rows| {
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        let of_tile = surfaces.as_ref().map(|all| all.tile(columns.clone(), rows.clone()));
        let pieces = |x: usize, y: usize| {
            let texel = (y - rows.start) * columns.len() + x - columns.start;
            of_tile.as_ref().map_or(&[][..], |lists| lists.of(texel))
        };
        let mut nodes = Vec::new();
        let row = |y: usize| {
            let mut row = Runs::default();
            for x in columns.clone() {
                trace_texel(&sampler, frame, [at(x), at(y)], pieces(x, y), &mut nodes);
                keep(&nodes, &mut row)?;
            }
            Ok(row)
        };
        rows.clone().map(row).collect()
    })
}

/// Replaces the contents of `nodes` by those of one texel, on whose ray surfaces leave `pieces`.
pub(super) fn trace_texel(
    sampler: &Sampler<'_>,
    frame: &Frame,
    [u, v]: [f32; 2],
    pieces: &[Fragment],
    nodes: &mut Vec<Node>,
) {
    let (tolerance, truncation) = (frame.map.tolerance, frame.map.truncation);
    let slabs = slabs_of(frame, u, v);
    let mut fitter = Fitter::new(tolerance);
    let mut surfaces = Merged::new(pieces);
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
        let bounds = [batch.fronts, batch.backs];
        if surfaces.none_before(batch.backs.w) {
            fitter.add_four(bounds, optical_depths, &mut |node| nodes.push(node));
        } else {
            add_merged(&mut fitter, &mut surfaces, bounds, optical_depths, nodes);
        }
        if fitter.is_dark() {
            break;
        }
        t = walk.next_place(batch.end.max(t + LEAST_SHARE * slabs.exit));
    }
    if !fitter.is_dark() {
        surfaces.up_to(f32::INFINITY, |bounds, tau| {
            if !fitter.is_dark() {
                fitter.add_surface(bounds, tau, &mut |node| nodes.push(node));
            }
        });
    }
    fitter.finish(&mut |node| nodes.push(node));
    if tolerance == 0.0 {
        truncate(nodes, truncation);
    }
}

/// Adds four slabs and the surfaces' pieces in front of and among them, in order.
fn add_merged(
    fitter: &mut Fitter,
    surfaces: &mut Merged<'_>,
    [fronts, backs]: [Vec4; 2],
    optical_depths: Vec4,
    nodes: &mut Vec<Node>,
) {
    let mut add = |bounds: [f32; 2], tau: f32| {
        if !fitter.is_dark() {
            fitter.add(bounds, tau, &mut |node| nodes.push(node));
        }
    };
    for k in 0..4 {
        if backs[k] > fronts[k] {
            surfaces.up_to(fronts[k], &mut add);
            surfaces.through([fronts[k], backs[k]], optical_depths[k], &mut add);
        }
    }
}
