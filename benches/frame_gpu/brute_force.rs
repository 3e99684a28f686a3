//! The brute-force frame, and the speed of the texture units alone, with shaders that share nothing
//! with the crate's except the parameters of a frame.

use deepshadow::frame::Frame;
use deepshadow::volume::Volume;
use half::f16;
use rayon::prelude::*;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, CommandEncoder, TextureFormat, TextureUsages};

use crate::device::Gpu;

/// Steps of every ray, as in `brute_force.wgsl`.
pub const STEPS: u32 = 512;
/// Fetches per thread, as in `fetches.wgsl`.
pub const FETCHES: u32 = 512;
/// Threads along each edge of a workgroup, as in both shaders.
const WORKGROUP: u32 = 8;

/// The passes for a volume, ready to be recorded.
pub struct BruteForce {
    /// The map, then the picture.
    passes: [Pass; 2],
    fetches: Pass,
    image: wgpu::Texture,
    /// The volume's texture format.
    pub format: TextureFormat,
}

struct Pass {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    groups: u32,
}

impl BruteForce {
    /// Prepares the passes; `rays` squared threads fetch.
    pub fn new(gpu: &Gpu, volume: &Volume, frame: &Frame, rays: u32) -> Self {
        let device = &gpu.device;
        let texels = Texels::of(volume, gpu);
        let voxels = texels.upload(gpu, volume.dims());
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let mut frame = *frame;
        frame.media.stored_one = texels.scale;
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytemuck::bytes_of(&frame),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let (size, map_size) = (frame.view.width, frame.map.size);
        let map = target(gpu, map_size, TextureFormat::Rgba32Float);
        let image = target(gpu, size, TextureFormat::Rgba32Float);
        let sums = target(gpu, rays, TextureFormat::R32Float);
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let [voxels, map_view, image_view, sums] = [&voxels, &map, &image, &sums].map(view);
        let at = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let medium = [
            at(1, BindingResource::TextureView(&voxels)),
            at(2, BindingResource::Sampler(&sampler)),
        ];
        let parameters = at(0, uniform.as_entire_binding());
        let output = |view| at(4, BindingResource::TextureView(view));
        let [volume, sampler] = &medium;
        let shared = [parameters, volume.clone(), sampler.clone()];
        let [frames, fetches] = [
            concat!(
                include_str!("../../shaders/kernel/frame.wgsl"),
                include_str!("brute_force.wgsl")
            ),
            include_str!("fetches.wgsl"),
        ]
        .map(|source| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let map_entries = [&shared[..], &[output(&map_view)]].concat();
        let lookup = at(3, BindingResource::TextureView(&map_view));
        let view_entries = [&shared[..], &[lookup, output(&image_view)]].concat();
        let fetch_entries = [&medium[..], &[output(&sums)]].concat();
        Self {
            passes: [
                Pass::new(gpu, &frames, "brute_force_map", &map_entries, map_size),
                Pass::new(gpu, &frames, "brute_force_view", &view_entries, size),
            ],
            fetches: Pass::new(gpu, &fetches, "fetch", &fetch_entries, rays),
            image,
            format: texels.format,
        }
    }

    /// Records the map and the picture.
    pub fn record_frame(&self, encoder: &mut CommandEncoder) {
        for pass in &self.passes {
            pass.record(encoder);
        }
    }

    /// Records the fetches.
    pub fn record_fetches(&self, encoder: &mut CommandEncoder) {
        self.fetches.record(encoder);
    }

    /// The picture of a frame.
    pub fn picture(&self, gpu: &Gpu) -> Vec<[f32; 4]> {
        let record = |encoder: &mut _| {
            self.record_frame(encoder);
            Ok(())
        };
        gpu.renderer.submit(record).unwrap();
        gpu.renderer.read(&self.image).unwrap()
    }
}

impl Pass {
    fn new(
        gpu: &Gpu,
        module: &wgpu::ShaderModule,
        name: &str,
        entries: &[wgpu::BindGroupEntry<'_>],
        size: u32,
    ) -> Self {
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module,
            entry_point: Some(name),
            compilation_options: Default::default(),
            cache: None,
        });
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &pipeline.get_bind_group_layout(0),
            entries,
        });
        Self { pipeline, bindings, groups: size.div_ceil(WORKGROUP) }
    }

    fn record(&self, encoder: &mut CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(self.groups, self.groups, 1);
    }
}

/// A texture of `size` squared texels that passes write.
fn target(gpu: &Gpu, size: u32, format: TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("target"),
        size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::STORAGE_BINDING
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// A volume's values in the same format as the crate's texture.
struct Texels {
    format: TextureFormat,
    bytes: Vec<u8>,
    /// The density for which a texture value of 1 stands.
    scale: f32,
}

impl Texels {
    fn of(volume: &Volume, gpu: &Gpu) -> Self {
        let values = volume.values();
        let values = values.as_slice().unwrap();
        if gpu.is_software() && gpu.device.features().contains(wgpu::Features::FLOAT32_FILTERABLE) {
            let bytes = bytemuck::cast_slice(values).to_vec();
            return Self { format: TextureFormat::R32Float, bytes, scale: 1.0 };
        }
        for scale in [1.0_f32, 255.0] {
            let level = |v: f32| v / scale * 255.0;
            let whole = |v: f32| {
                let nearest = level(v).round();
                (level(v) - nearest).abs() <= nearest * 2e-7 && nearest <= 255.0
            };
            if values.par_iter().all(|&v| whole(v)) {
                let bytes = values.par_iter().map(|&v| level(v).round() as u8).collect();
                return Self { format: TextureFormat::R8Unorm, bytes, scale };
            }
        }
        let scale = volume.largest().max(f32::MIN_POSITIVE);
        let halves: Vec<f16> = values.par_iter().map(|&v| f16::from_f32(v / scale)).collect();
        let bytes = bytemuck::cast_slice(&halves).to_vec();
        Self { format: TextureFormat::R16Float, bytes, scale }
    }

    fn upload(&self, gpu: &Gpu, dims: [usize; 3]) -> wgpu::Texture {
        let [width, height, depth] = dims.map(|n| n as u32);
        let descriptor = wgpu::TextureDescriptor {
            label: Some("volume"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: self.format,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        };
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, &self.bytes)
    }
}
