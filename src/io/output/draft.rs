//! A file that is being written, without a name where the system has unnamed files, so that nothing
//! is left behind however the program ends. Knows nothing of other files.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::leftovers::{Leftover, PREFIX, take_away};
use super::place::{Place, folder_of};
use super::stream;

/// Number of bytes that are buffered before they are written.
const BUFFER: usize = 1 << 18;
/// Output for a pipe is kept in memory up to this many bytes; more goes to an unnamed file.
const IN_MEMORY: usize = 1 << 24;

/// Output that is not yet at its destination; it is deleted when dropped.
#[derive(Debug)]
pub(super) enum Draft {
    /// An unnamed file in the destination's file system.
    #[cfg(target_os = "linux")]
    Unnamed(BufWriter<File>),
    /// A named file in the destination's folder.
    Named(BufWriter<File>, Leftover),
    /// A buffer for a pipe or a device.
    Held(tempfile::SpooledTempFile),
}

impl Draft {
    /// An empty draft for `place`, with the mode and the owner of the file that exists there, if
    /// any.
    pub(super) fn create(place: &Place) -> io::Result<Self> {
        let path = match place {
            Place::Stream(_) => return Ok(Self::Held(tempfile::spooled_tempfile(IN_MEMORY))),
            Place::File(path) => path,
        };
        let draft = Self::beside(path)?;
        if let Ok(older) = path.metadata() {
            let file = match &draft {
                #[cfg(target_os = "linux")]
                Self::Unnamed(file) => file.get_ref(),
                Self::Named(file, _) => file.get_ref(),
                Self::Held(_) => return Ok(draft),
            };
            #[cfg(unix)]
            {
                use std::os::unix::fs::{MetadataExt, fchown};
                // Only root may change the owner; the mode can be set by everybody.
                let _ = fchown(file, Some(older.uid()), Some(older.gid()));
            }
            // Some file systems have no modes.
            let _ = file.set_permissions(older.permissions());
        }
        Ok(draft)
    }

    #[cfg(target_os = "linux")]
    fn beside(path: &Path) -> io::Result<Self> {
        use rustix::fs::{Mode, OFlags, open};

        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        match open(folder_of(path), flags, Mode::from_raw_mode(0o666)) {
            Ok(file) => Ok(Self::Unnamed(buffered(file.into()))),
            // Some file systems have no unnamed files.
            Err(_) => Self::named_beside(path),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn beside(path: &Path) -> io::Result<Self> {
        Self::named_beside(path)
    }

    fn named_beside(path: &Path) -> io::Result<Self> {
        let (file, leftover) = named_beside(path)?;
        Ok(Self::Named(buffered(file), leftover))
    }

    /// Writes everything from the program's memory to the system.
    pub(super) fn flushed(&mut self) -> io::Result<()> {
        self.flush()
    }

    /// Copies everything that was written to the pipe or device.
    pub(super) fn pour(self, stream: Option<File>, path: &Path) -> io::Result<()> {
        let Self::Held(mut held) = self else { return Ok(()) };
        let mut stream = match stream {
            Some(stream) => stream,
            None => stream::open(path)?,
        };
        held.rewind()?;
        io::copy(&mut held, &mut stream)?;
        stream.flush()
    }

    /// Links the file to `path`, where nothing exists yet. `None` if something does exist after
    /// all, or if the file cannot be linked directly.
    pub(super) fn link_new(&self, path: &Path) -> Option<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => link(file.get_ref(), path).ok(),
            _ => {
                let _ = path;
                None
            }
        }
    }

