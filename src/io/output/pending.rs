//! Output files that are prepared before the work and moved to their destinations after it, several
//! together. Knows nothing of their contents.

use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::draft::{Draft, sweep};
use super::inputs::Inputs;
use super::leftovers::{Leftover, Placing};
use super::lock::FolderLock;
use super::place::{Place, folder_of};
use super::stream;
use crate::error::{Error, Result};

/// A file that is written once its contents are known. Until it is committed, nothing new lies in
/// the folder and an older file of that name is unchanged. If dropped, it leaves nothing behind.
#[derive(Debug)]
pub struct PendingFile {
    target: PathBuf,
    place: Place,
    inputs: Inputs,
    /// Created at the first write.
    draft: Option<Draft>,
    /// A device, or a pipe that already has a reader.
    stream: Option<File>,
}

impl PendingFile {
    /// Prepares the file `target`. Called before the work whose result it takes, so that it is
    /// known at once whether the file can be written. Links are followed, an older file's mode is
    /// kept, and pipes and devices receive all bytes on commit.
    ///
    /// # Errors
    /// If `target` is one of `inputs`, is a folder or may not be overwritten, or if its folder does
    /// not exist or cannot be written to.
    pub fn create(target: impl AsRef<Path>, inputs: &Inputs) -> Result<Self> {
        let target = target.as_ref().to_owned();
        inputs.refuse(&target)?;
        let failed = |error| Error::file(&target, error);
        let place = Place::of(&target).map_err(failed)?;
        place.check().map_err(failed)?;
        let stream = match &place {
            Place::Stream(path) => stream::open_now(path).map_err(failed)?,
            // Deleted at once, so that an interrupted run leaves nothing behind.
            Place::File(_) => {
                drop(Draft::create(&place).map_err(failed)?);
                None
            }
        };
        Ok(Self { place, inputs: inputs.clone(), draft: None, stream, target })
    }

    /// The program's standard output as a file, which receives all bytes on commit.
    ///
    /// # Errors
    /// If it is closed.
    pub fn stdout() -> Result<Self> {
        let target = PathBuf::from("standard output");
        let stream = Some(stream::stdout().map_err(|error| Error::file(&target, error))?);
        let place = Place::Stream(target.clone());
        Ok(Self { target, place, inputs: Inputs::default(), draft: None, stream })
    }

    /// The path that was given to [`PendingFile::create`].
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The path of the file after following links; for a pipe or device its own path.
    pub fn path(&self) -> &Path {
        match &self.place {
            Place::File(path) | Place::Stream(path) => path,
        }
    }

    /// Whether it is a pipe or a device, which has no folder for further files.
    pub fn is_stream(&self) -> bool {
        matches!(self.place, Place::Stream(_))
    }

    /// The same output under another name in the same folder.
    ///
    /// # Errors
    /// As [`PendingFile::create`].
    pub fn renamed(mut self, name: &str) -> Result<Self> {
        let draft = self.draft.take();
        let named = Self::create(folder_of(self.path()).join(name), &self.inputs)?;
        Ok(Self { draft, ..named })
    }

    /// Writes `contents` and moves the file to its destination.
    ///
    /// # Errors
    /// If it cannot be written or renamed; then nothing is left behind.
    pub fn finish_with(mut self, contents: &[u8]) -> Result<()> {
        self.put(contents)?;
        commit(vec![self])
    }

    /// Appends `bytes` to the file.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.write_all(bytes).map_err(|error| Error::file(&self.target, error))
    }

    fn draft(&mut self) -> io::Result<&mut Draft> {
        let draft = match self.draft.take() {
            Some(draft) => draft,
            None => Draft::create(&self.place)?,
        };
        Ok(self.draft.insert(draft))
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.draft()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.draft()?.flush()
    }
}

impl Seek for PendingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.draft()?.seek(to)
    }
}

/// Moves several files to their destinations, none before all are written. They are moved in order,
/// so whoever sees the last one sees the others.
///
/// # Errors
/// If one cannot be written or renamed; then no new file is left behind.
pub fn commit(files: Vec<PendingFile>) -> Result<()> {
    commit_then(files, || ())
}

/// Like [`commit`], and calls `after` before another run can put files into the same folders.
///
/// # Errors
/// As [`commit`].
pub fn commit_then(files: Vec<PendingFile>, after: impl FnOnce()) -> Result<()> {
    let (mut drafts, mut streams) = (Vec::new(), Vec::new());
    for mut file in files {
        file.inputs.refuse(&file.target)?;
        let flushed = file.draft().and_then(Draft::flushed);
        flushed.map_err(|error| Error::file(&file.target, error))?;
        let Some(draft) = file.draft else { continue };
        match file.place {
            Place::File(path) => drafts.push((file.target, path, draft)),
            Place::Stream(path) => streams.push((file.target, path, file.stream, draft)),
        }
    }
    if !drafts.is_empty() {
        let mut folders: Vec<PathBuf> =
            drafts.iter().map(|(_, path, _)| folder_of(path).to_owned()).collect();
        // Locks are taken in a fixed order, so that two runs cannot deadlock.
        folders.sort();
        folders.dedup();
        let locks: Vec<FolderLock> = folders.iter().map(|path| FolderLock::take(path)).collect();
        let are_held = locks.iter().all(FolderLock::is_held);
        if are_held {
            for folder in &folders {
                sweep(folder);
            }
        }
        place_all(drafts, are_held)?;
        after();
    }
    for (target, path, stream, draft) in streams {
        draft.pour(stream, &path).map_err(|error| Error::file(&target, error))?;
    }
    Ok(())
}

/// Moves each draft to its destination, in order.
fn place_all(drafts: Vec<(PathBuf, PathBuf, Draft)>, are_held: bool) -> Result<()> {
    let _placing = Placing::begin();
    // Everything slow is done before the first file is moved.
    let mut ready = Vec::new();
    for (turn, (target, path, draft)) in drafts.into_iter().enumerate() {
        let turn = are_held.then_some(turn);
        let named = if fs::symlink_metadata(&path).is_err() {
            Ready::New(draft)
        } else {
            Ready::Named(draft.named(&path, turn).map_err(|error| Error::file(&target, error))?)
        };
        ready.push((target, path, named));
    }
    let mut new = Vec::new();
    for (target, path, draft) in ready {
        match draft.place(&path) {
            Ok(is_new) => new.extend(is_new.then_some(path)),
            Err(error) => {
                for path in new {
                    // If it cannot be removed, nothing more can be done.
                    let _ = fs::remove_file(path);
                }
                return Err(Error::file(target, error));
            }
        }
    }
    Ok(())
}

/// A complete file that can be moved to its destination.
enum Ready {
    /// An unnamed file to be linked where nothing exists yet.
    New(Draft),
    /// A file with a temporary name, to be renamed.
    Named(Leftover),
}

impl Ready {
    /// Moves the file to `path`, and returns whether nothing existed there before.
    fn place(self, path: &Path) -> io::Result<bool> {
        let (named, is_new) = match self {
            Self::New(draft) if draft.link_new(path).is_some() => return Ok(true),
            Self::New(draft) => (draft.named(path, None)?, fs::symlink_metadata(path).is_err()),
            Self::Named(named) => (named, false),
        };
        fs::rename(named.path(), path)?;
        named.placed();
        Ok(is_new)
    }
}
