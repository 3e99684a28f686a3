//! Deep shadow maps for volumes: shadows of things that light passes through.

pub mod backend;
#[cfg(feature = "cli")]
pub mod cli;
pub mod cpu;
pub mod error;
pub mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod image;
pub mod io;
pub mod kernel;
pub mod math;
pub mod progress;
pub mod reference;
pub mod scene;
pub mod settings;
pub mod shadow;
pub mod volume;

pub use error::{Error, ErrorKind, Result};
