//! Surfaces on a device: passes `raster_surfaces`, `raster_large`, `draw_surfaces` and
//! `sort_surfaces`, which list what strands and triangles leave in a map's texels.

use bytemuck::cast_slice;
use wgpu::BindGroupEntry;

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::lists::{ELEMENT_BYTES, GpuLists};
use super::media::GpuMedia;
use super::passes::Pass;
use super::renderer::{GpuFrame, Renderer};
use super::tile::Tile;
use super::tiles::{Room, filled};
use crate::error::{Error, ErrorKind, Result};
use crate::frame::FrameSurfaces;
use crate::scene::Casters;

/// Workgroups of pass `raster_large`: as many share a surface's rows, and as many surfaces are drawn
/// at a time.
const LARGE_GROUPS: [u32; 2] = [64, 64];
/// Initial capacity of what surfaces leave, in fragments per texel.
const FRAGMENTS: u64 = 8;
/// The most workgroups along an axis that WebGPU guarantees.
const MOST_GROUPS: u32 = 65_535;

/// What the two passes that draw surfaces into lists need.
pub(super) struct Drawing<'a> {
    /// With one thread for each surface, and with many for each of the rest.
    pub passes: [Pass; 2],
    /// How many surfaces there are.
    pub count: u32,
    /// The surfaces' bindings.
    pub own: &'a [BindGroupEntry<'a>],
    /// Room for the numbers of the rest.
    pub large: &'a wgpu::Buffer,
}

/// Strands and triangles on a device.
#[derive(Clone, Debug)]
pub struct GpuSurfaces {
    points: wgpu::Buffer,
    opacities: wgpu::Buffer,
    segments: wgpu::Buffer,
    corners: wgpu::Buffer,
    /// Room for the numbers of all that are left to pass `raster_large`.
    large: wgpu::Buffer,
    /// How many segments and triangles there are.
    counts: [u32; 2],
}

impl GpuSurfaces {
    fn entries(&self) -> [BindGroupEntry<'_>; 4] {
        [
            entry(at::POINTS, self.points.as_entire_binding()),
            entry(at::OPACITIES, self.opacities.as_entire_binding()),
            entry(at::SEGMENTS, self.segments.as_entire_binding()),
            entry(at::CORNERS, self.corners.as_entire_binding()),
        ]
    }

    /// A tile for lists into which these surfaces are drawn.
    pub fn over(&self, tile: Tile) -> Tile {
        let [segments, triangles] = self.counts;
        Tile { segments, triangles, ..tile }
    }

    /// What they leave in the first rows of a tile, of which all finds room ([`filled`]).
    pub(super) async fn listed(
        &self,
        gpu: &Renderer,
        frame: &GpuFrame,
        tile: Tile,
        most: u64,
        room: &mut Room,
    ) -> Result<GpuLists> {
        let make = |tile| gpu.lists(self.over(tile));
        filled(gpu, (tile, FRAGMENTS, ELEMENT_BYTES), most, room, make, |encoder, lists| {
            gpu.raster_surfaces(encoder, self, frame, lists)
        })
        .await
    }

    fn count(&self) -> u32 {
        self.counts[0] + self.counts[1]
    }
}

impl Renderer {
    /// Uploads surfaces to the device.
    ///
    /// # Errors
    /// If they exceed the device's largest buffer binding, or if it has not enough memory.
    pub fn upload_surfaces(&self, surfaces: &FrameSurfaces) -> Result<GpuSurfaces> {
        let FrameSurfaces { points, opacities, segments, triangles } = surfaces;
        let held: [(&str, &[u8]); 4] = [
            ("points of hair", cast_slice(points)),
            ("opacities of hair", cast_slice(opacities)),
            ("segments of hair", cast_slice(segments)),
            ("triangles", cast_slice(triangles)),
        ];
        self.check_bindings(&held)?;
        let counts = [segments.len(), triangles.len()].map(|count| count as u32);
        let [points, opacities, segments, corners] = self
            .scopes
            .scoped(Error::gpu, || held.map(|(label, bytes)| self.storage_of(label, bytes)))?;
        let large = self.storage("large surfaces", u64::from(counts[0] + counts[1]) * 4);
        Ok(GpuSurfaces { points, opacities, segments, corners, large, counts })
    }

