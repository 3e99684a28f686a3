//! The explorer: a window in which volumes, hair and meshes, their light and their shadow maps are
//! turned and looked at.
//!
//! ```text
//! panels, hands --edit--> Document (a scene file) --Wish--> Engine (a thread) --Event--> Explorer
//!                                                             |
//!                              io::SceneLoader, scene::automatic::complete, Backend::stage
//! ```
//!
//! Everything that can be changed is a key of the document's scene file, so whatever is seen can be
//! saved, and [`deepshadow`]'s `render` draws the same. It uses nothing but the library's public
//! face.

pub mod document;
pub mod engine;
pub mod explorer;
pub mod hands;
#[cfg(not(target_family = "wasm"))]
#[path = "native/mod.rs"]
pub mod host;
#[cfg(target_family = "wasm")]
#[path = "web/mod.rs"]
pub mod host;
pub mod output;
pub mod panels;
pub mod script;
mod view;

pub use document::Document;
pub use explorer::Explorer;
