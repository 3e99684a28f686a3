//! What the explorer runs in: a program, with threads, files and a window of its own. `web` is the same
//! for pages, with the same names.

// What pages wait for is waited for by names that are the same in both.
#![allow(clippy::unused_async)]

mod dialogs;
mod drawing;
mod engine;
mod faces;
mod files;
pub mod offscreen;
mod pane;
mod screen;
pub mod threads;
mod truth;

pub use dialogs::{WHERE, ask};
pub use drawing::{draw, render, warm_up};
pub use engine::{Engine, told};
pub use faces::Faces;
pub use files::{dropped, read_text, write};
pub use pane::{place_below, show_below};
pub use screen::Screen;
pub use truth::Truth;
