//! Tests of use inside another wgpu program: its own device and queue, the crate's passes, and the
//! crate's lookup in its shader.
#![cfg(feature = "gpu")]

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::frame::Frame;
use deepshadow::gpu::{GpuShadow, Renderer, Tile, shadow_wgsl};
use deepshadow::progress::Silent;
use deepshadow::scene::{LightKind, Scene};
use deepshadow::settings::{Coding, MapKind};
use deepshadow::shadow::Shadow;
use deepshadow::volume::presets::Preset;
use glam::{DVec3, Vec3};
use wgpu::util::DeviceExt;

use crate::support::scenes::{anchor_scene, settings};

const POINTS: usize = 64;

/// The other program's shader, which tells how much light reaches each of its points.
const THEIR_SHADER: &str = "
// Names that the crate's shaders have as well.
struct Frame { map: f32 }
const FARTHEST: f32 = 1.0;
fn front(frame: Frame) -> f32 { return frame.map * FARTHEST; }

@group(0) @binding(0) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> light: array<f32>;

@compute @workgroup_size(64)
fn their_pass(@builtin(global_invocation_id) id: vec3<u32>) {
    light[id.x] = front(Frame(shadow_at(points[id.x].xyz)));
}
";

/// The other program's device, with the limits that every device has; `None` if tests shall not use
/// a GPU.
fn their_device() -> Option<(wgpu::Instance, wgpu::Device, wgpu::Queue)> {
    if std::env::var("DEEPSHADOW_TEST_GPU").is_ok_and(|value| value == "skip") {
        eprintln!("SKIPPED: DEEPSHADOW_TEST_GPU=skip, nothing is tested on a GPU");
        return None;
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
    Some((instance, device, queue))
}

const NESTED: MapKind = MapKind::Coded(Coding::Nested);

/// A camera and a light that move, with passes that were prepared once: every picture equals that
/// of passes recorded anew, and nothing accumulates on the device from frame to frame.
#[test]
fn prepared_passes_follow_light_and_camera_and_leave_nothing_behind() {
    let Some((instance, device, queue)) = their_device() else { return };
    let renderer = Renderer::new(&device, &queue);
    let mut scene = anchor_scene(Preset::Bucky, 4.0, 32);
    let media = renderer.upload(&scene.media).unwrap();
    for kind in [MapKind::Threshold, MapKind::Fragments] {
        let settings = settings(32, [24, 16]).with(|s| s.map.kind = Some(kind));
        let of = |scene: &Scene| Frame::new(&scene.only_beam().unwrap(), &settings).unwrap();
        let image = renderer.image(24, 16).unwrap();
        let map = renderer.map(32).unwrap();
        let lists = renderer.fragments(Tile::rows(32, 0, 32, 64)).unwrap();
        let shadow = match kind {
            MapKind::Threshold => GpuShadow::Threshold(&map),
            _ => GpuShadow::Fragments(&lists),
        };
        let frame = renderer.frame(&of(&scene), &media).unwrap();
        let trace = match kind {
            MapKind::Threshold => renderer.prepare_threshold(&media, &frame, &map),
            _ => renderer.prepare_slices(&media, &frame, &lists),
        };
        let view = renderer.prepare_view(&media, &frame, shadow, &image);
        let mut pictures = Vec::new();
        let mut made = None;
        for i in 0..20 {
            let angle = 0.3 * f64::from(i);
            scene.camera.position = DVec3::new(2.0 * angle.sin(), 0.5, 2.0 * angle.cos());
            let direction = DVec3::new((2.0 * angle).cos(), -1.0, (2.0 * angle).sin());
            // A light with a position is not among the usual settings, which have shaders of their
            // own.
            scene.lights[0].kind = if i % 3 == 0 {
                LightKind::Point { position: -2.0 * direction }
            } else {
                LightKind::Directional { direction }
            };
            renderer.update(&frame, &of(&scene), &media).unwrap();
            renderer
                .submit(|encoder| {
                    trace.record(encoder)?;
                    view.record(encoder)
                })
                .unwrap();
            let report = instance.generate_report().unwrap();
            let hub = report.hub_report();
            let counts = [&hub.buffers, &hub.textures, &hub.texture_views, &hub.bind_groups]
                .map(|registry| registry.num_allocated);
            assert_eq!(*made.get_or_insert(counts), counts, "frame {i}");
            if i % 7 == 6 {
                pictures.push((scene.clone(), renderer.read(image.texture()).unwrap()));
                made = None;
            }
        }
        for (scene, picture) in &pictures {
            let fresh = renderer.frame(&of(scene), &media).unwrap();
            renderer
                .submit(|encoder| {
                    match kind {
                        MapKind::Threshold => {
                            renderer.trace_threshold(encoder, &media, &fresh, &map)?;
                        }
                        _ => renderer.trace_slices(encoder, &media, &fresh, &lists)?,
                    }
                    renderer.march_view(encoder, &media, &fresh, shadow, &image)
                })
                .unwrap();
            assert!(*picture == renderer.read(image.texture()).unwrap(), "{kind:?}");
        }
        assert!(pictures[0].1 != pictures[1].1, "nothing moved");
    }
}

/// The layout of the other program's own resources.
fn their_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
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
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[storage(0, true), storage(1, false)],
    })
}

