//! Surfaces on a device: passes `raster_surfaces`, `raster_large` and `sort_surfaces`, which turn
//! strands and triangles into what they leave in a map's texels.

use bytemuck::cast_slice;
use wgpu::{BindGroupEntry, BufferUsages};

use super::bindings::{at, entry};
use super::link::MediaKind;
use super::lists::record_drawing;
use super::passes::Pass;
use super::renderer::{GpuFrame, Renderer};
use super::tile::Tile;
use crate::error::{Error, ErrorKind, Result};
use crate::frame::FrameSurfaces;

/// Bytes of a part: key, front, back, area, optical depth, next; four bytes each.
const PART_BYTES: u64 = 24;
/// Bytes of a piece: front, back, optical depth and what alignment adds.
const PIECE_BYTES: u64 = 16;
/// Bytes that a part takes in the largest buffer: two pieces may be made of it.
pub(super) const ROOM_BYTES: u64 = 2 * PIECE_BYTES;
/// Bytes of the counters of parts, of pieces and of large surfaces.
const COUNTER_BYTES: u64 = 16;
/// Workgroups of pass `raster_large`: as many share a surface's rows, and as many surfaces are drawn
/// at a time.
const LARGE_GROUPS: [u32; 2] = [64, 64];
/// The most workgroups along an axis that WebGPU guarantees.
const MOST_GROUPS: u32 = 65_535;

/// Strands and triangles on a device.
#[derive(Clone, Debug)]
pub struct GpuSurfaces {
    points: wgpu::Buffer,
    opacities: wgpu::Buffer,
    segments: wgpu::Buffer,
    corners: wgpu::Buffer,
    /// How many segments and triangles there are.
    counts: [u32; 2],
}

impl GpuSurfaces {
    pub(super) fn entries(&self) -> [BindGroupEntry<'_>; 4] {
        [
            entry(at::POINTS, self.points.as_entire_binding()),
            entry(at::OPACITIES, self.opacities.as_entire_binding()),
            entry(at::SEGMENTS, self.segments.as_entire_binding()),
            entry(at::CORNERS, self.corners.as_entire_binding()),
        ]
    }

    /// `tile`, with the numbers of surfaces that a pass draws into it.
    fn over(&self, tile: Tile) -> Tile {
        let [segments, triangles] = self.counts;
        Tile { segments, triangles, ..tile }
    }

    fn count(&self) -> u32 {
        self.counts[0] + self.counts[1]
    }
}

/// The linked lists of what surfaces leave in the texels of a tile.
#[derive(Clone, Debug)]
pub struct GpuParts {
    tile: Tile,
    tile_buffer: wgpu::Buffer,
    heads: wgpu::Buffer,
    parts: wgpu::Buffer,
    counters: wgpu::Buffer,
    large: wgpu::Buffer,
    runs: wgpu::Buffer,
    pieces: wgpu::Buffer,
}

