//! What shaders bind, and compute pipelines over it. Binding numbers mean the same in every pass.

use wgpu::{
    BindGroupEntry, BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType,
    ShaderStages,
};

use super::link::{self, MediaKind};
use crate::error::{Error, Result};
use crate::frame::{Frame, MOST_FIELDS};
use crate::settings::MapKind;

/// Maps and pictures: four f32.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The bindings of all passes, as the shaders number them.
pub(super) mod at {
    pub(crate) const FRAME: u32 = 0;
    pub(crate) const VOXELS: u32 = 1;
    pub(crate) const TRILINEAR: u32 = 2;
    pub(crate) const THRESHOLD_MAP: u32 = 3;
    pub(crate) const OUTPUT: u32 = 4;
    pub(crate) const RUNS: u32 = 5;
    pub(crate) const NODES: u32 = 6;
    pub(crate) const LINKS: u32 = 7;
    pub(crate) const TILE: u32 = 8;
    pub(crate) const HEADS: u32 = 9;
    pub(crate) const ELEMENTS: u32 = 10;
    pub(crate) const COUNTERS: u32 = 11;
    pub(crate) const MIXTURE: u32 = 12;
    pub(crate) const TABLES: u32 = 13;
    /// The first of [`crate::frame::MOST_FIELDS`].
    pub(crate) const FIELDS: u32 = 14;
    pub(crate) const OCCUPANCY: u32 = 22;
    pub(crate) const PIECE_ENDS: u32 = 23;
    pub(crate) const CUBICS: u32 = 24;
    pub(crate) const BLOCKS: u32 = 25;
}

/// The shaders' constant that leaves all but the usual settings out.
const USUAL: &str = "USUAL";

/// A compute pipeline for a pass, its shader's name and source, for all settings.
pub(super) fn pipeline(
    device: &wgpu::Device,
    (name, source): (&str, &str),
    kinds: (MapKind, MediaKind),
    entries: &[BindGroupLayoutEntry],
) -> Result<wgpu::ComputePipeline> {
    checked(device, || {
        let (module, layout) = shader(device, (name, source), kinds, entries)?;
        Ok(compute(device, name, &module, &layout, &[]))
    })
}

/// Two compute pipelines for a pass: for the usual settings alone ([`USUAL`]), and for all.
pub(super) fn usual_and_general(
    device: &wgpu::Device,
    (name, source): (&str, &str),
    kinds: (MapKind, MediaKind),
    entries: &[BindGroupLayoutEntry],
) -> Result<[wgpu::ComputePipeline; 2]> {
    let (module, layout) = checked(device, || shader(device, (name, source), kinds, entries))?;
    let compiled = |constants: &[(&str, f64)]| {
        checked(device, || Ok(compute(device, name, &module, &layout, constants)))
    };
    let (usual, general) = rayon::join(|| compiled(&[(USUAL, 1.0)]), || compiled(&[]));
    Ok([usual?, general?])
}

/// What `make` makes, unless the device finds something wrong with it: scopes of errors belong to a thread.
pub(super) fn checked<T>(device: &wgpu::Device, make: impl FnOnce() -> Result<T>) -> Result<T> {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    match pollster::block_on(scope.pop()) {
        Some(error) => Err(Error::gpu(error.to_string())),
        None => made,
    }
}

fn compute(
    device: &wgpu::Device,
    name: &str,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(layout),
        module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// A pass's shader and the layout of what it binds.
pub(super) fn shader(
    device: &wgpu::Device,
    (name, source): (&str, &str),
    kinds: (MapKind, MediaKind),
    entries: &[BindGroupLayoutEntry],
) -> Result<(wgpu::ShaderModule, wgpu::PipelineLayout)> {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(link::linked(source, kinds.0, kinds.1)?.into()),
    });
    let bindings = device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(&bindings)],
        immediate_size: 0,
    });
    Ok((module, layout))
}

pub(super) fn entry(binding: u32, resource: BindingResource<'_>) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource }
}

fn layout_entry(binding: u32, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility: ShaderStages::COMPUTE, ty, count: None }
}

fn buffer(binding: u32, ty: BufferBindingType, least: usize) -> BindGroupLayoutEntry {
    let min_binding_size = std::num::NonZero::new(least as u64);
    layout_entry(binding, BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size })
}

pub(super) fn frame() -> BindGroupLayoutEntry {
    buffer(at::FRAME, BufferBindingType::Uniform, size_of::<Frame>())
}

pub(super) fn tile() -> BindGroupLayoutEntry {
    buffer(at::TILE, BufferBindingType::Uniform, size_of::<super::fragments::Tile>())
}

pub(super) fn read(binding: u32) -> BindGroupLayoutEntry {
    buffer(binding, BufferBindingType::Storage { read_only: true }, 0)
}

pub(super) fn read_write(binding: u32) -> BindGroupLayoutEntry {
    buffer(binding, BufferBindingType::Storage { read_only: false }, 0)
}

/// The media and how they are sampled.
pub(super) fn media(kind: MediaKind) -> Vec<BindGroupLayoutEntry> {
    let sampler = BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let grid = |binding| texture(binding, wgpu::TextureViewDimension::D3, true);
    let whole_numbers = BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D3,
        multisampled: false,
    };
    let mut entries =
        vec![layout_entry(at::TRILINEAR, sampler), layout_entry(at::OCCUPANCY, whole_numbers)];
    match kind {
        MediaKind::Plain => entries.push(grid(at::VOXELS)),
        MediaKind::Blocks => {
            entries.push(grid(at::VOXELS));
            entries.push(layout_entry(at::BLOCKS, whole_numbers));
        }
        MediaKind::Mixed => {
            entries.push(buffer(at::MIXTURE, BufferBindingType::Uniform, 0));
            entries.push(read(at::TABLES));
            entries.extend((0..MOST_FIELDS as u32).map(|i| grid(at::FIELDS + i)));
        }
    }
    entries
}

pub(super) fn threshold_map() -> BindGroupLayoutEntry {
    texture(at::THRESHOLD_MAP, wgpu::TextureViewDimension::D2, false)
}

fn texture(
    binding: u32,
    view_dimension: wgpu::TextureViewDimension,
    filterable: bool,
) -> BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Float { filterable };
    layout_entry(binding, BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// The curves of a threshold map, bound by `access` ([`read`] or [`read_write`]).
pub(super) fn curves(access: fn(u32) -> BindGroupLayoutEntry) -> [BindGroupLayoutEntry; 2] {
    [at::PIECE_ENDS, at::CUBICS].map(access)
}

pub(super) fn output() -> BindGroupLayoutEntry {
    let ty = BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: FORMAT,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    layout_entry(at::OUTPUT, ty)
}