    /// Gives the file a temporary name beside `path`: name number `turn` of those that only the
    /// holder of the folder's lock uses, or else a random one.
    pub(super) fn named(self, path: &Path, turn: Option<usize>) -> io::Result<Leftover> {
        #[cfg(not(target_os = "linux"))]
        let _ = (path, turn);
        match self {
            Self::Named(_, leftover) => Ok(leftover),
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => {
                let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
                let linked = match turn {
                    Some(turn) => {
                        let name = turn_name(path, turn);
                        Leftover::new(|| link(&file, &name), |()| name.clone())
                            .map(|((), name)| name)
                    }
                    None => {
                        let mut builder = tempfile::Builder::new();
                        builder.prefix(PREFIX);
                        Leftover::new(
                            || kept(builder.make_in(folder_of(path), |name| link(&file, name))?),
                            |((), linked)| linked.clone(),
                        )
                        .map(|(_, name)| name)
                    }
                };
                if let Ok(leftover) = linked {
                    return Ok(leftover);
                }
                // Without /proc, copy the contents to a named file.
                let (mut copy, leftover) = named_beside(path)?;
                copy.set_permissions(file.metadata()?.permissions())?;
                file.rewind()?;
                io::copy(&mut file, &mut copy)?;
                Ok(leftover)
            }
            Self::Held(_) => Err(io::Error::other("not a file")),
        }
    }
}

/// The temporary name number `turn`, for files between being written and being moved to their
/// destinations. Only the holder of the folder's lock uses these names, and it removes files that
/// an interrupted run left under them.
fn turn_name(path: &Path, turn: usize) -> PathBuf {
    folder_of(path).join(format!("{PREFIX}{turn}"))
}

/// Removes what an interrupted run left in `folder`, whose lock must be held.
pub(super) fn sweep(folder: &Path) {
    const TURNS: usize = 8;
    for turn in 0..TURNS {
        take_away(&folder.join(format!("{PREFIX}{turn}")));
    }
}

fn buffered(file: File) -> BufWriter<File> {
    BufWriter::with_capacity(BUFFER, file)
}

/// Links the unnamed file to the name `path`.
#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> io::Result<()> {
    use std::os::fd::AsRawFd;

    use rustix::fs::{AtFlags, CWD, linkat};

    let from = format!("/proc/self/fd/{}", file.as_raw_fd());
    Ok(linkat(CWD, &from, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// A new file with a temporary name in the folder of `path`.
fn named_beside(path: &Path) -> io::Result<(File, Leftover)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let make = || kept(builder.tempfile_in(folder_of(path)).map_err(unnamed)?);
    let ((file, _), leftover) = Leftover::new(make, |(_, path)| path.clone())?;
    Ok((file, leftover))
}

/// The system's own error, without the temporary name that nobody asked for.
fn unnamed(error: io::Error) -> io::Error {
    let inner = error.get_ref().and_then(std::error::Error::source);
    let code = inner.and_then(|inner| inner.downcast_ref::<io::Error>()?.raw_os_error());
    code.map_or(error, io::Error::from_raw_os_error)
}

/// A file that is no longer deleted automatically when dropped.
fn kept<F>(file: NamedTempFile<F>) -> io::Result<(F, PathBuf)> {
    let (file, path) = file.into_parts();
    Ok((file, path.keep()?))
}

/// A new folder beside `path`, under temporary name number 0 if the folder's lock `is_held`, else
/// under a random one.
pub(super) fn folder_beside(path: &Path, is_held: bool) -> io::Result<Leftover> {
    if is_held {
        let name = turn_name(path, 0);
        return Leftover::new(|| std::fs::create_dir(&name), |()| name.clone())
            .map(|((), name)| name);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    let make = || builder.tempdir_in(folder_of(path)).map(tempfile::TempDir::keep).map_err(unnamed);
    let (_, leftover) = Leftover::new(make, PathBuf::clone)?;
    Ok(leftover)
}

impl Write for Draft {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file.write(bytes),
            Self::Named(file, _) => file.write(bytes),
            Self::Held(held) => held.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file.flush(),
            Self::Named(file, _) => file.flush(),
            Self::Held(held) => held.flush(),
        }
    }
}

impl Seek for Draft {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file.seek(to),
            Self::Named(file, _) => file.seek(to),
            Self::Held(held) => held.seek(to),
        }
    }
}
