//! Outputs that appear whole or not at all: written beside the target, then renamed.

#[cfg(target_os = "linux")]
use std::fs::File;
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
        let mut drafts = Vec::new();
        for (pending, parts) in files {
            let draft = Draft::write(&pending.target, parts);
            drafts.push(draft.map_err(|error| Error::file(&pending.target, error))?);
        }
        let mut named = Vec::new();
        for (draft, (pending, _)) in drafts.into_iter().zip(files) {
            let file = draft.named(&pending.target);
            named.push((pending, file.map_err(|error| Error::file(&pending.target, error))?));
        }
        let mut new = Vec::new();
        for (pending, file) in named {
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

/// A whole file that is not in its place yet, gone when dropped.
enum Draft {
    Named(NamedTempFile),
    /// Also gone when the program is killed while it writes.
    #[cfg(target_os = "linux")]
    Unnamed(File),
}

impl Draft {
    /// Writes the pieces to a new file in the folder of `target`.
    fn write(target: &Path, parts: &[&[u8]]) -> io::Result<Self> {
        let mut draft = Self::create(target)?;
        let file = match &mut draft {
            Self::Named(file) => file.as_file_mut(),
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file,
        };
        parts.iter().try_for_each(|part| file.write_all(part))?;
        Ok(draft)
    }

    #[cfg(target_os = "linux")]
    fn create(target: &Path) -> io::Result<Self> {
        use rustix::fs::{Mode, OFlags, open};

        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        match open(folder(target), flags, Mode::from_raw_mode(0o666)) {
            Ok(file) => Ok(Self::Unnamed(file.into())),
            // Not every file system has files without names.
            Err(_) => beside(target).map(Self::Named),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn create(target: &Path) -> io::Result<Self> {
        beside(target).map(Self::Named)
    }

    /// The file under a name of its own beside `target`.
    #[cfg(target_os = "linux")]
    fn named(self, target: &Path) -> io::Result<tempfile::TempPath> {
        use std::io::Seek;
        use std::os::fd::AsRawFd;

        use rustix::fs::{AtFlags, CWD, linkat};

        let mut file = match self {
            Self::Named(file) => return Ok(file.into_temp_path()),
            Self::Unnamed(file) => file,
        };
        let from = format!("/proc/self/fd/{}", file.as_raw_fd());
        let linked = tempfile::Builder::new().prefix(PREFIX).make_in(folder(target), |path| {
            Ok(linkat(CWD, &from, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
        });
        if let Ok(linked) = linked {
            return Ok(linked.into_temp_path());
        }
        // Without /proc its contents go into a file that has a name.
        let mut copy = beside(target)?;
        file.rewind()?;
        io::copy(&mut file, copy.as_file_mut())?;
        Ok(copy.into_temp_path())
    }

    #[cfg(not(target_os = "linux"))]
    fn named(self, _target: &Path) -> io::Result<tempfile::TempPath> {
        let Self::Named(file) = self;
        Ok(file.into_temp_path())
    }
}

/// How the names of files begin that are not in their places yet.
pub(super) const PREFIX: &str = ".deepshadow-";

/// The folder that `target` lies in.
pub(super) fn folder(target: &Path) -> &Path {
    match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A new file in the folder of `target`, removed when dropped.
fn beside(target: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder(target))
}
