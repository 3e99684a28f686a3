//! Deep shadow maps for volumes: shadows of things that light passes through.
//!
//! A [`volume::Volume`] in a [`scene::Scene`] is marched from the light to build a
//! [`shadow::Map`], and from the camera with that map, by a [`backend::Backend`]: the
//! [`cpu::CpuBackend`] or, with feature `gpu`, [`gpu`] on a wgpu device of its own or the caller's.
//! [`reference`](mod@reference) holds the truth in f64. `ARCHITECTURE.md` explains layers, passes and spaces.

pub mod accuracy;
pub mod backend;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
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

/// The README's code, so that it is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
