//! Which backend computes.

use std::str::FromStr;

use super::fallback::Fallback;
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::settings::MapKind;

/// What `--backend` asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BackendChoice {
    /// A hardware GPU if there is one, else the CPU.
    Auto,
    /// Any adapter, software too.
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
            _ => Err(Error::value("backend", format!("'{text}' is none of auto, gpu, cpu"))),
        }
    }
}

/// The backend that `choice` means on this machine for maps of `kind`; `say` is told why it is no other one, where
/// that is only found out later. No adapter is looked for if the CPU was asked for.
pub(super) fn open(
    choice: BackendChoice,
    kind: Option<MapKind>,
    say: fn(&str),
) -> Result<Box<dyn Backend>> {
    let builds = |backend: &dyn Backend| kind.is_none_or(|kind| backend.builds(kind));
    match choice {
        BackendChoice::Cpu => Ok(Box::new(CpuBackend)),
        BackendChoice::Gpu => {
            let gpu = gpu()?;
            let kind = kind.filter(|_| !builds(&*gpu));
            kind.map_or(Ok(gpu), |kind| {
                Err(Error::value("map", format!("'{kind}' maps need --backend cpu")))
            })
        }
        BackendChoice::Auto => Ok(match gpu_hardware().filter(|gpu| builds(&**gpu)) {
            Some(gpu) => Box::new(Fallback::new(gpu, say)),
            None => Box::new(CpuBackend),
        }),
    }
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
