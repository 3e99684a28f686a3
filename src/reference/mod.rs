//! The truth: optical depth exact to rounding and brute-force images over it, in f64. Shares no
//! arithmetic with `kernel`, so that neither can hide the other's mistakes.

mod extinction;
mod image;
mod integral;
mod profile;

pub use extinction::Extinction;
pub use image::brute_force_image;
pub use integral::{Cells, optical_depth};
pub use profile::TexelProfile;