#[test]
fn another_program_shades_its_points_with_our_shadow() {
    let Some((_, device, queue)) = their_device() else { return };

    // The crate's map, built on that device.
    let scene = anchor_scene(Preset::Bucky, 4.0, 32);
    let beam = scene.only_beam().unwrap();
    for kind in [MapKind::Threshold, MapKind::Fragments, NESTED] {
        let settings = settings(64, [1, 1]).with(|s| s.map.kind = Some(kind));
        let frame = Frame::new(&beam, &settings).unwrap();
        let renderer = Renderer::new(&device, &queue);
        let volume = renderer.upload(&scene.media).unwrap();
        let parameters = renderer.frame(&frame, &volume).unwrap();
        let map = renderer.map(settings.map.size).unwrap();
        let lists = renderer.fragments(Tile::rows(64, 0, 64, 64)).unwrap();
        let nested = renderer.nested(settings.map.size).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        let shadow = if kind == MapKind::Threshold {
            renderer.trace_threshold(&mut encoder, &volume, &parameters, &map).unwrap();
            GpuShadow::Threshold(&map)
        } else {
            renderer.trace_slices(&mut encoder, &volume, &parameters, &lists).unwrap();
            if kind == NESTED {
                let code = renderer.prepare_nested(&parameters, &lists, &nested);
                code.record(&mut encoder).unwrap();
                GpuShadow::Nested(&nested)
            } else {
                GpuShadow::Fragments(&lists)
            }
        };

        // The program's points: a column through the volume, from above it to below it.
        let points: Vec<[f32; 4]> = (0..POINTS)
            .map(|i| {
                let t = i as f32 / POINTS as f32 * 2.0 - 1.0;
                [0.13 * t, -1.2 * t, 0.21, 0.0]
            })
            .collect();
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let input = buffer(bytemuck::cast_slice(&points), wgpu::BufferUsages::STORAGE);
        let output =
            buffer(&[0; 4 * POINTS], wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let readback =
            buffer(&[0; 4 * POINTS], wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);

        // The program's pipeline: the crate's lookup in bind group 1, its own resources in group 0.
        let source = shadow_wgsl(1, kind).unwrap() + THEIR_SHADER;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let their_layout = their_layout(&device);
        let our_layout = renderer.shadow_layout(kind, wgpu::ShaderStages::COMPUTE).unwrap();
        let ours = renderer.shadow_group(&our_layout, &parameters, shadow);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&their_layout), Some(&our_layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some("their_pass"),
            compilation_options: Default::default(),
            cache: None,
        });
        let theirs = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &their_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
            ],
        });
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &theirs, &[]);
            pass.set_bind_group(1, &ours, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, 4 * POINTS as u64);
        queue.submit([encoder.finish()]);
        readback.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = readback.get_mapped_range(..).unwrap();
        let found: &[f32] = bytemuck::cast_slice(&bytes);

        // The CPU gives the same result.
        let cpu = CpuBackend.map(&beam, &settings, &Silent).unwrap();
        for (point, found) in points.iter().zip(found) {
            let world = Vec3::from_slice(point);
            let light = beam.view.coordinates(world.as_dvec3()).unwrap().as_vec3();
            let expected = cpu.lookup(0, light.x, light.y, light.z);
            assert!((found - expected).abs() < 0.02, "at {world}: {found}, not {expected}");
        }
        let darkest = found.iter().copied().fold(1.0, f32::min);
        assert!(found[0] == 1.0 && darkest < 0.1, "light above, shadow inside: {found:?}");
    }
}
