//! Chooses the backend.

use std::str::FromStr;
use std::thread::{self, JoinHandle};

use crate::backend::{Backend, Expected, Fallback};
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::settings::MapKind;

/// The values of `--backend`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BackendChoice {
    /// A hardware GPU if there is one, else the CPU.
    Auto,
    /// Any adapter, also software.
    Gpu,
    /// The processor.
    Cpu,
}

impl FromStr for BackendChoice {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "auto" => Ok(Self::Auto),
            "gpu" => Ok(Self::Gpu),
            "cpu" => Ok(Self::Cpu),
            _ => Err(Error::value("backend", format!("'{text}' is not one of auto, gpu, cpu"))),
        }
    }
}

/// A GPU backend, if there is one.
type Found = Result<Option<Box<dyn Backend>>>;

/// A backend that is being opened on a thread of its own, because drivers are slow.
pub(super) struct Opening {
    choice: BackendChoice,
    /// `None` if no thread was started.
    gpu: Option<JoinHandle<Found>>,
}

impl Opening {
    /// Starts to open what `choice` means on this machine, and prepares it for what is expected. If
    /// the CPU was requested, no adapter is opened.
    pub(super) fn begin(
        choice: BackendChoice,
        expected: Option<(Option<MapKind>, Expected)>,
    ) -> Self {
        let look = move || {
            let gpu = match choice {
                BackendChoice::Cpu => None,
                BackendChoice::Gpu => Some(gpu()?),
                BackendChoice::Auto => gpu_hardware(),
            };
            if let (Some(gpu), Some((kind, expected))) = (&gpu, expected)
                && kind.is_none_or(|kind| gpu.builds(kind))
            {
                gpu.expect(kind, expected);
            }
            Ok(gpu)
        };
        // If no thread can be started, the backend is opened when it is needed.
        let gpu = match choice {
            BackendChoice::Cpu => None,
            BackendChoice::Gpu | BackendChoice::Auto => thread::Builder::new().spawn(look).ok(),
        };
        Self { choice, gpu }
    }

    /// The backend for maps of `kind`, of meshes and hair too if there are `surfaces`. If a GPU
    /// fails later, `say` receives the reason for the change to the processor.
    pub(super) fn finish(
        mut self,
        kind: Option<MapKind>,
        surfaces: bool,
        say: fn(&str),
    ) -> Result<&'static dyn Backend> {
        let found = match (self.gpu.take(), self.choice) {
            (Some(looking), _) => looking.join().map_err(|_| Error::gpu("the driver failed")),
            (None, BackendChoice::Gpu) => Ok(gpu().map(Some)),
            (None, BackendChoice::Auto) => Ok(Ok(gpu_hardware())),
            (None, BackendChoice::Cpu) => Ok(Ok(None)),
        };
        let found = match (found, self.choice) {
            (Ok(found), _) => found?,
            (Err(_), BackendChoice::Auto) => None,
            (Err(error), _) => return Err(error),
        };
        let builds = |gpu: &dyn Backend| {
            let kind = kind.unwrap_or_default();
            gpu.builds(kind) && (!surfaces || gpu.draws_surfaces(kind))
        };
        match (found, kind) {
            (Some(gpu), _) if builds(&*gpu) && self.choice == BackendChoice::Auto => {
                Ok(kept(Box::new(Fallback::new(kept(gpu), &CpuBackend, say))))
            }
            (Some(gpu), _) if builds(&*gpu) => Ok(kept(gpu)),
            (Some(_), kind) if surfaces && self.choice == BackendChoice::Gpu => {
                let kind = kind.unwrap_or_default();
                let why = format!("'{kind}' maps of meshes and hair need the backend 'cpu'");
                Err(Error::value("backend", why))
            }
            (Some(_), Some(kind)) if self.choice == BackendChoice::Gpu => {
                Err(Error::value("map", format!("'{kind}' maps need --backend cpu")))
            }
            _ => Ok(&CpuBackend),
        }
    }
}

/// Drivers do not bear that a process ends while they open a device: it would be aborted.
impl Drop for Opening {
    fn drop(&mut self) {
        if let Some(looking) = self.gpu.take() {
            // What it found does not matter any more.
            drop(looking.join());
        }
    }
}

/// Keeps a backend until the program ends; ending the process closes a device faster than the
/// driver does.
fn kept(backend: Box<dyn Backend>) -> &'static dyn Backend {
    Box::leak(backend)
}

#[cfg(feature = "gpu")]
fn gpu() -> Result<Box<dyn Backend>> {
    use crate::gpu::{AdapterChoice, GpuBackend};
    Ok(Box::new(GpuBackend::open(AdapterChoice::Any)?))
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Box<dyn Backend>> {
    Err(Error::gpu("this build has no GPU backend (feature `gpu`)"))
}

#[cfg(feature = "gpu")]
fn gpu_hardware() -> Option<Box<dyn Backend>> {
    use crate::gpu::{AdapterChoice, GpuBackend};
    GpuBackend::open(AdapterChoice::Hardware).ok().map(|gpu| Box::new(gpu) as Box<dyn Backend>)
}

#[cfg(not(feature = "gpu"))]
fn gpu_hardware() -> Option<Box<dyn Backend>> {
    None
}
