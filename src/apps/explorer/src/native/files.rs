//! The files of a system.

use std::path::{Path, PathBuf};

use deepshadow::io::{Inputs, PendingFile};
use deepshadow::{Error, Result};
use eframe::egui::Ui;

use super::threads;
use crate::explorer::Explorer;

/// Bytes that a text may have.
const MOST_BYTES: u64 = 16 << 20;

/// The text of a file.
///
/// # Errors
/// If it cannot be read, or if it is too large for a text.
pub fn read_text(path: &Path) -> Result<String> {
    let failed = |error| Error::file(path, error);
    let found = std::fs::metadata(path).map_err(failed)?;
    if !found.is_file() || found.len() > MOST_BYTES {
        return Err(Error::contents(path, "is no scene file, or too large for one"));
    }
    std::fs::read_to_string(path).map_err(failed)
}

/// Writes what `make` makes to a file, whole or not at all, on a thread of its own. `inputs` says what
/// must not be written to; `done` hears the outcome.
///
/// # Errors
/// If the system starts no thread.
pub fn write(
    path: PathBuf,
    inputs: impl FnOnce() -> Inputs + Send + 'static,
    make: impl FnOnce() -> Result<Vec<u8>> + Send + 'static,
    done: impl FnOnce(Result<String>) + Send + 'static,
) -> std::io::Result<()> {
    threads::start("writing", move || {
        let written = make().and_then(|contents| {
            PendingFile::create(&path, &inputs())?.finish_with(&contents)?;
            Ok(format!("wrote {}", path.display()))
        });
        done(written);
    })
}

/// Opens what was dropped on the window.
pub fn dropped(explorer: &mut Explorer, ui: &Ui) {
    let files = ui.input(|input| input.raw.dropped_files.clone());
    for file in files {
        explorer.open(&file.path().to_string_lossy());
    }
}
