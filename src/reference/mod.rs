//! The ground truth in f64: optical depth exact to rounding, and brute-force images with it. It
//! shares no arithmetic with `kernel`, so that neither can hide the other's errors.

mod crossings;
mod extinction;
mod image;
mod integral;
mod profile;
mod shading;
mod shapes;
mod tree;

pub use crossings::{Crossing, Crossings, On};
pub use extinction::Extinction;
pub use image::{BruteForce, brute_force_image};
pub use integral::{Cells, optical_depth};
pub use profile::TexelProfile;
