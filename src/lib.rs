//! Deep shadow maps for volumes: shadows of things that light passes through.

pub mod error;
pub use error::{Error, ErrorKind, Result};
