//! Lists the graphics adapters, and opens a device on one of them.

use std::sync::{Arc, Mutex, PoisonError};

use wgpu::{Adapter, Device, Queue};

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
pub async fn adapters_async() -> Vec<String> {
    found().await.iter().map(described).collect()
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

    /// An error if the device is lost.
    pub(super) fn alive(&self) -> Result<()> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        match &*lost {
            Some(why) => Err(Error::gpu(format!("the device is lost: {why}"))),
            None => Ok(()),
        }
    }

    /// `found`, which work on the device has resulted in; an error if the device is lost, or if it
    /// reported an error that the work did not notice.
    pub(super) fn over<T>(&self, found: Result<T>) -> Result<T> {
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner).take();
        self.alive()?;
        match (found, error) {
            (Ok(_), Some(error)) => Err(Error::gpu(error)),
            (found, _) => found,
        }
    }
}

/// Opens a device on the best adapter that `choice` allows. Also returns its description, and a
/// watch on its errors.
pub(super) async fn open(choice: AdapterChoice) -> Result<(Device, Queue, String, Watch)> {
    if choice == AdapterChoice::Hardware && !hardware_in_sight() {
        return Err(Error::gpu("no hardware adapter"));
    }
    let adapter = found()
        .await
        .into_iter()
        .next()
        .filter(|adapter| choice == AdapterChoice::Any || is_hardware(&adapter.get_info()));
    let Some(adapter) = adapter else {
        let why = match choice {
            AdapterChoice::Hardware => "no hardware adapter",
            AdapterChoice::Any if cfg!(target_family = "wasm") => "the browser offers no WebGPU",
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
    let (device, queue) =
        adapter.request_device(&descriptor).await.map_err(|error| Error::gpu(error.to_string()))?;
    let watch = Watch::of(&device);
    let info = adapter.get_info();
    Ok((device, queue, name(&info), watch))
}

/// The name of a backend on this adapter. Browsers may hide the adapter's.
pub(super) fn name(info: &wgpu::AdapterInfo) -> String {
    match &*info.name {
        "" => format!("gpu ({})", info.backend),
        name => format!("gpu, {name} ({})", info.backend),
    }
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
#[cfg(not(target_family = "wasm"))]
async fn found() -> Vec<Adapter> {
    use wgpu::DeviceType;

    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
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

/// The adapter that the browser takes for heavy work, if it offers one. Browsers list none.
#[cfg(target_family = "wasm")]
async fn found() -> Vec<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::BROWSER_WEBGPU;
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    };
    wgpu::Instance::new(descriptor).request_adapter(&options).await.into_iter().collect()
}

/// Whether shaders run on graphics hardware, as far as a browser tells.
#[cfg(target_family = "wasm")]
fn is_hardware(info: &wgpu::AdapterInfo) -> bool {
    let name = info.name.to_lowercase();
    let software = ["swiftshader", "llvmpipe", "lavapipe", "warp", "software", "cpu"];
    info.device_type != wgpu::DeviceType::Cpu && !software.iter().any(|word| name.contains(word))
}

/// Whether shaders run on graphics hardware.
#[cfg(not(target_family = "wasm"))]
fn is_hardware(info: &wgpu::AdapterInfo) -> bool {
    use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};

    matches!(info.device_type, DiscreteGpu | IntegratedGpu | VirtualGpu)
}

fn described(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    let limits = adapter.limits();
    let kind = if is_hardware(&info) { "hardware" } else { "software" };
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
