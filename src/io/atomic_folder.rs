//! Folders that appear whole or not at all: filled beside the target, then renamed.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::atomic::{PREFIX, folder};
use crate::error::{Error, Result};

/// A folder to be filled once its contents are known. An older one gives way if it holds nothing but
/// files of the same names.
#[derive(Debug)]
pub struct PendingFolder {
    target: PathBuf,
    names: Vec<String>,
}

impl PendingFolder {
    /// Promises a folder that will be `target`, with files of these `names`. Made before the work
    /// whose result it takes, it tells at once whether there is a place to write to.
    ///
    /// # Errors
    /// If the folder around it does not exist or cannot be written to, or if there is something else
    /// in the place of `target` than an empty folder or one of these files alone.
    pub fn create(target: impl AsRef<Path>, names: &[&str]) -> Result<Self> {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        let pending = Self { target: target.as_ref().to_owned(), names };
        pending.check_place()?;
        // Gone again at once: a run that is interrupted leaves nothing.
        drop(pending.beside()?);
        Ok(pending)
    }

    /// Puts the folder in its place: the contents of its files in the order of their names.
    ///
    /// # Errors
    /// If a file cannot be written or the folder not renamed; then an older one is unchanged.
    pub fn finish_with(self, contents: &[&[u8]]) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        self.check_place()?;
        let draft = self.beside()?;
        for (name, contents) in self.names.iter().zip(contents) {
            fs::write(draft.path().join(name), contents).map_err(failed)?;
        }
        if fs::symlink_metadata(&self.target).is_err() {
            return fs::rename(draft.keep(), &self.target).map_err(failed);
        }
        // A folder cannot be renamed over a full one: the older one steps aside until the new one is
        // in its place.
        let aside = self.beside()?;
        let older = aside.path().join("older");
        fs::rename(&self.target, &older).map_err(failed)?;
        match fs::rename(draft.path(), &self.target) {
            Ok(()) => {
                let _moved = draft.keep();
                Ok(())
            }
            Err(error) => {
                fs::rename(&older, &self.target).map_err(failed)?;
                Err(failed(error))
            }
        }
    }

    /// A folder to write to, removed with its contents when dropped.
    fn beside(&self) -> Result<TempDir> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        builder
            .permissions(<fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o755));
        builder.tempdir_in(folder(&self.target)).map_err(|error| Error::file(&self.target, error))
    }

    fn check_place(&self) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        let place = match fs::symlink_metadata(&self.target) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            place => place.map_err(failed)?,
        };
        if !place.is_dir() {
            return Err(failed(io::Error::from(io::ErrorKind::NotADirectory)));
        }
        for entry in fs::read_dir(&self.target).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name();
            if !self.names.iter().any(|own| name == own.as_str()) {
                let name = name.to_string_lossy();
                let why = format!("holds '{name}', which is no part of a report; left as it is");
                return Err(Error::contents(&self.target, why));
            }
        }
        Ok(())
    }
}
