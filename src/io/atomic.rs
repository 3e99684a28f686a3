//! Outputs that appear whole or not at all: written beside the target, then renamed.

use std::fs::{self, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// A file being written. Dropping it without [`PendingFile::finish`] leaves nothing behind and an
/// older file of that name unchanged.
#[derive(Debug)]
pub struct PendingFile {
    target: PathBuf,
    writer: BufWriter<NamedTempFile>,
}

impl PendingFile {
    /// Begins a file that will be `target`. Made before the work whose result it takes, it tells at
    /// once whether there is a place to write to.
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
        let folder = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".deepshadow-");
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(failed)?;
        Ok(Self { target: target.clone(), writer: BufWriter::new(file) })
    }

    /// Where the contents go until then.
    pub fn writer(&mut self) -> &mut BufWriter<NamedTempFile> {
        &mut self.writer
    }

    /// The name that the file will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Takes all of `contents` and finishes.
    ///
    /// # Errors
    /// As [`PendingFile::finish`].
    pub fn finish_with(mut self, contents: &[u8]) -> Result<()> {
        self.writer.write_all(contents).map_err(|error| Error::file(&self.target, error))?;
        self.finish()
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// If the rest cannot be written or the file cannot be renamed; then nothing is left behind.
    pub fn finish(self) -> Result<()> {
        let Self { target, writer } = self;
        let failed = |error| Error::file(&target, error);
        let file = writer.into_inner().map_err(|error| failed(error.into_error()))?;
        // A link keeps pointing where it did; what it points to is replaced.
        let place = fs::canonicalize(&target).unwrap_or_else(|_| target.clone());
        file.persist(place).map_err(|error| failed(error.error))?;
        Ok(())
    }
}
