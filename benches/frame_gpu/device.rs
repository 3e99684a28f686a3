//! A device of the benchmark's own, on which it can also run and time passes that are not the
//! crate's.

use deepshadow::gpu::Renderer;
use wgpu::{Adapter, DeviceType, Features};

/// A device and the crate's renderer on it.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub renderer: Renderer,
    /// The adapter in one line.
    pub description: String,
}

impl Gpu {
    /// Opens the best adapter, with the features that the crate uses and, if supported, timestamps
    /// between passes.
    pub fn open() -> Self {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
        let instance = wgpu::Instance::new(descriptor);
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let adapter = adapters.into_iter().filter(computes).min_by_key(rank).unwrap();
        let wanted = Features::FLOAT32_FILTERABLE
            | Features::TIMESTAMP_QUERY
            | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .unwrap();
        let renderer = Renderer::new(&device, &queue);
        let info = adapter.get_info();
        let description =
            format!("gpu, {} ({}; {} {})", info.name, info.backend, info.driver, info.driver_info);
        Self { device, queue, renderer, description }
    }

    /// Whether the adapter is software on the processor.
    pub fn is_software(&self) -> bool {
        self.device.adapter_info().device_type == DeviceType::Cpu
    }
}

fn computes(adapter: &Adapter) -> bool {
    adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
}

/// The rank of an adapter in the crate's order.
fn rank(adapter: &Adapter) -> u32 {
    match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}
