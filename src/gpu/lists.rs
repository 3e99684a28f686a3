//! Linked lists of fragments, and passes `raster_slices` and `sort_fragments`: planes are drawn into
//! lists, which become nodes.

use wgpu::BindGroupEntry;

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::programs::RasterProgram;
use super::renderer::{GpuFrame, Renderer};
use super::tile::Tile;
use crate::error::{Error, Result};

/// Bytes of an element: front, back, optical depth, next; four bytes each.
pub(super) const ELEMENT_BYTES: u64 = 16;

/// Bytes of the counters of lists.
const COUNTERS_BYTES: u64 = 16;

/// What lists hold.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    /// Bytes of an element.
    pub bytes: u64,
    /// Lists of each texel.
    pub heads: u64,
}

/// The linked lists of a tile on a device.
#[derive(Clone, Debug)]
pub struct GpuLists {
    tile: Tile,
    tile_buffer: wgpu::Buffer,
    heads: wgpu::Buffer,
    elements: wgpu::Buffer,
    counters: wgpu::Buffer,
}

impl GpuLists {
    /// The tile whose texels' lists these are.
    pub fn tile(&self) -> Tile {
        self.tile
    }

    pub(super) fn entries(&self) -> Vec<BindGroupEntry<'_>> {
        vec![
            entry(at::TILE, self.tile_buffer.as_entire_binding()),
            entry(at::HEADS, self.heads.as_entire_binding()),
            entry(at::ELEMENTS, self.elements.as_entire_binding()),
            entry(at::COUNTERS, self.counters.as_entire_binding()),
        ]
    }

    /// The lists of texels alone.
    pub(super) fn sorted_entries(&self) -> [BindGroupEntry<'_>; 2] {
        [
            entry(at::HEADS, self.heads.as_entire_binding()),
            entry(at::ELEMENTS, self.elements.as_entire_binding()),
        ]
    }

    /// What passes read that march through pictures.
    pub(super) fn seen_entries(&self) -> [BindGroupEntry<'_>; 3] {
        let [heads, elements] = self.sorted_entries();
        [entry(at::TILE, self.tile_buffer.as_entire_binding()), heads, elements]
    }

    /// Empties the lists.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.heads, 0, None);
        encoder.clear_buffer(&self.counters, 0, None);
    }

    /// Records a pass that draws a number of corners, so many times.
    pub(super) fn record_drawing(
        &self,
        gpu: &Renderer,
        encoder: &mut wgpu::CommandEncoder,
        program: &RasterProgram,
        bind_group: &wgpu::BindGroup,
        (corners, times): (u32, u32),
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("lists"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &gpu.no_target(self.tile),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&program.pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        pass.draw(0..corners, 0..times);
    }
}

impl Renderer {
    /// Allocates lists with room for `tile.capacity` fragments in all.
    pub fn lists(&self, tile: Tile) -> GpuLists {
        self.lists_of(tile, Kind { bytes: ELEMENT_BYTES, heads: 1 })
    }

    /// The same for lists of any kind.
    pub(super) fn lists_of(&self, tile: Tile, kind: Kind) -> GpuLists {
        GpuLists {
            tile,
            tile_buffer: self.tile_buffer(tile),
            heads: self.storage("heads", tile.texels() * kind.heads * 4),
            elements: self.storage("elements", u64::from(tile.capacity) * kind.bytes),
            counters: self.storage("counters", COUNTERS_BYTES),
        }
    }

    /// Records pass `raster_slices`, which draws `planes` planes through the volume into empty
    /// lists.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn raster_slices(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        planes: u32,
        lists: &GpuLists,
    ) -> Result<()> {
        let program = self.programs.raster((Pass::RasterSlices, "plane"), media.kind())?;
        let mut entries = self.media_entries(media);
        entries.extend(lists.entries());
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        let bind_group = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("raster_slices"),
            layout: &program.layout,
            entries: &entries,
        });
        lists.clear(encoder);
        lists.record_drawing(self, encoder, &program, &bind_group, (3, planes));
        Ok(())
    }

    /// Waits for the lists' pass and returns how many fragments were drawn. If they exceed
    /// `tile.capacity`, the rest is missing, and the pass must run again with room for all.
    ///
    /// # Errors
    /// If the device fails.
    pub async fn fragments_drawn_async(&self, lists: &GpuLists) -> Result<u64> {
        let counters: Vec<u32> = self.read_buffer(&lists.counters, COUNTERS_BYTES).await?;
        let [drawn, .., of_256] = counters[..] else {
            return Err(Error::gpu("no counter was read back"));
        };
        // The first counter begins anew after 32 bits.
        let roughly = u64::from(of_256) * 256;
        let most = u64::from(u32::MAX);
        Ok(if roughly > most / 2 { roughly.max(most) } else { u64::from(drawn) })
    }

    /// Records pass `sort_fragments`, which turns the `drawn` fragments of `lists` into nodes. It
    /// reorders the lists.
    ///
    /// # Errors
    /// If the nodes exceed the device's largest buffer binding, or if it rejects the shader.
    pub fn sort_fragments(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &GpuFrame,
        lists: &GpuLists,
        drawn: u32,
    ) -> Result<GpuFragments> {
        // A fragment gives two nodes at most.
        let fragments = self.fragments_with(lists.tile, 2 * u64::from(drawn))?;
        let mut entries = lists.entries();
        entries.push(entry(at::RUNS, fragments.runs().as_entire_binding()));
        entries.push(entry(at::NODES, fragments.nodes().as_entire_binding()));
        let extent = lists.tile.extent;
        self.prepare(Pass::SortFragments, MediaKind::Plain, Some(frame), entries, extent)
            .record(encoder)?;
        Ok(fragments)
    }

    /// A target for a pass that draws over a tile, to which nothing is ever written.
    fn no_target(&self, tile: Tile) -> wgpu::TextureView {
        let [width, height] = tile.extent;
        let target = self.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("no target"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: RasterProgram::TARGET,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        target.create_view(&wgpu::TextureViewDescriptor::default())
    }

    pub(super) fn tile_buffer(&self, tile: Tile) -> wgpu::Buffer {
        self.buffer("tile", bytemuck::bytes_of(&tile), wgpu::BufferUsages::UNIFORM)
    }
}
