//! Output folders that appear completely or not at all: filled beside the target, then exchanged
//! with it. Knows nothing of the files' contents.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::draft::{Draft, folder_beside, sweep};
use super::inputs::Inputs;
use super::leftovers::{Leftover, Placing};
use super::lock::FolderLock;
use super::place::{Place, check_folder, check_platform, folder_of};
use crate::error::{Error, Result};

/// A folder that is filled once its contents are known. It replaces an older folder that holds only
/// files of the same names.
#[derive(Debug)]
pub struct PendingFolder {
    target: PathBuf,
    names: Vec<String>,
    inputs: Inputs,
}

impl PendingFolder {
    /// Prepares a folder `target` with files of these `names`. Called before the work whose result
    /// it takes, so that it is known at once whether the folder can be written.
    ///
    /// # Errors
    /// If the parent folder does not exist or cannot be written to. If `target` exists and is
    /// anything but an empty folder or one with only files of these names. If one of those files is
    /// one of `inputs`.
    pub fn create(target: impl AsRef<Path>, names: &[&str], inputs: &Inputs) -> Result<Self> {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        let named = target.as_ref();
        check_platform().map_err(|error| Error::file(named, error))?;
        // A link is kept, and its target is replaced.
        let target = named.canonicalize().unwrap_or_else(|_| named.to_owned());
        let pending = Self { target, names, inputs: inputs.clone() };
        pending.check(&pending.target)?;
        check_folder(&pending.target).map_err(|error| Error::file(&pending.target, error))?;
        // Deleted at once, so that an interrupted run leaves nothing behind.
        drop(pending.tried()?);
        Ok(pending)
    }

    /// Writes the files' `contents`, in the order of their names, and puts the folder in its place.
    ///
    /// # Errors
    /// If a file cannot be written or the folder cannot be renamed; then an older folder is
    /// unchanged.
    pub fn finish_with(self, contents: &[&[u8]]) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        self.check(&self.target)?;
        let mut drafts = Vec::new();
        for (name, contents) in self.names.iter().zip(contents) {
            // Written to an unnamed file beside the folder, and linked into the folder later.
            let mut draft = Draft::create(&self.beside()).map_err(failed)?;
            draft.write_all(contents).and_then(|()| draft.flushed()).map_err(failed)?;
            drafts.push((name, draft));
        }
        let lock = FolderLock::take(folder_of(&self.target));
        let _placing = Placing::begin();
        if lock.is_held() {
            sweep(folder_of(&self.target));
        }
        let filled = folder_beside(&self.target, lock.is_held()).map_err(failed)?;
        for (name, draft) in drafts {
            let path = filled.path().join(name);
            if draft.link_new(&path).is_none() {
                let named = draft.named(&path, None).map_err(failed)?;
                fs::rename(named.path(), &path).map_err(failed)?;
                named.placed();
            }
        }
        // Afterwards the temporary name refers to nothing, or to the older folder, which is
        // deleted.
        self.exchange(filled.path())
    }

    /// Exchanges the folder `filled` with the target.
    fn exchange(&self, filled: &Path) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        if fs::symlink_metadata(&self.target).is_err() {
            return fs::rename(filled, &self.target).map_err(failed);
        }
        swap(filled, &self.target).map_err(failed)?;
        // If something else was added to the older folder meanwhile, undo the exchange.
        self.check(filled).or_else(|error| {
            swap(filled, &self.target).map_err(failed)?;
            Err(error)
        })
    }

    /// A file beside the target, whose name never appears.
    fn beside(&self) -> Place {
        Place::File(folder_of(&self.target).join(".deepshadow-file"))
    }

    fn tried(&self) -> Result<Draft> {
        Draft::create(&self.beside()).map_err(|error| Error::file(&self.target, error))
    }

    /// Checks that `place` does not exist, or is a folder that can be replaced without loss.
    fn check(&self, place: &Path) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        let found = match fs::symlink_metadata(place) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            found => found.map_err(failed)?,
        };
        if !found.is_dir() {
            return Err(failed(io::Error::from(io::ErrorKind::NotADirectory)));
        }
        for entry in fs::read_dir(place).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name();
            let known = self.names.iter().any(|own| name == own.as_str());
            let is_file = entry.file_type().map_err(failed)?.is_file();
            if !(known && is_file) {
                let name = name.to_string_lossy();
                let why =
                    format!("contains '{name}', which is not part of a report; left unchanged");
                return Err(Error::contents(&self.target, why));
            }
            self.inputs.refuse(&entry.path())?;
        }
        Ok(())
    }
}

/// Exchanges two folders, atomically where the system can.
fn swap(one: &Path, other: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        if renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok() {
            return Ok(());
        }
    }
    // Else the older folder is moved aside until the new one is in its place.
    let aside = one.with_extension("older");
    fs::rename(other, &aside)?;
    if let Err(error) = fs::rename(one, other) {
        fs::rename(&aside, other)?;
        return Err(error);
    }
    fs::rename(&aside, one)
}

/// Folders that were created for outputs; those that are still empty are deleted when dropped.
#[derive(Debug)]
pub struct MadeFolder(#[allow(dead_code)] Vec<Leftover>);

impl MadeFolder {
    /// Creates `folder` and its missing parents.
    ///
    /// # Errors
    /// If one of them cannot be created.
    pub fn create(folder: &Path) -> Result<Self> {
        check_platform().map_err(|error| Error::file(folder, error))?;
        let mut made = Self(Vec::new());
        let mut missing: Vec<&Path> = folder
            .ancestors()
            .filter(|path| !path.as_os_str().is_empty())
            .take_while(|path| fs::symlink_metadata(path).is_err())
            .collect();
        missing.reverse();
        for path in missing {
            let make = || fs::create_dir(path);
            let ((), one) = Leftover::new(make, |()| path.to_owned())
                .map_err(|error| Error::file(folder, error))?;
            // Inner folders are deleted first.
            made.0.insert(0, one);
        }
        if folder.is_dir() {
            Ok(made)
        } else {
            Err(Error::file(folder, io::ErrorKind::NotADirectory.into()))
        }
    }
}
