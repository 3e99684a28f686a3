//! The passes on a device: pipelines, textures, submission and readback. It works on any device and
//! queue, including the caller's own. Nothing is submitted or waited for unless requested.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use bytemuck::bytes_of;
use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{FORMAT, at, entry};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::programs::{Programs, Variant};
use super::shadow::GpuShadow;
use super::waiting::Scopes;
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::scene::Media;

/// Bytes of a map's texel or of a picture's pixel.
pub(super) const TEXEL_BYTES: u32 = 16;

/// A frame's parameters on a device.
#[derive(Clone, Debug)]
pub struct GpuFrame {
    buffer: wgpu::Buffer,
    /// The variant of shaders that it needs, by its index.
    variant: Arc<AtomicU8>,
}

impl GpuFrame {
    /// The uniform buffer with the layout of [`Frame`].
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub(super) fn variant(&self) -> Variant {
        Variant::at(self.variant.load(Ordering::Relaxed))
    }
}

/// Declares access to a texture of four f32 per texel.
macro_rules! texture {
    ($name:ident) => {
        impl $name {
            /// The texture, `Rgba32Float`, row 0 on top.
            pub fn texture(&self) -> &wgpu::Texture {
                &self.texture
            }

            /// A view of the whole texture, for shaders.
            pub fn view(&self) -> &wgpu::TextureView {
                &self.view
            }
        }
    };
}

/// A threshold map on a device: R, G, B = depths at three opacities, A = largest opacity. It
/// includes the curves that lookups read, which are computed from the texels.
#[derive(Clone, Debug)]
pub struct GpuMap {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// Ends and cubics of each texel's curve (`shaders/kernel/curves`).
    curves: [wgpu::Buffer; 2],
}

/// A picture on a device: premultiplied linear radiance and opacity.
#[derive(Clone, Debug)]
pub struct GpuImage {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl GpuMap {
    pub(super) fn curve_entries(&self) -> [BindGroupEntry<'_>; 2] {
        let [ends, cubics] = &self.curves;
        [
            entry(at::PIECE_ENDS, ends.as_entire_binding()),
            entry(at::CUBICS, cubics.as_entire_binding()),
        ]
    }
}

impl GpuImage {
    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }
}

texture!(GpuMap);
texture!(GpuImage);

/// The passes on a device. Each is compiled when it is first recorded.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    sampler: wgpu::Sampler,
    pub(super) programs: Programs,
    pub(super) scopes: Scopes,
    readbacks: AtomicU64,
}

impl Renderer {
    /// The passes on a device and its queue. wgpu's default limits and no features suffice. Larger
    /// limits allow larger work:
    /// - `max_texture_dimension_2d` limits maps and pictures along an edge, and
    ///   `max_texture_dimension_3d` volumes. (A larger volume is stored in blocks if its medium is
    ///   plain: [`Medium::is_plain`](crate::scene::Medium::is_plain).)
    /// - `max_storage_buffer_binding_size` and `max_buffer_size` limit the lists of a fragment map,
    ///   and a threshold map, which needs a buffer with 64 bytes per texel: 1448 x 1448 texels with
    ///   the default limits.
    ///
    /// The feature `FLOAT32_FILTERABLE` matters on software adapters only. There voxels are stored
    /// as f32 with it, and in 8 or 16 bits without it, as on hardware.
    ///
    /// In a browser, a device's verdict on what is made comes later than its result. Errors of
    /// functions that do not wait are then those of the next function that does, such as
    /// [`Renderer::submit_async`].
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let scopes = Scopes::new(device);
        Self {
            device: device.clone(),
            queue: queue.clone(),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("trilinear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            programs: Programs::new(device, &scopes),
            scopes,
            readbacks: AtomicU64::new(0),
        }
    }

    /// How many times results have been read back to the host so far.
    pub fn readbacks(&self) -> u64 {
        self.readbacks.load(Ordering::Relaxed)
    }

    pub(super) fn count_readback(&self) {
        self.readbacks.fetch_add(1, Ordering::Relaxed);
    }

