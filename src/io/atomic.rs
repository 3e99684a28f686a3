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
        Self::finish_together(&[(self, vec![contents])])
    }

    /// Puts several files in their places, each with the pieces of its contents: none before all of
    /// them are written. The last one comes last, so that who sees it sees the others.
    ///
    /// # Errors
    /// If one cannot be written or renamed; then no new file is left behind.
    pub fn finish_together(files: &[(Self, Vec<&[u8]>)]) -> Result<()> {
        let mut written = Vec::new();
        for (pending, parts) in files {
            let failed = |error| Error::file(&pending.target, error);
            let mut file = beside(&pending.target).map_err(failed)?;
            for part in parts {
                file.write_all(part).map_err(failed)?;
            }
            written.push((pending, file));
        }
        let mut new = Vec::new();
        for (pending, file) in written {
            // A link keeps pointing where it did; what it points to is replaced.
            let place = fs::canonicalize(&pending.target).ok();
            let is_new = place.is_none();
            let place = place.unwrap_or_else(|| pending.target.clone());
            if let Err(error) = file.persist(&place) {
                for path in new {
                    // Nothing more can be done about one that stays.
                    let _ = fs::remove_file(path);
                }
                return Err(Error::file(&pending.target, error.error));
            }
            if is_new {
                new.push(place);
            }
        }
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
