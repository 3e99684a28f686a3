//! What the explorer runs in: a page, whose workers draw. `native` is the same for programs, with the
//! same names.
//!
//! ```text
//! page: window, panels, hands          worker 0: pictures in a hurry, documents
//!   Engine --Order--> (postMessage) -->  Hand -> Worker -> CpuBackend
//!          <--Report--                 worker 1: whole pictures, truth; all pictures if a GPU draws
//!                                        Hand -> Worker -> GpuBackend or CpuBackend
//! ```
//!
//! The picture of the document is in a canvas of its own, below that of the window (`pane`), and is seen
//! as soon as it has come.
//!
//! Workers share nothing with the page: each has the files that people chose, and loads them itself.
//! A worker that computes hears nothing, so what is in a hurry has one of its own, and what is given
//! up ends with its worker.

pub mod automation;
mod controls;
mod dialogs;
mod drawing;
mod engine;
mod files;
mod hand;
mod hands;
mod link;
pub mod page;
mod pane;
mod port;
mod screen;
pub mod threads;
mod truth;

pub use dialogs::{WHERE, ask};
pub use drawing::{Faces, draw, render, warm_up};
pub use engine::Engine;
pub use files::{dropped, read_text, write};
pub use hand::{told, work};
pub use pane::{place_below, show_below};
pub use screen::Screen;
pub use truth::Truth;
