//! Pass `trace_visibility`: turns the slabs of every texel's ray, in order, into points of
//! transmittance.

use super::trace_slices::trace_lists;
use crate::error::Result;
use crate::frame::Frame;
use crate::progress::Progress;
use crate::scene::Casters;
use crate::shadow::{Runs, VisibilityPoint, fit_visibility};

/// The points of all texels, row 0 at v = 0. The frame must ask for all nodes.
pub(super) fn trace_visibility(
    casters: Casters<'_>,
    frame: &Frame,
    tolerance: f32,
    progress: &dyn Progress,
) -> Result<Runs<VisibilityPoint>> {
    trace_lists(casters, frame, progress, |nodes, row| {
        let mut points = Vec::new();
        fit_visibility(nodes, tolerance, &mut points);
        row.push(&points)
    })
}
