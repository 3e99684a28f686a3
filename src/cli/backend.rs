//! Which backend computes.

use std::str::FromStr;

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

/// The backend that `choice` means on this machine for maps of `kind`. No adapter is looked for if
/// the CPU was asked for.
pub(super) fn open(choice: BackendChoice, kind: Option<MapKind>) -> Result<Box<dyn Backend>> {
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
        BackendChoice::Auto => {
            Ok(Some(auto()).filter(|gpu| builds(&**gpu)).unwrap_or_else(|| Box::new(CpuBackend)))
        }
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
fn auto() -> Box<dyn Backend> {
    use crate::gpu::{AdapterChoice, GpuBackend};
    match GpuBackend::open(AdapterChoice::Hardware) {
        Ok(gpu) => Box::new(gpu),
        Err(_) => Box::new(CpuBackend),
    }
}

#[cfg(not(feature = "gpu"))]
fn auto() -> Box<dyn Backend> {
    Box::new(CpuBackend)
}
