//! The passes on a device: pipelines, textures, submission and readback. Works on any device and
//! queue, the caller's own included; nothing is submitted or waited for unless asked.

use bytemuck::bytes_of;
use wgpu::util::DeviceExt;
use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{self, FORMAT, at, entry, pipeline, read, read_write};
use super::fragments::GpuFragments;
use super::volume::GpuVolume;
use super::{lists, pass};
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::settings::MapKind;
use crate::volume::Volume;

/// Threads along each edge of a workgroup, as in the shaders.
const WORKGROUP: u32 = 8;
/// Bytes of a map's texel or a picture's pixel.
pub(super) const TEXEL_BYTES: u32 = 16;

/// A frame's parameters on a device.
#[derive(Clone, Debug)]
pub struct GpuFrame {
    buffer: wgpu::Buffer,
    /// Whether the camera march needs nothing but the usual settings.
    usual: bool,
}

impl GpuFrame {
    /// The uniform buffer, laid out as [`Frame`].
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}

/// Declares a texture of four f32 a texel with its view.
macro_rules! texture {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub struct $name {
            texture: wgpu::Texture,
            view: wgpu::TextureView,
        }

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

texture! {
    /// A threshold map on a device: R, G, B = depths at three opacities, A = largest opacity.
    GpuMap
}

texture! {
    /// A picture on a device: premultiplied linear radiance and opacity.
    GpuImage
}

/// The map that a picture is lit through.
#[derive(Clone, Copy, Debug)]
pub enum GpuShadow<'a> {
    /// Four numbers a texel.
    Threshold(&'a GpuMap),
    /// Lists of fragments, of all texels.
    Fragments(&'a GpuFragments),
}

/// The passes, compiled for a device.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    sampler: wgpu::Sampler,
    pub(super) passes: Passes,
}

/// Pipelines, named as their passes.
#[derive(Debug)]
pub(super) struct Passes {
    trace_threshold: wgpu::ComputePipeline,
    pub(super) trace_slices: wgpu::ComputePipeline,
    pub(super) raster_slices: wgpu::RenderPipeline,
    pub(super) sort_fragments: wgpu::ComputePipeline,
    pub(super) link_neighbors: wgpu::ComputePipeline,
    /// For the usual settings and for all.
    march_view: [wgpu::ComputePipeline; 2],
    march_view_fragments: [wgpu::ComputePipeline; 2],
}

impl Passes {
    fn new(device: &wgpu::Device) -> Result<Self> {
        let (frame, tile, output) = (bindings::frame(), bindings::tile(), bindings::output());
        let [voxels, trilinear] = bindings::volume();
        let compute = |name, map, entries: &[_]| pipeline(device, pass(name)?, map, entries);
        let threshold = |name, entries: &[_]| compute(name, MapKind::Threshold, entries);
        let fragments = |name, entries: &[_]| compute(name, MapKind::Fragments, entries);
        let march = |map, entries: &[_]| {
            bindings::usual_and_general(device, pass("march_view")?, map, entries)
        };
        let [runs, nodes, heads, elements, counters] =
            [at::RUNS, at::NODES, at::HEADS, at::ELEMENTS, at::COUNTERS].map(read_write);
        let map = bindings::threshold_map();
        let lists = [read(at::RUNS), read(at::NODES)];
        let links = read_write(at::LINKS);
        Ok(Self {
            trace_threshold: threshold("trace_threshold", &[frame, voxels, trilinear, output])?,
            trace_slices: fragments(
                "trace_slices",
                &[frame, voxels, trilinear, runs, nodes, tile, counters],
            )?,
            raster_slices: lists::raster_pipeline(device, pass("raster_slices")?)?,
            sort_fragments: fragments(
                "sort_fragments",
                &[frame, runs, nodes, tile, heads, elements, counters],
            )?,
            link_neighbors: fragments("link_neighbors", &[lists[0], lists[1], links, tile])?,
            march_view: march(MapKind::Threshold, &[frame, voxels, trilinear, map, output])?,
            march_view_fragments: march(
                MapKind::Fragments,
                &[frame, voxels, trilinear, output, lists[0], lists[1], read(at::LINKS)],
            )?,
        })
    }
}

impl Renderer {
    /// Compiles the passes for a device.
    ///
    /// # Errors
    /// If the device refuses a shader.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self> {
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let renderer = Self {
            device: device.clone(),
            queue: queue.clone(),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("trilinear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            passes: Passes::new(device)?,
        };
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(Error::gpu(error.to_string())),
            None => Ok(renderer),
        }
    }

    pub(super) fn device(&self) -> &wgpu::Device {
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

    /// What passes bind of a volume.
    pub(super) fn volume_entries<'a>(&'a self, volume: &'a GpuVolume) -> [BindGroupEntry<'a>; 2] {
        [
            entry(at::VOXELS, BindingResource::TextureView(volume.view())),
            entry(at::TRILINEAR, BindingResource::Sampler(&self.sampler)),
        ]
    }

    /// Puts a volume's voxels on the device.
    ///
    /// # Errors
    /// If it is larger than the device's textures can be.
    pub fn upload(&self, volume: &Volume) -> Result<GpuVolume> {
        GpuVolume::upload(&self.device, &self.queue, volume)
    }

    /// Puts the parameters of a frame of `volume` on the device.
    ///
    /// # Errors
    /// If the map or the picture is larger than the device's textures can be.
    pub fn frame(&self, frame: &Frame, volume: &GpuVolume) -> Result<GpuFrame> {
        let [width, height, _, map] = frame.sizes;
        let limit = self.device.limits().max_texture_dimension_2d;
        for (what, size) in [("picture", width), ("picture", height), ("map", map)] {
            if size > limit {
                let (needed, limit) = (format!("{size} pixels"), limit.to_string());
                return Err(ErrorKind::Limit { what: what.to_owned(), needed, limit }.into());
            }
        }
        let usual = frame.is_usual();
        let mut frame = *frame;
        frame.world_origin.w = volume.scale();
        let buffer = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytes_of(&frame),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Ok(GpuFrame { buffer, usual })
    }

    /// An empty map of `size` squared texels.
    ///
    /// # Errors
    /// If the device's textures cannot be as large.
    pub fn map(&self, size: u32) -> Result<GpuMap> {
        let (texture, view) = self.texture("threshold map", size, size)?;
        Ok(GpuMap { texture, view })
    }

    /// An empty picture.
    ///
    /// # Errors
    /// If the device's textures cannot be as large.
    pub fn image(&self, width: u32, height: u32) -> Result<GpuImage> {
        let (texture, view) = self.texture("picture", width, height)?;
        Ok(GpuImage { texture, view })
    }

    /// Fills a map from the host: texels row by row, as many as it has.
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
    pub fn trace_threshold(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        volume: &GpuVolume,
        frame: &GpuFrame,
        map: &GpuMap,
    ) {
        let [voxels, trilinear] = self.volume_entries(volume);
        let entries = [
            entry(at::FRAME, frame.buffer.as_entire_binding()),
            voxels,
            trilinear,
            entry(at::OUTPUT, BindingResource::TextureView(&map.view)),
        ];
        let size = map.texture.width();
        self.record(encoder, &self.passes.trace_threshold, &entries, [size, size]);
    }

    /// Records pass `march_view`: fills `image` for the camera of `frame`, lit through `shadow`.
    pub fn march_view(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        volume: &GpuVolume,
        frame: &GpuFrame,
        shadow: GpuShadow<'_>,
        image: &GpuImage,
    ) {
        let [voxels, trilinear] = self.volume_entries(volume);
        let mut entries = vec![
            entry(at::FRAME, frame.buffer.as_entire_binding()),
            voxels,
            trilinear,
            entry(at::OUTPUT, BindingResource::TextureView(&image.view)),
        ];
        let [usual, general] = match shadow {
            GpuShadow::Threshold(map) => {
                entries.push(entry(at::THRESHOLD_MAP, BindingResource::TextureView(&map.view)));
                &self.passes.march_view
            }
            GpuShadow::Fragments(map) => {
                entries.push(entry(at::RUNS, map.runs().as_entire_binding()));
                entries.push(entry(at::NODES, map.nodes().as_entire_binding()));
                entries.push(entry(at::LINKS, map.links().as_entire_binding()));
                &self.passes.march_view_fragments
            }
        };
        let pipeline = if frame.usual { usual } else { general };
        let size = image.texture.size();
        self.record(encoder, pipeline, &entries, [size.width, size.height]);
    }

    fn texture(
        &self,
        label: &str,
        width: u32,
        height: u32,
    ) -> Result<(wgpu::Texture, wgpu::TextureView)> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if width.max(height) > limit {
            let (what, limit) = (label.to_owned(), format!("{limit} on an edge"));
            return Err(
                ErrorKind::Limit { what, needed: format!("{width}x{height}"), limit }.into()
            );
        }
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
        Ok((texture, view))
    }

    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        entries: &[BindGroupEntry<'_>],
        [width, height]: [u32; 2],
    ) {
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(width.div_ceil(WORKGROUP), height.div_ceil(WORKGROUP), 1);
    }
}
