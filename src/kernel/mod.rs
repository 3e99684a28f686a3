//! The numerical heart in f32: small functions, each the twin of a WGSL function of the same name
//! in the file of the same name under `shaders/kernel/` (`media`, `mixture` and `table`: those of
//! `shaders/media/`). Knows no backend and no threads.

pub mod density;
pub mod fitting;
pub mod fragments;
pub mod light;
pub mod media;
pub mod medium;
pub mod mixture;
pub mod occupancy;
pub mod ray;
pub mod slices;
pub mod table;
pub mod threshold;
pub mod view;
