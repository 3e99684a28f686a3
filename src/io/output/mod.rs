//! Outputs that appear whole or not at all, in the place of nothing that was read: promised before
//! the work, written beside their places, then put there together. It knows no format.
//!
//! In practice: [`Inputs`] are the files that a run reads. [`PendingFile::create`] promises an
//! output and refuses to write over one of them; the file is written through [`std::io::Write`],
//! and [`commit`] puts several in their places. [`PendingFolder`] does the same for a folder.

mod draft;
mod folder;
mod inputs;
mod leftovers;
mod lock;
mod pending;
mod place;
mod stream;

pub use folder::{MadeFolder, PendingFolder};
pub use inputs::Inputs;
pub use leftovers::abandon;
pub use pending::{PendingFile, commit, commit_then};
pub(super) use place::folder_of;
