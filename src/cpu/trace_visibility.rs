//! Pass `trace_visibility`: turns the slabs of every texel's ray, in order, into points of
//! transmittance.

use super::tiles;
use super::trace_slices::trace_texel;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::media::Sampler;
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{Runs, VisibilityPoint, fit_visibility};

/// The points of all texels, row 0 at v = 0. The frame must ask for all nodes.
pub(super) fn trace_visibility(
    media: &Media,
    frame: &Frame,
    tolerance: f32,
    progress: &dyn Progress,
) -> Result<Runs<VisibilityPoint>> {
    let sampler = Sampler::of_extinction(media);
    let size = frame.map.size as usize;
    tiles::runs(size, progress, |columns, y| {
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        let (mut row, mut nodes, mut points) = (Runs::default(), Vec::new(), Vec::new());
        for x in columns {
            trace_texel(&sampler, frame, [at(x), at(y)], &mut nodes);
            fit_visibility(&nodes, tolerance, &mut points);
            row.push(&points)?;
        }
        Ok(row)
    })
}
