//! Names of files and folders that are not in their places yet, so that a program which is told to
//! end can take them away. It handles no signal itself.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How names begin of what is not in its place yet.
pub(super) const PREFIX: &str = ".deepshadow-";

/// What would stay if the program ended now.
static LEFTOVERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// Held while files are put in their places.
static PLACING: Mutex<()> = Mutex::new(());

/// While it lives, [`abandon`] waits.
pub(super) struct Placing(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Placing {
    pub(super) fn begin() -> Self {
        Self(PLACING.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Something that is gone when dropped, and when the program is told to end: a file, or a folder;
/// with the files in it if its name is one of ours.
#[derive(Debug)]
pub(super) struct Leftover(PathBuf);

impl Leftover {
    /// What `make` makes, and the name that `path` finds it under.
    pub(super) fn new<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl FnOnce(&T) -> PathBuf,
    ) -> io::Result<(T, Self)> {
        // Nothing is ever there that the list does not hold.
        let mut names = names();
        let made = make()?;
        let path = path(&made);
        names.push(path.clone());
        Ok((made, Self(path)))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }

    /// It is in its place: nothing has its name any more.
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

/// Takes away what is not in its place yet, and lets nothing more be put anywhere: for programs
/// that are told to end, as the last thing that they do. What is just being put in place gets there
/// first.
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

/// Removes a file or a folder; what cannot be removed stays.
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
