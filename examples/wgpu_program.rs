//! Another wgpu program, with its own device and shader, that uses the crate's shadow map and
//! lookup. It asks how much light reaches points along a line through a volume.
#![allow(clippy::print_stdout)]

use deepshadow::gpu::{GpuShadow, Renderer, shadow_wgsl};
use deepshadow::settings::MapKind;
use deepshadow::volume::{Axis, presets::Preset};
use deepshadow::wgpu::BufferUsages as Usage;
use deepshadow::{Error, Frame, Result, Scene, Settings, wgpu};

/// The program's shader. `shadow_at` is the crate's; its bindings are in bind group 1.
const SHADER: &str = "
@group(0) @binding(0) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> light: array<f32>;

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    light[id.x] = shadow_at(points[id.x].xyz);
}
";

const POINTS: usize = 64;

/// How much light reaches points from in front of a volume to behind it, 0..1.
pub fn example() -> Result<Vec<f32>> {
    // A device, as any program opens it.
    let failed = |error: &dyn std::fmt::Display| Error::gpu(error.to_string());
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()));
    let adapter = adapter.map_err(|error| failed(&error))?;
    let device = pollster::block_on(adapter.request_device(&Default::default()));
    let (device, queue) = device.map_err(|error| failed(&error))?;

    // The crate's map, built on that device.
    let mut scene = Scene::automatic(Preset::Bucky.volume(Axis::Y)?)?;
    scene.media.medium_mut().density_scale *= 4.0;
    let settings = Settings::default().with(|settings| settings.map.size = 128);
    let beam = scene.only_beam()?;
    let frame = Frame::new(&beam, &settings)?;
    let renderer = Renderer::new(&device, &queue);
    let media = renderer.upload(&beam.media)?;
    let frame = renderer.frame(&frame, &media)?;
    let map = renderer.map(settings.map.size)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    renderer.trace_threshold(&mut encoder, &media, &frame, &map)?;

    // The program's own points, results and pipeline.
    let bounds = scene.media.world_bounds();
    let way = scene.lights[0].direction_at(bounds.center());
    let way_through = (0..POINTS).map(|i| {
        let share = i as f64 / (POINTS - 1) as f64 - 0.5;
        (bounds.center() + share * bounds.size().length() * way).as_vec3().extend(0.0).to_array()
    });
    let way_through: Vec<[f32; 4]> = way_through.collect();
    let buffer = |size: usize, usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: size as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    let points = buffer(16 * POINTS, Usage::STORAGE | Usage::COPY_DST);
    let light = buffer(4 * POINTS, Usage::STORAGE | Usage::COPY_SRC);
    let readback = buffer(4 * POINTS, Usage::MAP_READ | Usage::COPY_DST);
    queue.write_buffer(&points, 0, bytemuck::cast_slice(&way_through));
    let ours = renderer.shadow_layout(MapKind::Threshold, wgpu::ShaderStages::COMPUTE)?;
    let shadow = renderer.shadow_group(&ours, &frame, GpuShadow::Threshold(&map));
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl((shadow_wgsl(1, MapKind::Threshold)? + SHADER).into()),
    });
    let storage = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let theirs = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[storage(0, true), storage(1, false)],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&theirs), Some(&ours)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout),
        module: &module,
        entry_point: Some("shade"),
        compilation_options: Default::default(),
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &theirs,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: points.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: light.as_entire_binding() },
        ],
    });
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &shadow, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&light, 0, &readback, 0, 4 * POINTS as u64);
    queue.submit([encoder.finish()]);

    // Read back the results.
    readback.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| failed(&error))?;
    let bytes = readback.get_mapped_range(..).map_err(|error| failed(&error))?;
    Ok(bytemuck::cast_slice(&bytes).to_vec())
}

#[allow(dead_code)]
fn main() -> Result<()> {
    println!("light from front to back: {:.2?}", example()?);
    Ok(())
}
