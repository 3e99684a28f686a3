//! Deep shadow maps for volumes: shadows of things that light passes through.

pub mod error;
pub mod image;
pub mod math;
pub mod progress;
pub mod volume;

pub use error::{Error, ErrorKind, Result};
