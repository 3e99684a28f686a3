//! The passes on a device: pipelines, textures, submission and readback. Works on any device and
//! queue, the caller's own included; nothing is submitted or waited for unless asked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use bytemuck::bytes_of;
use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{FORMAT, at, entry};
use super::link::MediaKind;
use super::media::GpuMedia;
use super::passes::Pass;
use super::programs::Programs;
use super::shadow::GpuShadow;
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::scene::Media;

/// Bytes of a map's texel or a picture's pixel.
pub(super) const TEXEL_BYTES: u32 = 16;

/// A frame's parameters on a device.
#[derive(Clone, Debug)]
pub struct GpuFrame {
    buffer: wgpu::Buffer,
    /// Whether the camera march needs nothing but the usual settings.
    usual: Arc<AtomicBool>,
}

impl GpuFrame {
    /// The uniform buffer, laid out as [`Frame`].
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub(super) fn usual(&self) -> bool {
        self.usual.load(Ordering::Relaxed)
    }
}

/// Declares how a texture of four f32 a texel is reached.
macro_rules! texture {
    ($name:ident) => {
        impl $name {
            /// The texture, `Rgba32Float`, row 0 on top.
            pub fn texture(&self) -> &wgpu::Texture {
                &self.texture
            }

            /// A view of all of it, for shaders.
            pub fn view(&self) -> &wgpu::TextureView {
                &self.view
            }
        }
    };
}

/// A threshold map on a device: R, G, B = depths at three opacities, A = largest opacity; and what
/// lookups read, worked out from it.
#[derive(Clone, Debug)]
pub struct GpuMap {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// Ends and cubics of each texel's curve, `shaders/kernel/curves`.
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
    /// Pixels along x and y.
    pub fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }
}

texture!(GpuMap);
texture!(GpuImage);

/// The passes on a device, each compiled when it is first recorded.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    sampler: wgpu::Sampler,
    pub(super) programs: Programs,
    readbacks: AtomicU64,
}

impl Renderer {
    /// The passes on a device and its queue.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self {
            device: device.clone(),
            queue: queue.clone(),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("trilinear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            programs: Programs::new(device),
            readbacks: AtomicU64::new(0),
        }
    }

    /// How often something was brought to the host so far.
    pub fn readbacks(&self) -> u64 {
        self.readbacks.load(Ordering::Relaxed)
    }

    pub(super) fn count_readback(&self) {
        self.readbacks.fetch_add(1, Ordering::Relaxed);
    }

    /// The device that it works on.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Bytes that a shader can see in one buffer.
    pub(super) fn largest_binding(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// Does `work`, and what the device found wrong with it, in its words.
    pub(super) fn scoped<T>(&self, work: impl FnOnce() -> T) -> Result<T, String> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let done = work();
        let found = [pollster::block_on(validation.pop()), pollster::block_on(memory.pop())];
        match found.into_iter().flatten().next() {
            Some(error) => Err(error.to_string()),
            None => Ok(done),
        }
    }

    /// A buffer that holds `contents`. (wgpu's own function for it panics where there is no
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

    /// A storage buffer of at least `bytes`, never less than one element of any kind.
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

    /// What passes bind of media.
    pub(super) fn media_entries<'a>(&'a self, media: &'a GpuMedia) -> Vec<BindGroupEntry<'a>> {
        media.entries(&self.sampler)
    }

    /// Puts media on the device. A volume that is sparse, or larger than one texture can be, is
    /// stored in blocks.
    ///
    /// # Errors
    /// If the blocks of a volume are more than a texture holds or along an axis more than textures
    /// are long, if a grid of a mixture is larger than textures can be or a sparse one takes more
    /// than 4 GiB as one, if there are more volumes or grids than shaders know, or if the device
    /// has no memory left.
    pub fn upload(&self, media: &Media) -> Result<GpuMedia> {
        self.scoped(|| GpuMedia::upload(self, media)).map_err(Error::gpu)?
    }

    /// Puts the parameters of a frame of `media` on the device.
    ///
    /// # Errors
    /// If the map or the picture is larger than the device's textures can be.
    pub fn frame(&self, frame: &Frame, media: &GpuMedia) -> Result<GpuFrame> {
        let held = self.held(frame, media)?;
        let buffer = self.buffer("frame", bytes_of(&held), wgpu::BufferUsages::UNIFORM);
        Ok(GpuFrame { buffer, usual: Arc::new(AtomicBool::new(frame.is_usual())) })
    }

    /// Puts other parameters of a frame of `media` in the place of those that `known` holds: for
    /// what is submitted from now on. Passes prepared with it go on as they are, if sizes of map
    /// and picture have not changed.
    ///
    /// # Errors
    /// As [`Renderer::frame`]; then nothing has changed.
    pub fn update(&self, known: &GpuFrame, frame: &Frame, media: &GpuMedia) -> Result<()> {
        let held = self.held(frame, media)?;
        self.queue.write_buffer(&known.buffer, 0, bytes_of(&held));
        known.usual.store(frame.is_usual(), Ordering::Relaxed);
        Ok(())
    }

    /// A frame as shaders read it for media on the device.
    fn held(&self, frame: &Frame, media: &GpuMedia) -> Result<Frame> {
        let (width, height, map) = (frame.view.width, frame.view.height, frame.map.size);
        self.check_size("picture", [width, height])?;
        self.check_size("map", [map; 2])?;
        let mut held = *frame;
        held.media.stored_one = media.scale();
        Ok(held)
    }

    /// An empty map of `size` squared texels.
    ///
    /// # Errors
    /// If the device's textures or buffers cannot be as large.
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

    /// An empty picture.
    ///
    /// # Errors
    /// If the device's textures cannot be as large, or it has no memory for so many pixels.
    pub fn image(&self, width: u32, height: u32) -> Result<GpuImage> {
        let (texture, view) = self.texture("picture", [width, height])?;
        Ok(GpuImage { texture, view })
    }

    /// Fills a map from the host: texels row by row, as many as it has. Before it is looked up, it
    /// needs pass [`Renderer::fit_curves`].
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

    /// Records pass `trace_threshold`: fills `map` for the light of `frame`.
    ///
    /// # Errors
    /// If the device refuses the shader.
    pub fn trace_threshold(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        media: &GpuMedia,
        frame: &GpuFrame,
        map: &GpuMap,
    ) -> Result<()> {
        self.prepare_threshold(media, frame, map).record(encoder)
    }

    /// Records pass `fit_curves`: makes a map that was filled from the host ready to be looked up.
    ///
    /// # Errors
    /// If the device refuses the shader.
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

    /// Records pass `march_view`: fills `image` for the camera of `frame`, lit through `shadow`.
    ///
    /// # Errors
    /// If the device refuses the shader.
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

    /// Holds a picture or a map against what the device's textures can be. No device that has
    /// textures as large has fewer workgroups than they take: WebGPU demands 65535 along an axis,
    /// of eight texels each.
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
        label: &str,
        [width, height]: [u32; 2],
    ) -> Result<(wgpu::Texture, wgpu::TextureView)> {
        self.check_size(label, [width, height])?;
        let make = || {
            self.device.create_texture(&wgpu::TextureDescriptor {
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
            })
        };
        // How many bytes a texture may have is known to drivers alone.
        let texture = self.scoped(make).map_err(|why| {
            let bytes = u64::from(width) * u64::from(height) * u64::from(TEXEL_BYTES);
            let needed = format!("{width}x{height} ({bytes} bytes)");
            let limit = format!("the device's: {why}");
            Error::from(ErrorKind::Limit { what: label.to_owned(), needed, limit })
        })?;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok((texture, view))
    }
}
