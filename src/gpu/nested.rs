//! Maps of nested knots on a device: pass `code_nested`, upload and readback.

use wgpu::BindGroupEntry;

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::prepared::Prepared;
use super::renderer::{GpuFrame, Renderer};
use super::tiles;
use crate::error::{ErrorKind, Result};
use crate::frame::Frame;
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::{CodedMap, TexelMap};

/// Bytes of a texel.
const BYTES: u64 = 16;
/// The tolerance of the lists that are coded, in transmittance: the code adds three times as much
/// error, and with all slabs it adds no less.
const TOLERANCE: f32 = 0.0005;

/// A map of nested knots on a device.
#[derive(Clone, Debug)]
pub struct GpuNested {
    size: u32,
    words: wgpu::Buffer,
    extents: wgpu::Buffer,
}

impl GpuNested {
    /// Texels along each edge.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// A storage buffer with four u32 for each texel, row by row, row 0 at v = 0.
    pub fn words(&self) -> &wgpu::Buffer {
        &self.words
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        self.words.size() + self.extents.size()
    }

    /// The buffers that lookups read: the codes, and where each texel's ray enters and leaves the
    /// media. Rays tell that too, but take up to a quarter of a picture's time.
    pub(super) fn entries(&self) -> [BindGroupEntry<'_>; 2] {
        [
            entry(at::CODED, self.words.as_entire_binding()),
            entry(at::EXTENTS, self.extents.as_entire_binding()),
        ]
    }
}

/// The frame for which lists are traced that are coded then: `frame` with a smaller tolerance.
pub fn frame_of_nested(frame: &Frame) -> Frame {
    let mut frame = *frame;
    frame.map.tolerance = frame.map.tolerance.min(TOLERANCE);
    frame.map.truncation = frame.map.truncation.min(TOLERANCE);
    frame
}

impl Renderer {
    /// Allocates a map of `size` squared texels of nested knots, for pass `code_nested` to fill.
    ///
    /// # Errors
    /// If it exceeds the device's largest buffer binding.
    pub fn nested(&self, size: u32) -> Result<GpuNested> {
        let (bytes, limit) = (BYTES * u64::from(size).pow(2), self.largest_binding());
        if bytes > limit {
            let (what, needed) = ("map".to_owned(), format!("{bytes} bytes"));
            let limit = format!("{limit} bytes in a buffer");
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
        let [words, extents] = [("coded", bytes), ("extents", bytes / 2)]
            .map(|(label, bytes)| self.storage(label, bytes));
        Ok(GpuNested { size, words, extents })
    }

    /// Uploads a map, which must be one of nested knots.
    ///
    /// # Errors
    /// If it exceeds the device's largest buffer binding.
    pub fn upload_nested(&self, map: &CodedMap) -> Result<GpuNested> {
        let nested = self.nested(map.size())?;
        self.queue().write_buffer(&nested.words, 0, map.texels());
        self.queue().write_buffer(&nested.extents, 0, bytemuck::cast_slice(map.extents()));
        Ok(nested)
    }

    /// Prepares pass `code_nested`, which codes the lists of a tile, or of all texels. They are best
    /// traced for [`frame_of_nested`].
    pub fn prepare_nested(
        &self,
        frame: &GpuFrame,
        lists: &GpuFragments,
        map: &GpuNested,
    ) -> Prepared {
        let [runs, nodes, _] = lists.lookup_entries();
        let tile = entry(at::TILE, lists.tile_buffer.as_entire_binding());
        let [coded, extents] = map.entries();
        let entries = vec![runs, nodes, tile, coded, extents];
        self.prepare(Pass::CodeNested, MediaKind::Plain, Some(frame), entries, lists.tile.extent)
    }

    /// The map of media: passes `trace_slices` and `code_nested`, tile by tile.
    pub(super) async fn coded(
        &self,
        media: (&Media, &GpuMedia),
        frame: &Frame,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<GpuNested> {
        let map = self.nested(frame.map.size)?;
        let frame = frame_of_nested(frame);
        tiles::code_nested(self, media, &frame, &map, memory, progress).await?;
        Ok(map)
    }
}