    /// The device on which it works.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// The largest number of bytes of a buffer that a shader can bind.
    pub(super) fn largest_binding(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// A buffer that holds `contents`. (wgpu's own function for this panics if there is not enough
    /// memory.)
    pub(super) fn buffer(
        &self,
        label: &str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// A storage buffer of at least `bytes` bytes, and at least one element of any kind.
    pub(super) fn storage(&self, label: &str, bytes: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(16).next_multiple_of(8),
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The bind group entries of media.
    pub(super) fn media_entries<'a>(&'a self, media: &'a GpuMedia) -> Vec<BindGroupEntry<'a>> {
        media.entries(&self.sampler)
    }

    /// Uploads media to the device. A volume that is sparse, or that exceeds the size of a texture,
    /// is stored in blocks.
    ///
    /// # Errors
    /// If the blocks of a volume do not fit one texture, or their table exceeds the size of a
    /// texture. If a grid of a mixture exceeds the size of a texture, or a sparse one takes more
    /// than 4 GiB as a single texture. If there are more bodies or grids than shaders support. If
    /// the device has not enough memory.
    pub fn upload(&self, media: &Media) -> Result<GpuMedia> {
        self.scopes.scoped(Error::gpu, || GpuMedia::upload(self, media))?
    }

    /// Uploads the parameters of a frame of `media` to the device.
    ///
    /// # Errors
    /// If the map or the picture exceeds the size of the device's textures.
    pub fn frame(&self, frame: &Frame, media: &GpuMedia) -> Result<GpuFrame> {
        let held = self.held(frame, media)?;
        let buffer = self.buffer("frame", bytes_of(&held), wgpu::BufferUsages::UNIFORM);
        Ok(GpuFrame { buffer, variant: Arc::new(AtomicU8::new(Variant::of(frame).index())) })
    }

    /// Replaces the parameters that `known` holds by those of another frame of `media`, for
    /// everything that is submitted from now on. Passes prepared with it remain valid, as long as
    /// the sizes of map and picture do not change.
    ///
    /// # Errors
    /// As [`Renderer::frame`]; then nothing has changed.
    pub fn update(&self, known: &GpuFrame, frame: &Frame, media: &GpuMedia) -> Result<()> {
        let held = self.held(frame, media)?;
        self.queue.write_buffer(&known.buffer, 0, bytes_of(&held));
        known.variant.store(Variant::of(frame).index(), Ordering::Relaxed);
        Ok(())
    }

    /// A frame as shaders read it, for media on the device.
    fn held(&self, frame: &Frame, media: &GpuMedia) -> Result<Frame> {
        let (width, height, map) = (frame.view.width, frame.view.height, frame.map.size);
        self.check_size("picture", [width, height])?;
        self.check_size("map", [map; 2])?;
        let mut held = *frame;
        held.media.stored_one = media.scale();
        Ok(held)
    }

    /// Allocates a map of `size` squared texels.
    ///
    /// # Errors
    /// If it exceeds the size of the device's textures or buffers.
    pub fn map(&self, size: u32) -> Result<GpuMap> {
        let (texture, view) = self.texture("threshold map", [size; 2])?;
        let bytes = u64::from(size) * u64::from(size) * u64::from(TEXEL_BYTES);
        if 4 * bytes > self.largest_binding() {
            let (what, needed) = ("threshold map".to_owned(), format!("{size}x{size} texels"));
            let limit = format!("{} bytes in a buffer", self.largest_binding());
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
        let curves = [self.storage("piece ends", bytes), self.storage("cubics", 4 * bytes)];
        Ok(GpuMap { texture, view, curves })
    }

    /// Allocates a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// If it exceeds the size of the device's textures, or if the device has not enough memory.
    pub fn image(&self, width: u32, height: u32) -> Result<GpuImage> {
        let (texture, view) = self.texture("picture", [width, height])?;
        Ok(GpuImage { texture, view })
    }

    /// Uploads a map's texels, row by row; there must be as many as the map has. Lookups require
    /// pass [`Renderer::fit_curves`] after this.
    pub fn write(&self, map: &GpuMap, texels: &[[f32; 4]]) {
        let size = map.texture.size();
        self.queue.write_texture(
            map.texture.as_image_copy(),
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.width * TEXEL_BYTES),
                rows_per_image: Some(size.height),
            },
            size,
        );
    }

    /// Records pass `trace_threshold`, which fills `map` for the light of `frame`.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn trace_threshold(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        map: &GpuMap,
    ) -> Result<()> {
        self.prepare_threshold(media, frame, map).record(encoder)
    }

    /// Records pass `fit_curves`, which prepares a map that was uploaded from the host for lookups.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn fit_curves(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &GpuFrame,
        map: &GpuMap,
    ) -> Result<()> {
        let mut entries = vec![entry(at::THRESHOLD_MAP, BindingResource::TextureView(&map.view))];
        entries.extend(map.curve_entries());
        let size = map.texture.width();
        self.prepare(Pass::FitCurves, MediaKind::Plain, Some(frame), entries, [size, size])
            .record(encoder)
    }

    /// Records pass `march_view`, which fills `image` for the camera of `frame`, lit through
    /// `shadow`.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn march_view(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        shadow: GpuShadow<'_>,
        image: &GpuImage,
    ) -> Result<()> {
        self.prepare_view(media, frame, shadow, image).record(encoder)
    }

    /// Checks a picture or a map against the size of the device's textures. A device with textures
    /// of that size also supports enough workgroups: WebGPU guarantees 65535 along an axis, of
    /// eight texels each.
    pub(super) fn check_size(&self, what: &str, [width, height]: [u32; 2]) -> Result<()> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if width.max(height) <= limit {
            return Ok(());
        }
        let (needed, limit) = (format!("{width}x{height}"), format!("{limit} along an edge"));
        Err(ErrorKind::Limit { what: what.to_owned(), needed, limit }.into())
    }

    fn texture(
        &self,
        label: &'static str,
        [width, height]: [u32; 2],
    ) -> Result<(wgpu::Texture, wgpu::TextureView)> {
        self.check_size(label, [width, height])?;
        let make = || {
            let texture = self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            (texture, view)
        };
        // Only drivers know how many bytes a texture may have.
        let explain = move |why| {
            let bytes = u64::from(width) * u64::from(height) * u64::from(TEXEL_BYTES);
            let needed = format!("{width}x{height} ({bytes} bytes)");
            let limit = format!("the device's: {why}");
            Error::from(ErrorKind::Limit { what: label.to_owned(), needed, limit })
        };
        self.scopes.scoped(explain, make)
    }
}
