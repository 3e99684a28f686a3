//! Files in and out: one module a format, chosen by content and not by name. Knows no backend.

mod atomic;
pub mod exr;
pub mod fog;
mod load;
pub mod png;
pub mod raw;
pub mod vdb;

pub use atomic::PendingFile;
pub use load::load_volume;
