//! Reads OpenVDB files (`.vdb`, format 222 to 225) and writes them (format 224): sparse grids of
//! numbers, vectors and booleans, as a tree in memory. Values, transform and metadata are returned
//! as the file has them; rendering is none of this module's business.
//!
//! ```no_run
//! use deepshadow::io::vdb::{SurveyDepth, VdbFile};
//!
//! let file = VdbFile::open("smoke.vdb")?;
//! for grid in file.grids() {
//!     println!("{} is a {}", grid.name, grid.type_name);
//! }
//! if let Some(index) = file.find("density") {
//!     let survey = file.survey(index, SurveyDepth::Values)?;
//!     if let Some(bounds) = survey.active_bounds {
//!         let dense = file.load(index)?.densify(bounds.padded(1), 1 << 30)?;
//!         println!("{:?} voxels (z, y, x) from {}", dense.values.dim(), dense.origin);
//!     }
//! }
//! # Ok::<(), deepshadow::Error>(())
//! ```
//!
//! In practice: [`VdbFile::open`] reads headers only. [`VdbFile::load`] returns a [`Grid`], which
//! is a [`Tree`] of one of the value types: it gives access to single voxels, leaves, tiles or a
//! dense box. [`VdbFile::survey`] counts and measures without keeping voxels. Leaves are decoded by
//! all threads of rayon's current pool. [`TreeBuilder`] makes trees, [`VdbWriter`] writes them.
//!
//! Every length and count in a file is checked against the remaining bytes before memory is
//! allocated, and every decompressed size is known beforehand. So a broken or hostile file causes
//! an error, and neither a panic nor more memory than a fixed multiple of the file's size. A huge
//! constant region, which a small valid file may contain, stays a tile until [`Grid::densify`]
//! expands it, which has a limit.
//!
//! Deliberately absent: points and strings (listed, with the reason in [`GridHeader::refused`]),
//! frustum transforms ([`Transform::Refused`]; the voxels load), files before format 222.

mod blosc;
mod builder;
mod canvas;
mod compression;
mod dense;
mod edit;
mod fault;
mod file;
mod grid;
mod grid_edit;
mod grid_type;
mod header;
mod index_box;
mod leaves;
mod mask;
mod metadata;
mod packed;
mod parts;
mod source;
mod sparse;
mod statistics;
mod topology;
mod transform;
mod tree;
mod value;
mod value_block;
mod voxels;
mod write;
mod write_block;
mod write_tree;

pub use builder::TreeBuilder;
pub use compression::Compression;
pub(super) use compression::decompress_blosc;
pub use dense::Dense;
pub use edit::EVERYWHERE;
pub use file::VdbFile;
pub use grid::Grid;
pub use grid_type::ValueType;
pub use header::GridHeader;
pub use index_box::IndexBox;
pub use metadata::{MetaValue, Metadata};
pub use packed::{PackedBuilder, PackedTree};
pub use sparse::Blocks;
pub use statistics::Statistics;
pub use transform::Transform;
pub use tree::{Leaf, Tile, Tree};
pub use value::{AnyValue, Value};
pub use voxels::{Survey, SurveyDepth};
pub use write::{NewGrid, VdbWriter};
