//! A list of the temporary files and folders, so that a program that is asked to terminate can
//! delete them. Handles no signals itself.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The prefix of temporary names.
pub(super) const PREFIX: &str = ".deepshadow-";

/// Everything that would be left behind if the program ended now.
static LEFTOVERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// Held while files are moved to their destinations.
static PLACING: Mutex<()> = Mutex::new(());

/// A guard; while it exists, [`abandon`] waits.
pub(super) struct Placing(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Placing {
    pub(super) fn begin() -> Self {
        Self(PLACING.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A temporary file or folder. It is deleted when dropped, and when the program is asked to
/// terminate; with the files in it, if it is a folder with a temporary name.
#[derive(Debug)]
pub(super) struct Leftover(PathBuf);

impl Leftover {
    /// Creates something with `make` and registers it under the name that `path` returns.
    pub(super) fn new<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl FnOnce(&T) -> PathBuf,
    ) -> io::Result<(T, Self)> {
        // The list is locked, so that nothing exists that is not on it.
        let mut names = names();
        let made = make()?;
        let path = path(&made);
        names.push(path.clone());
        Ok((made, Self(path)))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }

    /// Unregisters the name, because the file has been moved to its destination.
    pub(super) fn placed(mut self) {
        forget(&std::mem::take(&mut self.0));
    }
}

impl Drop for Leftover {
    fn drop(&mut self) {
        if !self.0.as_os_str().is_empty() {
            take_away(&self.0);
            forget(&self.0);
        }
    }
}

/// Deletes all temporary files and prevents any further output. It is the last call of a program
/// that was asked to terminate. It waits for files that are just being moved to their destinations.
pub fn abandon() {
    let placing = Placing::begin();
    let names = names();
    names.iter().for_each(|path| take_away(path));
    std::mem::forget((placing, names));
}

fn names() -> MutexGuard<'static, Vec<PathBuf>> {
    LEFTOVERS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn forget(path: &Path) {
    names().retain(|other| other != path);
}

/// Deletes a file or a folder; failures are ignored.
pub(super) fn take_away(path: &Path) {
    if fs::remove_file(path).is_ok() {
        return;
    }
    let is_ours = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX));
    for entry in fs::read_dir(path).into_iter().flatten().flatten().filter(|_| is_ours) {
        let _ = fs::remove_file(entry.path());
    }
    let _ = fs::remove_dir(path);
}
