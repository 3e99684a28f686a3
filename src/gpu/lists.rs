//! Passes `raster_slices` and `sort_fragments`: planes are drawn into linked lists, which become
//! nodes.

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

/// The linked lists of a tile on a device.
#[derive(Clone, Debug)]
pub struct GpuLists {
    tile: Tile,
    tile_buffer: wgpu::Buffer,
    heads: wgpu::Buffer,
    elements: wgpu::Buffer,
    counters: wgpu::Buffer,
    target: wgpu::TextureView,
}

impl Renderer {
    /// Allocates lists with room for `tile.capacity` fragments in all.
    pub fn lists(&self, tile: Tile) -> GpuLists {
        GpuLists {
            tile,
            tile_buffer: self.tile_buffer(tile),
            heads: self.storage("heads", tile.texels() * 4),
            elements: self.storage("elements", u64::from(tile.capacity) * ELEMENT_BYTES),
            counters: self.storage("counters", 8),
            target: self.no_target(tile),
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
        entries.extend([
            entry(at::FRAME, frame.buffer().as_entire_binding()),
            entry(at::TILE, lists.tile_buffer.as_entire_binding()),
            entry(at::HEADS, lists.heads.as_entire_binding()),
            entry(at::ELEMENTS, lists.elements.as_entire_binding()),
            entry(at::COUNTERS, lists.counters.as_entire_binding()),
        ]);
        let bind_group = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("raster_slices"),
            layout: &program.layout,
            entries: &entries,
        });
        encoder.clear_buffer(&lists.heads, 0, None);
        encoder.clear_buffer(&lists.counters, 0, None);
        record_drawing(
            encoder,
            ("raster_slices", &lists.target),
            &program,
            &bind_group,
            (3, planes),
        );
        Ok(())
    }

    /// Waits for the lists' pass and returns how many fragments were drawn. If they exceed
    /// `tile.capacity`, the rest is missing, and the pass must run again with room for all.
    ///
    /// # Errors
    /// If the device fails.
    pub fn fragments_drawn(&self, lists: &GpuLists) -> Result<u32> {
        let counters: Vec<u32> = self.read_buffer(&lists.counters, 8)?;
        counters.first().copied().ok_or_else(|| Error::gpu("no counter was read back"))
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
        let entries = vec![
            entry(at::RUNS, fragments.runs().as_entire_binding()),
            entry(at::NODES, fragments.nodes().as_entire_binding()),
            entry(at::TILE, lists.tile_buffer.as_entire_binding()),
            entry(at::HEADS, lists.heads.as_entire_binding()),
            entry(at::ELEMENTS, lists.elements.as_entire_binding()),
            entry(at::COUNTERS, lists.counters.as_entire_binding()),
        ];
        let extent = lists.tile.extent;
        self.prepare(Pass::SortFragments, MediaKind::Plain, Some(frame), entries, extent)
            .record(encoder)?;
        Ok(fragments)
    }

    /// A target for a pass that draws over a tile, to which nothing is ever written.
    pub(super) fn no_target(&self, tile: Tile) -> wgpu::TextureView {
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

/// Records a pass that draws a number of corners, so many times, on a target of which nothing is
/// kept.
pub(super) fn record_drawing(
    encoder: &mut wgpu::CommandEncoder,
    (label, target): (&str, &wgpu::TextureView),
    program: &RasterProgram,
    bind_group: &wgpu::BindGroup,
    (corners, times): (u32, u32),
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
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
