//! What can draw: the processor, and a GPU.

use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

use deepshadow::gpu::GpuBackend;
use deepshadow::settings::MapKind;
use deepshadow::{Backend, CpuBackend, Error, Result, Scene, Settings};

/// The choice of what draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
pub enum Device {
    /// A hardware GPU if there is one, else the processor.
    #[default]
    Auto,
    /// The window's GPU, even if it is software.
    Gpu,
    /// The processor.
    Cpu,
}

impl Device {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Gpu, Self::Cpu];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }
}

impl FromStr for Device {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL
            .into_iter()
            .find(|one| one.name() == text)
            .ok_or_else(|| Error::value("device", format!("'{text}' is not one of auto, gpu, cpu")))
    }
}

/// What there is.
#[derive(Clone, Copy)]
pub struct Devices {
    gpu: Option<&'static GpuBackend>,
    is_hardware: bool,
    /// Whether the GPU has failed.
    failed: &'static AtomicBool,
}

static CPU: CpuBackend = CpuBackend;

impl Devices {
    /// The processor, and a GPU, which may be a program that imitates one.
    pub fn new(gpu: Option<GpuBackend>, is_hardware: bool) -> Self {
        let failed: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
        // Ending the process closes a device faster than the driver does.
        let gpu = gpu.map(|gpu| &*Box::leak(Box::new(gpu)));
        Self { gpu, is_hardware, failed }
    }

    /// Whether the window has a GPU that can draw.
    pub fn has_gpu(&self) -> bool {
        self.gpu.is_some() && !self.failed.load(Ordering::Relaxed)
    }

    /// The GPU is not asked again.
    pub fn give_up_gpu(&self) {
        self.failed.store(true, Ordering::Relaxed);
    }

    /// The GPU, if `device` allows it and it can draw `scene` with `settings`.
    pub fn gpu(
        &self,
        device: Device,
        scene: &Scene,
        settings: &Settings,
    ) -> Option<&'static GpuBackend> {
        let allowed = match device {
            Device::Auto => self.is_hardware,
            Device::Gpu => true,
            Device::Cpu => false,
        };
        let kind = settings.map.kind.unwrap_or_default();
        self.gpu.filter(|gpu| {
            let shows = scene.surfaces.is_empty() || gpu.draws_surfaces(kind);
            allowed && self.has_gpu() && gpu.builds(kind) && shows
        })
    }

    /// The processor.
    pub fn cpu() -> &'static dyn Backend {
        &CPU
    }
}

/// What drivers compile shaders anew for.
#[derive(Clone, Debug, PartialEq)]
pub struct Features(MapKind, Vec<bool>, String);

impl Features {
    /// Those of a picture.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        let bodies = scene.media.bodies();
        let any = |has: fn(&deepshadow::scene::Medium) -> bool| {
            bodies.iter().any(|body| has(&body.medium))
        };
        let has = vec![
            bodies.is_empty(),
            bodies.len() > 1,
            any(|medium| medium.transfer.is_some()),
            any(|medium| medium.color.is_some()),
            any(|medium| medium.emission.is_some()),
            any(|medium| medium.modulation.is_some()),
            any(|medium| medium.tint != deepshadow::glam::DVec3::ONE),
            scene.surfaces.is_empty(),
            settings.view.octaves > 0,
        ];
        let map = &settings.map;
        let names = (map.filter, map.threshold.lookup, map.fragments.slices, settings.view.shading);
        Self(map.kind.unwrap_or_default(), has, format!("{names:?}"))
    }
}
