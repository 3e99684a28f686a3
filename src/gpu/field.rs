//! A grid as a 3D texture, in the smallest format that keeps its values.

use half::f16;
use wgpu::TextureFormat;

use crate::error::{Error, ErrorKind, Result};
use crate::volume::Volume;

/// A grid's numbers on a device: a filterable 3D texture.
#[derive(Clone, Debug)]
pub(super) struct GpuField {
    pub(super) view: wgpu::TextureView,
    /// The number that a texture value of 1 stands for.
    pub(super) scale: f32,
}

impl GpuField {
    pub(super) fn upload(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        volume: &Volume,
    ) -> Result<Self> {
        let dims = volume.dims();
        let limits = device.limits();
        let limit = limits.max_texture_dimension_3d as usize;
        if let Some(long) = dims.iter().find(|&&n| n > limit) {
            return Err(limit_error(
                volume,
                format!("{long} voxels on an axis"),
                format!("{limit}"),
            ));
        }
        let texels = Texels::of(volume, device);
        let bytes = texels.bytes.len() as u64;
        if bytes > limits.max_buffer_size {
            let limit = format!("{} bytes", limits.max_buffer_size);
            return Err(limit_error(volume, format!("{bytes} bytes"), limit));
        }
        let [width, height, depth] = dims.map(|n| n as u32);
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: depth };
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("volume"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: texels.format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let row = texels.bytes.len() / (dims[1] * dims[2]);
        queue.write_texture(
            texture.as_image_copy(),
            &texels.bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row as u32),
                rows_per_image: Some(height),
            },
            size,
        );
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self { view, scale: texels.scale })
    }
}

fn limit_error(volume: &Volume, needed: String, limit: String) -> Error {
    let what = format!("volume '{}' as one 3D texture", volume.name);
    ErrorKind::Limit { what, needed, limit }.into()
}

struct Texels {
    format: TextureFormat,
    bytes: Vec<u8>,
    scale: f32,
}

impl Texels {
    /// Eight bits where all values are k / 255 of a common scale (data stored as u8), else f16
    /// relative to the largest value, whose rounding (2^-12) lies below what 8-bit texture weights do;
    /// hardware samples these at twice to four times the rate of f32. Software drivers get f32: some
    /// filter eight-bit textures in eight-bit arithmetic.
    fn of(volume: &Volume, device: &wgpu::Device) -> Self {
        let values = volume.values().as_slice().unwrap_or_default();
        let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        if software && device.features().contains(wgpu::Features::FLOAT32_FILTERABLE) {
            let bytes = bytemuck::cast_slice(values).to_vec();
            return Self { format: TextureFormat::R32Float, bytes, scale: 1.0 };
        }
        for scale in [1.0, 255.0] {
            if let Some(bytes) = as_eight_bits(values, scale) {
                return Self { format: TextureFormat::R8Unorm, bytes, scale };
            }
        }
        let scale = volume.largest().max(f32::MIN_POSITIVE);
        let halves: Vec<f16> = values.iter().map(|&v| f16::from_f32(v / scale)).collect();
        let bytes = bytemuck::cast_slice(&halves).to_vec();
        Self { format: TextureFormat::R16Float, bytes, scale }
    }
}

/// `values / scale * 255` if all of them are whole numbers of 0..255 to f32's precision.
fn as_eight_bits(values: &[f32], scale: f32) -> Option<Vec<u8>> {
    values
        .iter()
        .map(|&v| {
            let level = v / scale * 255.0;
            let whole = level.round();
            ((level - whole).abs() <= whole * 2e-7 && whole <= 255.0).then_some(whole as u8)
        })
        .collect()
}
