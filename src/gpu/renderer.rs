//! The passes on a device: pipelines, textures, submission and readback. Works on any device and
//! queue, the caller's own included; nothing is submitted or waited for unless asked.

use bytemuck::bytes_of;
use wgpu::util::DeviceExt;
use wgpu::{BindGroupEntry, BindGroupLayoutEntry, BindingResource, BindingType, ShaderStages};

use super::volume::GpuVolume;
use super::{PASSES, link};
use crate::error::{Error, ErrorKind, Result};
use crate::frame::Frame;
use crate::volume::Volume;

/// Threads along each edge of a workgroup, as in the shaders.
const WORKGROUP: u32 = 8;
/// Maps and pictures: four f32.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const TEXEL_BYTES: u32 = 16;

/// A frame's parameters on a device.
#[derive(Clone, Debug)]
pub struct GpuFrame {
    buffer: wgpu::Buffer,
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

/// The passes, compiled for a device.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    sampler: wgpu::Sampler,
    trace_threshold: wgpu::ComputePipeline,
    march_view: wgpu::ComputePipeline,
}

impl Renderer {
    /// Compiles the passes for a device.
    ///
    /// # Errors
    /// If the device refuses a shader.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self> {
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let frame = uniform(0);
        let [voxels, trilinear] = [texture(1, wgpu::TextureViewDimension::D3, true), sampler(2)];
        let [map, out] = [texture(3, wgpu::TextureViewDimension::D2, false), output(4)];
        let trace = pipeline(device, PASSES[0], &[frame, voxels, trilinear, out])?;
        let march = pipeline(device, PASSES[1], &[frame, voxels, trilinear, map, out])?;
        let renderer = Self {
            device: device.clone(),
            queue: queue.clone(),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("trilinear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            trace_threshold: trace,
            march_view: march,
        };
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(Error::gpu(error.to_string())),
            None => Ok(renderer),
        }
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
        let mut frame = *frame;
        frame.world_origin.w = volume.scale();
        let buffer = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytes_of(&frame),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Ok(GpuFrame { buffer })
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
        let size = map.texture.size();
        let entries = [
            entry(0, frame.buffer.as_entire_binding()),
            entry(1, BindingResource::TextureView(volume.view())),
            entry(2, BindingResource::Sampler(&self.sampler)),
            entry(4, BindingResource::TextureView(&map.view)),
        ];
        self.record(encoder, &self.trace_threshold, &entries, size);
    }

    /// Records pass `march_view`: fills `image` for the camera of `frame`, lit through `map`.
    pub fn march_view(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        volume: &GpuVolume,
        frame: &GpuFrame,
        map: &GpuMap,
        image: &GpuImage,
    ) {
        let size = image.texture.size();
        let entries = [
            entry(0, frame.buffer.as_entire_binding()),
            entry(1, BindingResource::TextureView(volume.view())),
            entry(2, BindingResource::Sampler(&self.sampler)),
            entry(3, BindingResource::TextureView(&map.view)),
            entry(4, BindingResource::TextureView(&image.view)),
        ];
        self.record(encoder, &self.march_view, &entries, size);
    }

    /// Records with `record`, submits, and waits for the device to finish.
    ///
    /// # Errors
    /// What the device finds wrong with the work, or that it was lost.
    pub fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<()> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(&mut encoder);
        self.queue.submit([encoder.finish()]);
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        let found = [pollster::block_on(validation.pop()), pollster::block_on(memory.pop())];
        if let Some(error) = found.into_iter().flatten().next() {
            return Err(Error::gpu(error.to_string()));
        }
        waited.map(|_| ()).map_err(|error| Error::gpu(error.to_string()))
    }

    /// Copies a map or a picture to the host, row by row.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>> {
        let size = texture.size();
        let row = size.width * TEXEL_BYTES;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: u64::from(padded) * u64::from(size.height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(padded),
            rows_per_image: Some(size.height),
        };
        self.submit(|encoder| {
            let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
        })?;
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody listens only if the caller is gone.
            let _ = sender.send(result);
        });
        let failed = |why: String| Error::gpu(format!("readback: {why}"));
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| failed(error.to_string()))?;
        receiver
            .recv()
            .map_err(|error| failed(error.to_string()))?
            .map_err(|error| failed(error.to_string()))?;
        let bytes = buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))?;
        let rows = bytes.chunks_exact(padded as usize);
        Ok(rows
            .flat_map(|r| bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&r[..row as usize]))
            .collect())
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

    fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        entries: &[BindGroupEntry<'_>],
        size: wgpu::Extent3d,
    ) {
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(
            size.width.div_ceil(WORKGROUP),
            size.height.div_ceil(WORKGROUP),
            1,
        );
    }
}

fn pipeline(
    device: &wgpu::Device,
    (name, source): (&str, &str),
    entries: &[BindGroupLayoutEntry],
) -> Result<wgpu::ComputePipeline> {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(link::linked(source)?.into()),
    });
    let bindings = device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(&bindings)],
        immediate_size: 0,
    });
    Ok(device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    }))
}

fn entry(binding: u32, resource: BindingResource<'_>) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource }
}

fn layout_entry(binding: u32, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility: ShaderStages::COMPUTE, ty, count: None }
}

fn uniform(binding: u32) -> BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Uniform;
    let least = std::num::NonZero::new(size_of::<Frame>() as u64);
    layout_entry(
        binding,
        BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: least },
    )
}

fn texture(
    binding: u32,
    view_dimension: wgpu::TextureViewDimension,
    filterable: bool,
) -> BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Float { filterable };
    layout_entry(binding, BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

fn sampler(binding: u32) -> BindGroupLayoutEntry {
    layout_entry(binding, BindingType::Sampler(wgpu::SamplerBindingType::Filtering))
}

fn output(binding: u32) -> BindGroupLayoutEntry {
    let access = wgpu::StorageTextureAccess::WriteOnly;
    let view_dimension = wgpu::TextureViewDimension::D2;
    layout_entry(binding, BindingType::StorageTexture { access, format: FORMAT, view_dimension })
}
