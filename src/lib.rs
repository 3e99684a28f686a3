//! Deep shadow maps for volumes: shadows of things that light passes through.

pub mod backend;
pub mod cpu;
pub mod error;
pub mod frame;
pub mod image;
pub mod kernel;
pub mod math;
pub mod progress;
pub mod reference;
pub mod scene;
pub mod settings;
pub mod shadow;
pub mod volume;

pub use error::{Error, ErrorKind, Result};
