//! Folders that appear whole or not at all: filled beside the target, then exchanged with it. It
//! knows nothing of what is in the files.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::draft::{Draft, folder_beside, sweep};
use super::inputs::Inputs;
use super::leftovers::{Leftover, Placing};
use super::lock::FolderLock;
use super::place::{Place, folder_of};
use crate::error::{Error, Result};

/// A folder to be filled once its contents are known. An older one gives way if it holds nothing
/// but files of the same names.
#[derive(Debug)]
pub struct PendingFolder {
    target: PathBuf,
    names: Vec<String>,
    inputs: Inputs,
}

impl PendingFolder {
    /// Promises a folder that will be `target`, with files of these `names`. Made before the work
    /// whose result it takes, it tells at once whether there is a place to write to.
    ///
    /// # Errors
    /// If the folder around it does not exist or cannot be written to, or if there is something
    /// else in the place of `target` than an empty folder or one of these files alone, none of them
    /// one of `inputs`.
    pub fn create(target: impl AsRef<Path>, names: &[&str], inputs: &Inputs) -> Result<Self> {
        let names = names.iter().map(|&name| name.to_owned()).collect();
        let named = target.as_ref();
        // A link keeps pointing where it does.
        let target = named.canonicalize().unwrap_or_else(|_| named.to_owned());
        let pending = Self { target, names, inputs: inputs.clone() };
        pending.check(&pending.target)?;
        // Gone again at once: a run that is interrupted leaves nothing.
        drop(pending.tried()?);
        Ok(pending)
    }

    /// Puts the folder in its place: the contents of its files in the order of their names.
    ///
    /// # Errors
    /// If a file cannot be written or the folder not renamed; then an older one is unchanged.
    pub fn finish_with(self, contents: &[&[u8]]) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        self.check(&self.target)?;
        let mut drafts = Vec::new();
        for (name, contents) in self.names.iter().zip(contents) {
            // Without a name beside the folder, to be named in it.
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
        // Afterwards the name stands for nothing or for the older folder, which goes.
        self.exchange(filled.path())
    }

    /// Puts the folder `filled` in the place of the target, and what was there in its own.
    fn exchange(&self, filled: &Path) -> Result<()> {
        let failed = |error| Error::file(&self.target, error);
        if fs::symlink_metadata(&self.target).is_err() {
            return fs::rename(filled, &self.target).map_err(failed);
        }
        swap(filled, &self.target).map_err(failed)?;
        // Whatever came to the older folder meanwhile stays.
        self.check(filled).or_else(|error| {
            swap(filled, &self.target).map_err(failed)?;
            Err(error)
        })
    }

    /// A file beside the target, whose name nobody sees.
    fn beside(&self) -> Place {
        Place::File(folder_of(&self.target).join(".deepshadow-file"))
    }

    fn tried(&self) -> Result<Draft> {
        Draft::create(&self.beside()).map_err(|error| Error::file(&self.target, error))
    }

    /// Makes sure that `place` is no folder, or one that is replaced without loss.
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
                let why = format!("holds '{name}', which is no part of a report; left as it is");
                return Err(Error::contents(&self.target, why));
            }
            self.inputs.refuse(&entry.path())?;
        }
        Ok(())
    }
}

/// Exchanges two folders, at once where the system can.
fn swap(one: &Path, other: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        if renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok() {
            return Ok(());
        }
    }
    // Else the older one steps aside until the new one is in its place.
    let aside = one.with_extension("older");
    fs::rename(other, &aside)?;
    if let Err(error) = fs::rename(one, other) {
        fs::rename(&aside, other)?;
        return Err(error);
    }
    fs::rename(&aside, one)
}

/// A folder that was made for outputs: what is still empty of it when dropped goes again.
#[derive(Debug)]
pub struct MadeFolder(#[allow(dead_code)] Vec<Leftover>);

impl MadeFolder {
    /// Makes `folder` and those around it that are missing.
    ///
    /// # Errors
    /// If one cannot be made.
    pub fn create(folder: &Path) -> Result<Self> {
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
            // Inner ones go first.
            made.0.insert(0, one);
        }
        if folder.is_dir() {
            Ok(made)
        } else {
            Err(Error::file(folder, io::ErrorKind::NotADirectory.into()))
        }
    }
}
