//! The bindings of the shaders. A binding number means the same in every pass.

use wgpu::{
    BindGroupEntry, BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType,
    ShaderStages,
};

use super::link::MediaKind;
use crate::frame::{Frame, MOST_FIELDS};

/// The format of maps and pictures: four f32.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// The format of what a screen shows.
pub(super) const SCREEN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// The binding numbers of all passes, as in the shaders.
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
    /// The first of [`crate::frame::MOST_FIELDS`] bindings.
    pub(crate) const FIELDS: u32 = 14;
    pub(crate) const OCCUPANCY: u32 = 22;
    pub(crate) const PIECE_ENDS: u32 = 23;
    pub(crate) const CUBICS: u32 = 24;
    pub(crate) const BLOCKS: u32 = 25;
    pub(crate) const SUM: u32 = 26;
    pub(crate) const BEAM: u32 = 27;
    pub(crate) const WEIGHTS: u32 = 28;
    pub(crate) const SINGLE: u32 = 29;
    pub(crate) const BRIGHT: u32 = 30;
    pub(crate) const POINTS: u32 = 31;
    pub(crate) const OPACITIES: u32 = 32;
    pub(crate) const SEGMENTS: u32 = 33;
    pub(crate) const CORNERS: u32 = 34;
    pub(crate) const LARGE: u32 = 35;
    pub(crate) const LOOKS: u32 = 36;
    pub(crate) const SCREEN: u32 = 37;
    pub(crate) const TONE: u32 = 38;
    pub(crate) const PACKED_RUNS: u32 = 39;
    pub(crate) const PACKED_NODES: u32 = 40;
    pub(crate) const CODED: u32 = 41;
    pub(crate) const EXTENTS: u32 = 42;
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
    buffer(at::TILE, BufferBindingType::Uniform, size_of::<super::tile::Tile>())
}

pub(super) fn read(binding: u32) -> BindGroupLayoutEntry {
    buffer(binding, BufferBindingType::Storage { read_only: true }, 0)
}

pub(super) fn read_write(binding: u32) -> BindGroupLayoutEntry {
    buffer(binding, BufferBindingType::Storage { read_only: false }, 0)
}

/// The media and their samplers.
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
        MediaKind::OneField | MediaKind::Mixed => {
            entries.push(buffer(at::MIXTURE, BufferBindingType::Uniform, 0));
            entries.push(read(at::TABLES));
            let fields = if kind == MediaKind::Mixed { MOST_FIELDS as u32 } else { 1 };
            entries.extend((0..fields).map(|i| grid(at::FIELDS + i)));
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

/// The sum of the beams' pictures so far.
pub(super) fn sum() -> BindGroupLayoutEntry {
    texture(at::SUM, wgpu::TextureViewDimension::D2, false)
}

/// The picture of one more beam.
pub(super) fn beam() -> BindGroupLayoutEntry {
    texture(at::BEAM, wgpu::TextureViewDimension::D2, false)
}

/// The picture of one ray per pixel.
pub(super) fn single() -> BindGroupLayoutEntry {
    texture(at::SINGLE, wgpu::TextureViewDimension::D2, false)
}

/// The beam's weight in each channel.
pub(super) fn weights() -> BindGroupLayoutEntry {
    buffer(at::WEIGHTS, BufferBindingType::Uniform, size_of::<glam::Vec4>())
}

pub(super) fn output() -> BindGroupLayoutEntry {
    written(at::OUTPUT, FORMAT)
}

/// What a screen shows.
pub(super) fn screen() -> BindGroupLayoutEntry {
    written(at::SCREEN, SCREEN)
}

/// How radiance becomes what a screen shows.
pub(super) fn tone() -> BindGroupLayoutEntry {
    buffer(at::TONE, BufferBindingType::Uniform, size_of::<glam::Vec4>())
}

fn written(binding: u32, format: wgpu::TextureFormat) -> BindGroupLayoutEntry {
    let ty = BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    layout_entry(binding, ty)
}
