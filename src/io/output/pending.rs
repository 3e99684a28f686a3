//! Files that are promised before the work and put in their places after it, several together. It
//! knows nothing of what is in them.

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

/// A file to be written once its contents are known. Until it is committed nothing lies in the
/// folder and an older file of that name is unchanged; dropped, it leaves nothing.
#[derive(Debug)]
pub struct PendingFile {
    target: PathBuf,
    place: Place,
    inputs: Inputs,
    /// Begun with the first byte.
    draft: Option<Draft>,
    /// A pipe whose reader is there already, or a device.
    stream: Option<File>,
}

impl PendingFile {
    /// Promises a file that will be `target`. Made before the work whose result it takes, it tells
    /// at once whether there is a place to write to. Links are followed, an older file's mode is
    /// kept, and pipes and devices get all bytes when they are committed.
    ///
    /// # Errors
    /// If `target` is one of `inputs`; if its folder does not exist or cannot be written to; if it
    /// is a folder or may not be written over.
    pub fn create(target: impl AsRef<Path>, inputs: &Inputs) -> Result<Self> {
        let target = target.as_ref().to_owned();
        inputs.refuse(&target)?;
        let failed = |error| Error::file(&target, error);
        let place = Place::of(&target).map_err(failed)?;
        place.check().map_err(failed)?;
        let stream = match &place {
            Place::Stream(path) => stream::open_now(path).map_err(failed)?,
            // Gone again at once: a run that is interrupted leaves nothing.
            Place::File(_) => {
                drop(Draft::create(&place).map_err(failed)?);
                None
            }
        };
        Ok(Self { place, inputs: inputs.clone(), draft: None, stream, target })
    }

    /// The name that it was promised under.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Where the file will lie, links followed; a pipe or device itself.
    pub fn path(&self) -> &Path {
        match &self.place {
            Place::File(path) | Place::Stream(path) => path,
        }
    }

    /// Whether it is a pipe or a device, beside which nothing can lie.
    pub fn is_stream(&self) -> bool {
        matches!(self.place, Place::Stream(_))
    }

    /// The same file under the name `name` in the same folder.
    ///
    /// # Errors
    /// As [`PendingFile::create`].
    pub fn renamed(mut self, name: &str) -> Result<Self> {
        let draft = self.draft.take();
        let named = Self::create(folder_of(self.path()).join(name), &self.inputs)?;
        Ok(Self { draft, ..named })
    }

    /// Puts a file with `contents` in its place.
    ///
    /// # Errors
    /// If it cannot be written or renamed; then nothing is left behind.
    pub fn finish_with(mut self, contents: &[u8]) -> Result<()> {
        self.put(contents)?;
        commit(vec![self])
    }

    /// Adds `bytes` to the file.
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

/// Puts several files in their places: none before all of them are written. The last one comes
/// last, so that who sees it sees the others.
///
/// # Errors
/// If one cannot be written or renamed; then no new file is left behind.
pub fn commit(files: Vec<PendingFile>) -> Result<()> {
    commit_then(files, || ())
}

/// As [`commit`]; `after` is done before another run puts files into the same folder.
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
        // Always in the same order, so that two runs never wait for each other.
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

/// Puts each draft where it belongs, in order.
fn place_all(drafts: Vec<(PathBuf, PathBuf, Draft)>, are_held: bool) -> Result<()> {
    let _placing = Placing::begin();
    // All that takes time comes before the first of them is in its place.
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
                    // Nothing more can be done about one that stays.
                    let _ = fs::remove_file(path);
                }
                return Err(Error::file(target, error));
            }
        }
    }
    Ok(())
}

/// A whole file on its way to its place.
enum Ready {
    /// To be named where nothing is yet.
    New(Draft),
    /// To be renamed.
    Named(Leftover),
}

impl Ready {
    /// Puts it at `path`; whether nothing was there before.
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