    /// Uploads the surfaces that cast shadows, if there are some.
    ///
    /// # Errors
    /// As [`Renderer::upload_surfaces`].
    pub(super) fn casting(&self, casters: Casters<'_>) -> Result<Option<GpuSurfaces>> {
        if casters.surfaces.iter().all(|surface| !surface.casts) {
            return Ok(None);
        }
        self.upload_surfaces(&FrameSurfaces::of(casters)).map(Some)
    }

    /// Records passes `raster_surfaces` and `raster_large`, which fill empty lists for the light of
    /// `frame`. The lists' tile is one of [`GpuSurfaces::over`].
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn raster_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &GpuSurfaces,
        frame: &GpuFrame,
        lists: &GpuLists,
    ) -> Result<()> {
        let drawing = Drawing {
            passes: [Pass::RasterSurfaces, Pass::RasterLarge],
            count: surfaces.count(),
            own: &surfaces.entries(),
            large: &surfaces.large,
        };
        self.record_raster(encoder, &drawing, frame, lists)
    }

    /// Records the two passes of `drawing`, which fill empty lists.
    pub(super) fn record_raster(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        drawing: &Drawing<'_>,
        frame: &GpuFrame,
        lists: &GpuLists,
    ) -> Result<()> {
        lists.clear(encoder);
        let entries = || {
            let mut entries = lists.entries();
            entries.extend_from_slice(drawing.own);
            entries.push(entry(at::LARGE, drawing.large.as_entire_binding()));
            entries
        };
        let [threads, _] = drawing.passes[0].declaration().workgroup;
        let across = MOST_GROUPS * threads;
        let count = drawing.count.max(1);
        let all = [count.min(across), count.div_ceil(across)];
        let large = [LARGE_GROUPS[0] * threads, LARGE_GROUPS[1]];
        for (pass, size) in drawing.passes.into_iter().zip([all, large]) {
            self.prepare(pass, MediaKind::Plain, Some(frame), entries(), size).record(encoder)?;
        }
        Ok(())
    }

    /// Records a pass over the texels of a tile's lists.
    pub(super) fn record_over(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        lists: &GpuLists,
    ) -> Result<()> {
        let extent = lists.tile().extent;
        self.prepare(pass, MediaKind::Plain, None, lists.entries(), extent).record(encoder)
    }

    /// Checks that buffers with these contents can be bound.
    pub(super) fn check_bindings(&self, held: &[(&str, &[u8])]) -> Result<()> {
        let limit = self.largest_binding();
        let Some((what, bytes)) = held.iter().find(|(_, bytes)| bytes.len() as u64 > limit) else {
            return Ok(());
        };
        let (what, needed) = ((*what).to_owned(), format!("{} bytes", bytes.len()));
        let limit = format!("{limit} bytes in a buffer (the CPU backend has no limit)");
        Err(ErrorKind::Limit { what, needed, limit }.into())
    }

    /// Records pass `draw_surfaces`, which does the same by the graphics pipeline.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn draw_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &GpuSurfaces,
        frame: &GpuFrame,
        lists: &GpuLists,
    ) -> Result<()> {
        lists.clear(encoder);
        let program = self.programs.raster((Pass::DrawSurfaces, "surface"), MediaKind::Plain)?;
        let mut entries = lists.entries();
        entries.extend(surfaces.entries());
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        let bind_group = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw_surfaces"),
            layout: &program.layout,
            entries: &entries,
        });
        lists.record_drawing(self, encoder, &program, &bind_group, (6, surfaces.count()));
        Ok(())
    }

    /// Records pass `sort_surfaces`, which sorts the lists for [`Renderer::prepare_casters`].
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn sort_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        lists: &GpuLists,
    ) -> Result<()> {
        self.record_over(encoder, Pass::SortSurfaces, lists)
    }

    /// Records pass `trace_slices`, and `sort_surfaces` before it if there are `lists` of surfaces.
    pub(super) fn trace_casters(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        lists: Option<&GpuLists>,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Result<()> {
        let Some(lists) = lists else {
            return self.trace_slices(encoder, media, frame, fragments);
        };
        self.sort_surfaces(encoder, lists)?;
        self.prepare_casters(media, lists, frame, fragments).record(encoder)
    }
}