impl GpuParts {
    fn entries(&self) -> Vec<BindGroupEntry<'_>> {
        vec![
            entry(at::TILE, self.tile_buffer.as_entire_binding()),
            entry(at::HEADS, self.heads.as_entire_binding()),
            entry(at::PARTS, self.parts.as_entire_binding()),
            entry(at::COUNTERS, self.counters.as_entire_binding()),
        ]
    }

    /// The tile whose texels' lists these are.
    pub fn tile(&self) -> Tile {
        self.tile
    }

    /// The pieces that pass `sort_surfaces` made.
    pub(super) fn pieces_entries(&self) -> [BindGroupEntry<'_>; 2] {
        [
            entry(at::PIECE_RUNS, self.runs.as_entire_binding()),
            entry(at::PIECES, self.pieces.as_entire_binding()),
        ]
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
        let limit = self.largest_binding();
        if let Some((what, bytes)) = held.iter().find(|(_, bytes)| bytes.len() as u64 > limit) {
            let (what, needed) = ((*what).to_owned(), format!("{} bytes", bytes.len()));
            let limit = format!("{limit} bytes in a buffer (the CPU backend has no limit)");
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
        let counts = [segments.len(), triangles.len()].map(|count| count as u32);
        let upload = |(label, bytes): (&str, &[u8])| match bytes {
            // Bindings must not be empty.
            [] => self.storage(label, 0),
            _ => self.buffer(label, bytes, BufferUsages::STORAGE),
        };
        let [points, opacities, segments, corners] =
            self.scoped(|| held.map(upload)).map_err(Error::gpu)?;
        Ok(GpuSurfaces { points, opacities, segments, corners, counts })
    }

    /// Allocates lists of what `surfaces` leave in the texels of a tile, with room for
    /// `tile.capacity` parts in all.
    pub fn parts(&self, tile: Tile, surfaces: &GpuSurfaces) -> GpuParts {
        let tile = surfaces.over(tile);
        GpuParts {
            tile,
            tile_buffer: self.tile_buffer(tile),
            heads: self.storage("heads", tile.texels() * 4),
            parts: self.storage("parts", u64::from(tile.capacity) * PART_BYTES),
            counters: self.storage("counters", COUNTER_BYTES),
            large: self.storage("large surfaces", u64::from(surfaces.count()) * 4),
            runs: self.storage("runs of pieces", tile.texels() * 8),
            pieces: self.storage("pieces", u64::from(tile.capacity) * ROOM_BYTES),
        }
    }

    /// Records passes `raster_surfaces` and `raster_large`, which fill empty lists for the light of
    /// `frame`.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn raster_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &GpuSurfaces,
        frame: &GpuFrame,
        parts: &GpuParts,
    ) -> Result<()> {
        encoder.clear_buffer(&parts.heads, 0, None);
        encoder.clear_buffer(&parts.counters, 0, None);
        let entries = || {
            let mut entries = parts.entries();
            entries.extend(surfaces.entries());
            entries.push(entry(at::LARGE, parts.large.as_entire_binding()));
            entries
        };
        let [threads, _] = Pass::RasterSurfaces.declaration().workgroup;
        let across = MOST_GROUPS * threads;
        let count = surfaces.count().max(1);
        let all = [count.min(across), count.div_ceil(across)];
        let large = [LARGE_GROUPS[0] * threads, LARGE_GROUPS[1]];
        for (pass, size) in [(Pass::RasterSurfaces, all), (Pass::RasterLarge, large)] {
            self.prepare(pass, MediaKind::Plain, Some(frame), entries(), size).record(encoder)?;
        }
        Ok(())
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
        parts: &GpuParts,
    ) -> Result<()> {
        encoder.clear_buffer(&parts.heads, 0, None);
        encoder.clear_buffer(&parts.counters, 0, None);
        let pass = (Pass::DrawSurfaces, "surface");
        let program = self.programs.raster(pass, MediaKind::Plain)?;
        let mut entries = parts.entries();
        entries.extend(surfaces.entries());
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        let bind_group = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw_surfaces"),
            layout: &program.layout,
            entries: &entries,
        });
        let target = ("draw_surfaces", &self.no_target(parts.tile));
        record_drawing(encoder, target, &program, &bind_group, (6, surfaces.count()));
        Ok(())
    }

    /// Records pass `sort_surfaces`, which turns the lists into pieces for
    /// [`Renderer::prepare_casters`]. It reorders the lists.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn sort_surfaces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &GpuFrame,
        parts: &GpuParts,
    ) -> Result<()> {
        let mut entries = parts.entries();
        entries.extend(parts.pieces_entries());
        let extent = parts.tile.extent;
        self.prepare(Pass::SortSurfaces, MediaKind::Plain, Some(frame), entries, extent)
            .record(encoder)
    }

    /// Waits for the lists' pass and returns how many parts were left. If they exceed
    /// `tile.capacity`, the rest is missing, and the pass must run again with room for all.
    ///
    /// # Errors
    /// If the device fails.
    pub fn parts_drawn(&self, parts: &GpuParts) -> Result<u32> {
        let counters: Vec<u32> = self.read_buffer(&parts.counters, COUNTER_BYTES)?;
        counters.first().copied().ok_or_else(|| Error::gpu("no counter was read back"))
    }
}
