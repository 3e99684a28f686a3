//! Lists the graphics adapters, and opens a device on one of them.

use std::sync::{Arc, Mutex, PoisonError};

use wgpu::{Adapter, Device, DeviceType, Queue};

use crate::error::{Error, Result};

/// Which adapters are acceptable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterChoice {
    /// Hardware adapters only.
    Hardware,
    /// A hardware adapter if there is one, else a software adapter.
    Any,
}

/// One line of text per adapter: name, kind, driver, and the limits that matter here.
pub fn adapters() -> Vec<String> {
    found().iter().map(described).collect()
}

/// Records errors of a device that no error scope has caught.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    /// Why the device was lost, if it was.
    lost: Arc<Mutex<Option<String>>>,
    /// The first error since the last query.
    error: Arc<Mutex<Option<String>>>,
}

impl Watch {
    pub(super) fn of(device: &Device) -> Self {
        let watch = Self::default();
        let keep = |place: &Arc<Mutex<Option<String>>>| {
            let place = place.clone();
            move |why: String| {
                place.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
            }
        };
        let (lost, error) = (keep(&watch.lost), keep(&watch.error));
        device.set_device_lost_callback(move |reason, why| lost(format!("{reason:?}: {why}")));
        device.on_uncaptured_error(Arc::new(move |what: wgpu::Error| error(what.to_string())));
        watch
    }

    /// The result of `work`; an error if the device is lost, or if it reported an error that `work`
    /// did not notice.
    pub(super) fn over<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let lost = || {
            let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
            lost.as_ref().map(|why| Error::gpu(format!("the device is lost: {why}")))
        };
        if let Some(lost) = lost() {
            return Err(lost);
        }
        let found = work();
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner).take();
        match (lost(), found, error) {
            (Some(lost), ..) => Err(lost),
            (None, Ok(_), Some(error)) => Err(Error::gpu(error)),
            (None, found, _) => found,
        }
    }
}

/// Opens a device on the best adapter that `choice` allows. Also returns its description, and a
/// watch on its errors.
pub(super) fn open(choice: AdapterChoice) -> Result<(Device, Queue, String, Watch)> {
    if choice == AdapterChoice::Hardware && !hardware_in_sight() {
        return Err(Error::gpu("no hardware adapter"));
    }
    let adapter = found().into_iter().next().filter(|adapter| {
        choice == AdapterChoice::Any || is_hardware(adapter.get_info().device_type)
    });
    let Some(adapter) = adapter else {
        let why = match choice {
            AdapterChoice::Hardware => "no hardware adapter",
            AdapterChoice::Any => "no graphics adapter (is a Vulkan driver installed?)",
        };
        return Err(Error::gpu(why));
    };
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("deepshadow"),
        required_features: adapter.features() & wanted_features(),
        required_limits: adapter.limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
        .map_err(|error| Error::gpu(error.to_string()))?;
    let watch = Watch::of(&device);
    let info = adapter.get_info();
    Ok((device, queue, name(&info), watch))
}

/// The name of a backend on this adapter.
pub(super) fn name(info: &wgpu::AdapterInfo) -> String {
    format!("gpu, {} ({})", info.name, info.backend)
}

/// Whether it is worth asking drivers for hardware, which takes time: on Linux there is none
/// without a device node.
fn hardware_in_sight() -> bool {
    let nodes =
        ["/dev/dri", "/dev/nvidiactl", "/dev/nvidia0", "/dev/dxg", "/dev/kgsl-3d0", "/dev/mali0"];
    !cfg!(target_os = "linux") || nodes.iter().any(|node| std::path::Path::new(node).exists())
}

/// Features that the renderer uses if they exist: filtering of f32 textures, for exact voxels, and
/// timestamps.
pub(super) fn wanted_features() -> wgpu::Features {
    wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::TIMESTAMP_QUERY
}

/// The adapters that can run the passes, the best first.
fn found() -> Vec<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    adapters.retain(|adapter| {
        adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
    });
    let rank = |adapter: &Adapter| match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    adapters.sort_by_key(rank);
    adapters
}

fn is_hardware(kind: DeviceType) -> bool {
    matches!(kind, DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu)
}

fn described(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    let limits = adapter.limits();
    let kind = if is_hardware(info.device_type) { "hardware" } else { "software" };
    format!(
        "{} ({}, {kind}; {} {}): 3D textures to {}, storage bindings to {} MiB, f32 filtering {}",
        info.name,
        info.backend,
        info.driver,
        info.driver_info,
        limits.max_texture_dimension_3d,
        limits.max_storage_buffer_binding_size >> 20,
        if adapter.features().contains(wgpu::Features::FLOAT32_FILTERABLE) { "yes" } else { "no" },
    )
}
