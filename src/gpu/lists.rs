//! Passes `raster_slices` and `sort_fragments`: planes drawn into linked lists, which become nodes.

use super::bindings::{self, at, entry};
use super::fragments::{GpuFragments, Tile};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::renderer::{GpuFrame, Renderer};
use crate::error::{Error, Result};
use crate::settings::MapKind;

/// Bytes of an element: front, back, optical depth, next.
pub(super) const ELEMENT_BYTES: u64 = 16;
/// What nothing is drawn to: a render pass wants a target.
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Linked lists of a tile on a device.
#[derive(Clone, Debug)]
pub struct GpuLists {
    tile: Tile,
    tile_buffer: wgpu::Buffer,
    heads: wgpu::Buffer,
    elements: wgpu::Buffer,
    counters: wgpu::Buffer,
    target: wgpu::TextureView,
}

/// The render pipeline of `raster_slices`.
pub(super) fn raster_pipeline(
    device: &wgpu::Device,
    pass: (&str, &str),
    media: MediaKind,
    mut entries: Vec<wgpu::BindGroupLayoutEntry>,
) -> Result<wgpu::RenderPipeline> {
    for entry in &mut entries {
        entry.visibility = wgpu::ShaderStages::FRAGMENT;
    }
    let (module, layout) = bindings::shader(device, pass, (MapKind::Fragments, media), &entries)?;
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(pass.0),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("plane"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(pass.0),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: TARGET,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    }))
}

impl Renderer {
    /// Room for `tile.capacity` fragments of a tile.
    pub fn lists(&self, tile: Tile) -> GpuLists {
        let target = self.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("no target"),
            size: wgpu::Extent3d {
                width: tile.extent[0],
                height: tile.extent[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TARGET,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        GpuLists {
            tile,
            tile_buffer: self.tile_buffer(tile),
            heads: self.storage("heads", tile.texels() * 4),
            elements: self.storage("elements", u64::from(tile.capacity) * ELEMENT_BYTES),
            counters: self.storage("counters", 8),
            target: target.create_view(&wgpu::TextureViewDescriptor::default()),
        }
    }

    /// Records pass `raster_slices`: draws `planes` planes through the volume onto empty lists.
    pub fn raster_slices(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        planes: u32,
        lists: &GpuLists,
    ) {
        let pipeline = &self.passes(media).raster_slices;
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
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        encoder.clear_buffer(&lists.heads, 0, None);
        encoder.clear_buffer(&lists.counters, 0, None);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster_slices"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &lists.target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..planes);
    }

    /// Waits for the lists' pass and says how many fragments were drawn; those beyond
    /// `tile.capacity` are missing, and the pass has to run again with room for as many.
    ///
    /// # Errors
    /// If the device fails.
    pub fn fragments_drawn(&self, lists: &GpuLists) -> Result<u32> {
        let counters: Vec<u32> = self.read_buffer(&lists.counters, 8)?;
        counters.first().copied().ok_or_else(|| Error::gpu("no counter was read back"))
    }

    /// Records pass `sort_fragments`: the nodes of `drawn` fragments, which change their order.
    ///
    /// # Errors
    /// If the nodes are more than the device binds at once.
    pub fn sort_fragments(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &GpuFrame,
        lists: &GpuLists,
        drawn: u32,
    ) -> Result<GpuFragments> {
        // A fragment is two nodes at most.
        let fragments = self.fragments_with(lists.tile, 2 * u64::from(drawn))?;
        let entries = [
            entry(at::FRAME, frame.buffer().as_entire_binding()),
            entry(at::RUNS, fragments.runs().as_entire_binding()),
            entry(at::NODES, fragments.nodes().as_entire_binding()),
            entry(at::TILE, lists.tile_buffer.as_entire_binding()),
            entry(at::HEADS, lists.heads.as_entire_binding()),
            entry(at::ELEMENTS, lists.elements.as_entire_binding()),
            entry(at::COUNTERS, lists.counters.as_entire_binding()),
        ];
        let pipeline = &self.map_passes.sort_fragments;
        self.prepare(pipeline, &entries, lists.tile.extent).record(encoder, frame);
        Ok(fragments)
    }

    pub(super) fn tile_buffer(&self, tile: Tile) -> wgpu::Buffer {
        self.buffer("tile", bytemuck::bytes_of(&tile), wgpu::BufferUsages::UNIFORM)
    }
}
