//! Deep shadow maps for volumes: shadows of things that light passes through.
//!
//! A [`Volume`] in a [`Scene`] is marched from each light to build a [shadow map](shadow::Map), and
//! from the camera with that map, by a [`Backend`]: the [`CpuBackend`] or, with feature `gpu`, a
//! [`gpu::GpuBackend`] on a wgpu device of its own. What comes out is an [`Image`] of linear
//! radiance.
//!
//! ```
//! use deepshadow::glam::{DVec3, dvec3};
//! use deepshadow::ndarray::Array3;
//! use deepshadow::scene::Light;
//! use deepshadow::{Backend, CpuBackend, Scene, Settings, Silent, Volume};
//!
//! // Densities by (z, y, x), and the voxels' spacing along x, y and z in world lengths. y is up,
//! // and the first voxel's centre is the world's origin.
//! let cloud = Array3::from_shape_fn((16, 24, 32), |(z, y, x)| ((x * y + z) % 5) as f32);
//! let volume = Volume::from_array("cloud", cloud, [0.1; 3])?;
//! // Light, camera, ground, background and density scale are chosen; all of them are fields.
//! let mut scene = Scene::automatic(volume)?;
//! scene.lights = vec![Light::directional(dvec3(-1.0, -0.5, -0.2))]; // the way the light travels
//! scene.background = Some(DVec3::splat(0.1)); // the chosen one fits the chosen light only
//! let away = scene.camera.position - scene.camera.target;
//! scene.camera.position += 0.1 * away; // a tenth farther from what it looks at
//! let settings = Settings::default().with(|settings| settings.image.size = [64, 48]);
//! let image = CpuBackend.render(&scene, &settings, &Silent)?; // Silent reports no progress
//! # let folder = tempfile::tempdir().unwrap();
//! # std::env::set_current_dir(&folder).unwrap();
//! image.save("cloud.png", 1.0)?; // with exposure 1
//! # Ok::<(), deepshadow::Error>(())
//! ```
//!
//! A scene consists of [`scene::Light`]s, a [`scene::Camera`], [`scene::Media`] (volumes, each with
//! a [`scene::Medium`]), [`scene::Surfaces`] (hair and meshes) and a [`scene::Ground`]. Vectors are glam's, of f64 ([`glam::DVec3`]).
//! A *world length* is the unit of the volumes' spacing.
//!
//! From here on:
//! - [`io::open`] reads a volume file (OpenVDB, NRRD, NIfTI and others), as in
//!   `Scene::automatic(io::open("smoke.vdb")?)`. [`io::load_volume`] takes options, such as the
//!   dims of a raw file, and [`scene::automatic::complete`] makes the scene of a whole scene file.
//! - [`Scene::beams`] takes a scene apart into what one map can answer for; [`Backend::map`] builds
//!   it, [`shadow::Shadow::lookup`] asks it, [`accuracy`] and [`compare`] say how wrong it is.
//! - [`Backend::stage`] makes pictures one after another.
//! - [`Image::save`] writes a picture in the format of its name; [`io::PictureOptions`] encodes one
//!   with other bits, and [`image::Tone`] is exposure and tone curve for screens.
//! - [`gpu::Renderer`] records the passes into another wgpu program's encoders;
//!   [`gpu::shadow_wgsl`] is the lookup for its shaders.
//! - [`reference`](mod@reference) holds the truth in f64.
//!
//! The repository's `examples/` are such programs. `ARCHITECTURE.md` explains layers, passes and
//! spaces. *The paper* is "Volumetric Deep Shadow Maps", whose map is the threshold map.
//!
//! The crate needs Rust 1.95 or newer. It follows ndarray 0.17, glam 0.34 and wgpu 30, and
//! re-exports all three, because their types stand in its signatures.
//!
//! # Features
//! - `gpu` (default): the wgpu backend.
//! - `io` (default): files of all formats. Without it nothing reads or writes a file.
//! - `cli` (default): the program, which needs `io`. A library user can leave it out.

pub mod accuracy;
pub mod backend;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod compare;
pub mod cpu;
pub mod error;
#[doc(hidden)]
pub mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod image;
#[cfg(feature = "io")]
pub mod io;
#[doc(hidden)]
pub mod kernel;
pub mod math;
mod parallel;
pub mod probe;
pub mod progress;
pub mod reference;
pub mod scene;
pub mod settings;
pub mod shadow;
pub mod surface;
pub mod volume;

pub use backend::Backend;
pub use cpu::CpuBackend;
pub use error::{Error, ErrorKind, Result};
#[doc(inline)]
pub use frame::Frame;
#[cfg(feature = "gpu")]
pub use gpu::GpuBackend;
pub use image::Image;
pub use progress::Silent;
pub use scene::Scene;
pub use settings::Settings;
pub use volume::Volume;

// What stands in signatures.
pub use glam;
pub use ndarray;
#[cfg(feature = "gpu")]
pub use wgpu;

/// The README's code, so that it is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
