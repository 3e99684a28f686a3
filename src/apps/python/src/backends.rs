//! The backend that a caller names.

use std::ops::Deref;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use deepshadow::backend::Fallback;
use deepshadow::gpu::{AdapterChoice, GpuBackend};
use deepshadow::settings::MapKind;
use deepshadow::{Backend, CpuBackend, Error, Result};

/// A backend at work.
pub struct Worker {
    backend: Guarded,
    said: Arc<Mutex<Vec<String>>>,
}

enum Guarded {
    /// Its errors are the caller's.
    Not(&'static dyn Backend),
    /// The processor takes over when it fails.
    Yes(Fallback<'static>),
}

impl Deref for Worker {
    type Target = dyn Backend;

    fn deref(&self) -> &Self::Target {
        match &self.backend {
            Guarded::Not(backend) => *backend,
            Guarded::Yes(backend) => backend,
        }
    }
}

impl Worker {
    fn new(backend: &'static dyn Backend) -> Self {
        Self { backend: Guarded::Not(backend), said: Arc::default() }
    }

    fn guarded(gpu: &'static dyn Backend) -> Self {
        let said: Arc<Mutex<Vec<String>>> = Arc::default();
        let heard = said.clone();
        let say = move |line: &str| {
            heard.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned());
        };
        Self { backend: Guarded::Yes(Fallback::new(gpu, &CpuBackend, say)), said }
    }

    /// What there is to say of the work, one line each.
    pub fn said(&self) -> Vec<String> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The backend `name` (`auto`, `gpu` or `cpu`) for maps of `kind`, of meshes and hair too if there
/// are `surfaces`. `auto` is a hardware GPU if there is one and if it suits, with the processor
/// behind it, else the processor; drivers take longer to compile the passes that draw surfaces than
/// processors to draw them, so for those it is the processor.
///
/// # Errors
/// If there is no such name, no adapter, or if the GPU does not build such maps.
pub fn named(name: &str, kind: MapKind, surfaces: bool) -> Result<Worker> {
    let suits = |gpu: &GpuBackend| gpu.builds(kind) && (!surfaces || gpu.draws_surfaces(kind));
    match name {
        "cpu" => Ok(Worker::new(&CpuBackend)),
        "auto" if surfaces => Ok(Worker::new(&CpuBackend)),
        "auto" => Ok(match hardware() {
            Some(gpu) if suits(gpu) => Worker::guarded(gpu),
            _ => Worker::new(&CpuBackend),
        }),
        "gpu" => {
            let gpu = any()?;
            if suits(gpu) {
                return Ok(Worker::new(gpu));
            }
            let of = if surfaces { " of meshes and hair" } else { "" };
            Err(Error::value("backend", format!("'{kind}' maps{of} need the backend 'cpu'")))
        }
        _ => Err(Error::value("backend", format!("'{name}' is not one of auto, gpu, cpu"))),
    }
}

/// The hardware GPU. A device does not outlive a fork: children of the process that opened it use
/// the processor.
fn hardware() -> Option<&'static GpuBackend> {
    static FOUND: OnceLock<(u32, Option<GpuBackend>)> = OnceLock::new();
    let own = std::process::id();
    let (process, gpu) =
        FOUND.get_or_init(|| (own, GpuBackend::open(AdapterChoice::Hardware).ok()));
    gpu.as_ref().filter(|_| *process == own)
}

/// Any adapter, also software.
fn any() -> Result<&'static GpuBackend> {
    static FOUND: OnceLock<(u32, GpuBackend)> = OnceLock::new();
    if let Some(gpu) = hardware() {
        return Ok(gpu);
    }
    let own = std::process::id();
    if FOUND.get().is_none() {
        // Whoever comes second closes its own.
        let _ = FOUND.set((own, GpuBackend::open(AdapterChoice::Any)?));
    }
    match FOUND.get() {
        Some((process, gpu)) if *process == own => Ok(gpu),
        _ => Err(Error::gpu("the device belongs to the process that this one was forked from")),
    }
}
