//! Whole pictures by one or more dispatches: in parts if they are large, so that no driver takes a
//! dispatch for a hung one, and with all rays of a pixel only where the picture of one ray each
//! bends (`rank_radiance`, `refine_view`).

use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{at, entry};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::renderer::{GpuImage, Renderer};
use super::shadow::GpuShadow;
use crate::error::Result;
use crate::frame::Frame;

/// Camera rays of a dispatch. Slow devices take up to a second for as many, and some drivers give
/// up after two.
const RAYS: u64 = 1 << 22;
/// Rows of a dispatch are a multiple of a workgroup's.
const ROWS: u32 = 8;

impl Renderer {
    /// Makes the picture of `frame` in `image`, lit through `shadow`.
    ///
    /// # Errors
    /// If the device rejects a shader or has not enough memory.
    pub(super) fn picture(
        &self,
        media: &GpuMedia,
        frame: &Frame,
        shadow: GpuShadow<'_>,
        image: &GpuImage,
    ) -> Result<()> {
        if frame.view.samples == 1 || frame.view.tolerance <= 0.0 {
            return self.rows(shadow.march(), media, frame, shadow, (&[], image));
        }
        let mut first = *frame;
        first.view.samples = 1;
        let [width, height] = image.size();
        let single = self.image(width, height)?;
        self.rows(shadow.march(), media, &first, shadow, (&[], &single))?;
        let bright = self.storage("bright", 4);
        let single = entry(at::SINGLE, BindingResource::TextureView(single.view()));
        let more = [single, entry(at::BRIGHT, bright.as_entire_binding())];
        let rank = self.prepare(Pass::RankRadiance, MediaKind::Plain, None, more.to_vec(), [1, 1]);
        self.submit(|encoder| rank.record(encoder))?;
        self.rows(shadow.refine(), media, frame, shadow, (&more, image))
    }

    /// Runs a pass over all rows of a picture, with `more` bindings.
    fn rows(
        &self,
        pass: Pass,
        media: &GpuMedia,
        frame: &Frame,
        shadow: GpuShadow<'_>,
        (more, image): (&[BindGroupEntry<'_>], &GpuImage),
    ) -> Result<()> {
        let [width, height] = image.size();
        let rays = u64::from(width) * u64::from(frame.view.samples);
        let rows = u32::try_from(RAYS / rays).unwrap_or(height).max(1).next_multiple_of(ROWS);
        let mut part = *frame;
        for first in (0..height).step_by(rows as usize) {
            part.view.first_row = first;
            let part = self.frame(&part, media)?;
            let size = [width, rows.min(height - first)];
            let prepared = self.prepare_rows(pass, (media, &part), shadow, (more, image), size);
            self.submit(|encoder| prepared.record(encoder))?;
        }
        Ok(())
    }
}
