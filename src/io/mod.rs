//! Reads and writes files: one module per format. Formats are recognised by content and not by
//! name. Knows no backend.

mod base64;
mod body;
pub mod coded_map;
pub mod deep_exr;
pub mod dense;
mod described;
pub mod exr;
mod exr_order;
mod files;
pub mod fog;
pub mod format;
pub mod fragment_map;
mod histogram;
pub(crate) mod json;
mod load;
pub mod map_files;
pub mod number;
mod options;
pub mod output;
pub mod picture;
mod placed;
pub mod png;
pub mod raw;
pub mod remap;
mod scene_loader;
mod sequence;
mod sidecar;
mod surface;
pub mod vdb;

pub use body::load_ingredients;
pub use dense::npy::{encode_array, read_vectors};
pub use described::{Described, at_frame, is_numbered, is_scene_file, not_there};
pub use files::{FileSource, mount, unmount, unmount_all};
pub use format::Format;
pub use histogram::{FiniteRange, Histogram};
pub use load::{load_color, load_volume, open, source_files, superior_axis};
pub use options::ReadOptions;
pub use output::{Inputs, PendingFile, PendingFolder};
pub use picture::{PictureFormat, PictureOptions};
pub use placed::{LoadedShape, load_shape, load_surfaces, place_shape};
pub use scene_loader::SceneLoader;
pub use sequence::{
    ChosenShot, MOST_FRAMES, choose_shot, files_of, frames_of, numbered_names, some_of,
};
pub use surface::{
    SurfaceFile, encode_gltf, encode_hair, read_surface, read_surface_as, surface_files, surface_up,
};
