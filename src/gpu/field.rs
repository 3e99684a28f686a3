//! A grid as a 3D texture, in the smallest format that preserves its values.

use half::f16;
use rayon::prelude::*;
use wgpu::TextureFormat;

use crate::error::{Error, ErrorKind, Result};
use crate::volume::{Volume, Voxels};

/// Number of bytes that are written to a texture at a time, unless a single layer is larger.
const BYTES_AT_ONCE: u64 = 32 << 20;

/// A grid's numbers on a device, as a filterable 3D texture.
#[derive(Clone, Debug)]
pub(super) struct GpuField {
    pub(super) view: wgpu::TextureView,
    /// The number for which a texture value of 1 stands.
    pub(super) scale: f32,
}

impl GpuField {
    pub(super) fn new(texture: &wgpu::Texture, encoding: &Encoding) -> Self {
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { view, scale: encoding.scale }
    }

    /// A placeholder for bindings without a grid.
    pub(super) fn nothing(device: &wgpu::Device) -> Self {
        let texture = texture(device, "nothing", [1; 3], TextureFormat::R8Unorm);
        Self { view: texture.create_view(&wgpu::TextureViewDescriptor::default()), scale: 1.0 }
    }

    pub(super) fn upload(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        volume: &Volume,
    ) -> Result<Self> {
        let dims = volume.dims();
        let limit = device.limits().max_texture_dimension_3d;
        if let Some(long) = longer(dims, limit) {
            let needed = format!("{long} voxels along an axis");
            return Err(limit_error(volume, needed, limit.to_string()));
        }
        let encoding = Encoding::of(volume, device);
        let bytes =
            dims.iter().map(|&n| n as f64).product::<f64>() * f64::from(encoding.texel_bytes());
        if matches!(volume.voxels(), Voxels::Sparse(_)) && bytes > MOST_BYTES_OF_SPARSE {
            let limit = format!("{MOST_BYTES_OF_SPARSE} bytes (the CPU backend has none)");
            return Err(limit_error(volume, format!("{bytes} bytes"), limit));
        }
        let texture = texture(device, "volume", dims.map(|n| n as u32), encoding.format);
        let [nx, ny, _] = dims;
        write_layers(queue, &texture, encoding.texel_bytes(), |layers| {
            if let Voxels::Dense(values) = volume.voxels() {
                let all = values.as_slice().unwrap_or_default();
                let layers = all[layers.start * nx * ny..layers.end * nx * ny].par_chunks(nx * ny);
                return layers.map(|layer| encoding.bytes(layer)).collect::<Vec<_>>().concat();
            }
            let layer = |z: usize| {
                let mut values = vec![0.0; nx * ny];
                for (y, row) in values.chunks_exact_mut(nx).enumerate() {
                    volume.voxels().fill_row(y, z, row);
                }
                encoding.bytes(&values)
            };
            layers.into_par_iter().map(layer).collect::<Vec<_>>().concat()
        });
        Ok(Self::new(&texture, &encoding))
    }
}

/// The first edge that exceeds the limit of textures; `None` if all fit.
pub(super) fn longer(dims: [usize; 3], limit: u32) -> Option<usize> {
    dims.into_iter().find(|&n| n > limit as usize)
}

/// An empty 3D texture for shaders to read.
pub(super) fn texture(
    device: &wgpu::Device,
    label: &str,
    [width, height, depth]: [u32; 3],
    format: TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Fills a 3D texture a few layers at a time, so that the host never holds a copy of all of it;
/// `bytes` returns the bytes of some layers.
pub(super) fn write_layers(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    texel_bytes: u32,
    bytes: impl Fn(std::ops::Range<usize>) -> Vec<u8>,
) {
    let (width, height) = (texture.width(), texture.height());
    let depth = texture.depth_or_array_layers();
    let row = width * texel_bytes;
    let at_once = (BYTES_AT_ONCE / (u64::from(row) * u64::from(height)).max(1)).max(1) as usize;
    for first in (0..depth).step_by(at_once) {
        let count = (at_once as u32).min(depth - first);
        let mut copied = texture.as_image_copy();
        copied.origin.z = first;
        queue.write_texture(
            copied,
            &bytes(first as usize..(first + count) as usize),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row),
                rows_per_image: Some(height),
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: count },
        );
        if first + count < depth {
            // Written data stays in memory until the next submission.
            queue.submit([]);
        }
    }
}

pub(super) fn limit_error(volume: &Volume, needed: String, limit: String) -> Error {
    let what = format!("volume '{}' as one 3D texture", volume.name);
    ErrorKind::Limit { what, needed, limit }.into()
}

/// The largest number of bytes for sparse voxels as a single texture, which takes far more than
/// they do.
const MOST_BYTES_OF_SPARSE: f64 = (1_u64 << 32) as f64;

/// The format in which a volume's values are stored in a texture.
pub(super) struct Encoding {
    pub(super) format: TextureFormat,
    scale: f32,
}

impl Encoding {
    /// Eight bits if all values are k / 255 of a common scale (data stored as u8). Else f16
    /// relative to the largest value; its rounding (2^-12) is smaller than that of the texture
    /// units' 8-bit weights. Hardware samples these formats two to four times as fast as f32.
    /// Software drivers get f32, because some filter eight-bit textures with eight-bit arithmetic.
    pub(super) fn of(volume: &Volume, device: &wgpu::Device) -> Self {
        let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        if software && device.features().contains(wgpu::Features::FLOAT32_FILTERABLE) {
            return Self { format: TextureFormat::R32Float, scale: 1.0 };
        }
        let values = match volume.voxels() {
            Voxels::Dense(values) => values.as_slice().unwrap_or_default(),
            Voxels::Sparse(voxels) => voxels.values(),
        };
        for scale in [1.0, 255.0] {
            if values.par_iter().all(|&value| eight_bits(value, scale).is_some()) {
                return Self { format: TextureFormat::R8Unorm, scale };
            }
        }
        let scale = volume.largest().max(f32::MIN_POSITIVE);
        Self { format: TextureFormat::R16Float, scale }
    }

    pub(super) fn texel_bytes(&self) -> u32 {
        match self.format {
            TextureFormat::R8Unorm => 1,
            TextureFormat::R16Float => 2,
            _ => 4,
        }
    }

    /// Values encoded as texels.
    pub(super) fn bytes(&self, values: &[f32]) -> Vec<u8> {
        let scale = self.scale;
        match self.format {
            TextureFormat::R8Unorm => {
                values.iter().map(|&value| eight_bits(value, scale).unwrap_or(0)).collect()
            }
            TextureFormat::R16Float => {
                let halves: Vec<f16> = values.iter().map(|&v| f16::from_f32(v / scale)).collect();
                bytemuck::cast_slice(&halves).to_vec()
            }
            _ => bytemuck::cast_slice(values).to_vec(),
        }
    }
}

/// `value / scale * 255`, if that is an integer in 0..255 within f32's precision.
fn eight_bits(value: f32, scale: f32) -> Option<u8> {
    let level = value / scale * 255.0;
    let whole = level.round();
    ((level - whole).abs() <= whole * 2e-7 && whole <= 255.0).then_some(whole as u8)
}
