//! Outputs that appear whole or not at all: written beside the target, then renamed.

#[cfg(unix)]
use std::fs::Permissions;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// A file to be written once its contents are known. Until then nothing lies in the folder and an
/// older file of that name is unchanged.
#[derive(Debug)]
pub struct PendingFile {
    target: PathBuf,
}

impl PendingFile {
    /// Promises a file that will be `target`. Made before the work whose result it takes, it tells
    /// at once whether there is a place to write to.
    ///
    /// # Errors
    /// If the folder does not exist or cannot be written to, or if `target` is a folder or may not
    /// be written over.
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref().to_owned();
        let failed = |error| Error::file(&target, error);
        if target.is_dir() {
            return Err(failed(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        if target.exists() {
            OpenOptions::new().append(true).open(&target).map_err(failed)?;
        }
        // Gone again at once: a run that is interrupted leaves nothing.
        drop(beside(&target).map_err(failed)?);
        Ok(Self { target })
    }

    /// Puts a file with `contents` in its place.
    ///
    /// # Errors
    /// If it cannot be written or renamed; then nothing is left behind.
    pub fn finish_with(self, contents: &[u8]) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        let mut file = beside(&self.target).map_err(failed)?;
        file.write_all(contents).map_err(failed)?;
        // A link keeps pointing where it did; what it points to is replaced.
        let place = fs::canonicalize(&self.target).unwrap_or_else(|_| self.target.clone());
        file.persist(place).map_err(|error| failed(error.error))?;
        Ok(())
    }
}

/// A new file in the folder of `target`, removed when dropped.
fn beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".deepshadow-");
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder)
}
