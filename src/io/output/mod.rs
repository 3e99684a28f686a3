//! Outputs that appear completely or not at all and never overwrite an input: prepared before the
//! work, written under temporary names, then moved to their destinations together. Knows no format.
//!
//! In practice: [`Inputs`] are the files that a run reads. [`PendingFile::create`] prepares an
//! output and refuses to overwrite an input; the file is written through [`std::io::Write`], and
//! [`commit`] moves several to their destinations. [`PendingFolder`] does the same for a folder.

mod draft;
mod folder;
mod inputs;
mod leftovers;
mod lock;
mod pending;
mod place;
mod seal;
mod stream;

pub use folder::{MadeFolder, PendingFolder};
pub use inputs::Inputs;
pub use leftovers::abandon;
pub use pending::{PendingFile, commit, commit_then};
pub(super) use place::folder_of;
pub use seal::{is_sealed, sealed};
