//! Deep OpenEXR: images with any number of samples per pixel, each with its depth and opacity.
//! Reads and writes parts of deep scanlines (`deepscanline`), packed with none, RLE or ZIPS, in
//! safe Rust, because the `exr` crate does not support deep data. Knows nothing of maps or
//! renderers.
//!
//! ```
//! use deepshadow::io::deep_exr::{Attribute, DeepFile, DeepHeader, Slab, encode_slabs};
//!
//! // A wedge of fog: the slabs of each pixel, front to back.
//! let header = DeepHeader::new([64, 8], Vec::new()).with("depth_unit", "world");
//! let bytes = encode_slabs(&header, |x, _| {
//!     (0..x / 16).map(move |k| {
//!         let (front, back) = (k as f32, k as f32 + 1.0);
//!         Slab { front, back, optical_depth: 0.01 * x as f32 }
//!     })
//! })?;
//!
//! let mut file = DeepFile::from_bytes("wedge.exr", bytes, 1 << 30)?;
//! assert_eq!(file.header().attribute("depth_unit"), Some(&Attribute::from("world")));
//! assert_eq!(file.statistics()?.most, 3);
//! let flat = file.read()?.flatten()?;
//! assert!((flat.pixel(63, 0)[3] - (1.0 - (-3.0 * 0.63_f32).exp())).abs() < 1e-6);
//! # Ok::<(), deepshadow::Error>(())
//! ```
//!
//! In practice: [`encode_slabs`] and [`encode`] make lines on all threads and keep only few in
//! memory; [`DeepFile::for_each_row`] reads one line at a time; [`DeepImage`] holds all of them.
//!
//! Deliberately absent: deep tiles, and parts behind the first one with deep scanlines.

mod attribute;
mod cursor;
mod encode;
mod file;
mod header;
mod pack;
mod parse;
mod row;
mod slab;
mod statistics;

pub use attribute::Attribute;
pub use encode::{encode, encode_slabs};
pub use file::DeepFile;
pub use header::{Channel, DeepHeader, PixelType, Window};
pub use pack::Compression;
pub use row::{DeepImage, DeepRow, Samples};
pub use slab::{Slab, SlabChannels};
pub use statistics::DeepStatistics;

/// The first bytes of every OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// The format's version, in the low byte of the next word.
const VERSION: u32 = 2;
/// Flag: names may have more than 31 bytes.
const LONG_NAMES_FLAG: u32 = 0x400;
/// Flag: some part is deep.
const DEEP_FLAG: u32 = 0x800;
/// Flag: there may be several parts.
const MULTIPART_FLAG: u32 = 0x1000;
