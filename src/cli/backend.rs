//! Which backend computes.

use std::str::FromStr;

use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};

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

/// The backend that `choice` means on this machine. No adapter is looked for if the CPU was asked
/// for.
pub(super) fn open(choice: BackendChoice) -> Result<Box<dyn Backend>> {
    match choice {
        BackendChoice::Cpu => Ok(Box::new(CpuBackend)),
        BackendChoice::Gpu => gpu(),
        BackendChoice::Auto => Ok(auto()),
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
