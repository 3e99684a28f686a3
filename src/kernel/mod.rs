//! Numerical functions in f32. Each is the twin of a WGSL function of the same name in the file of
//! the same name under `shaders/kernel/` (for `media`, `mixture` and `table` under
//! `shaders/media/`). The module knows no backend and no threads.

pub mod coverage;
pub mod density;
pub mod exponential;
pub mod fitting;
pub mod fragments;
pub mod light;
pub mod media;
pub mod medium;
pub mod mixture;
pub mod occupancy;
pub mod ray;
pub mod slices;
pub mod surface;
pub mod table;
pub mod threshold;
pub mod triangle;
pub mod view;
