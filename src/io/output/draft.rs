//! A file in the making: without a name wherever the system has such files, so that whatever ends
//! the program leaves nothing. It knows nothing of other files.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::leftovers::{Leftover, PREFIX, take_away};
use super::place::{Place, folder_of};
use super::stream;

/// Bytes that are collected before they are written.
const BUFFER: usize = 1 << 18;
/// Bytes on their way to a pipe that are kept in memory; more of them in a file without a name.
const IN_MEMORY: usize = 1 << 24;

/// What is written before it is in its place; gone when dropped.
#[derive(Debug)]
pub(super) enum Draft {
    /// Without a name, on the file system of its place.
    #[cfg(target_os = "linux")]
    Unnamed(BufWriter<File>),
    /// With a name beside its place.
    Named(BufWriter<File>, Leftover),
    /// For a pipe or a device.
    Held(tempfile::SpooledTempFile),
}

impl Draft {
    /// An empty draft for `place`, with the mode and the owner of the file that is there.
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
                // Only root may give files away; the mode is the same for all.
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
            // Not every file system has files without names.
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

    /// Everything is out of the program's own memory.
    pub(super) fn flushed(&mut self) -> io::Result<()> {
        self.flush()
    }

    /// Gives what was written to the pipe or device.
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

    /// Puts the file at `path`, where nothing is yet; `None` if there is something after all, or
    /// the file cannot be named at once.
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

    /// The file under a name of its own beside `path`: number `turn` of those that only the holder
    /// of the folder's lock gives, or any.
    pub(super) fn named(self, path: &Path, turn: Option<usize>) -> io::Result<Leftover> {
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
                // Without /proc its contents go into a file that has a name.
                let (mut copy, leftover) = named_beside(path)?;
                copy.set_permissions(file.metadata()?.permissions())?;
                file.rewind()?;
                io::copy(&mut file, &mut copy)?;
                Ok(leftover)
            }
            Self::Held(_) => Err(io::Error::other("no file")),
        }
    }
}

/// Names that files have between being written and being in their places, one after another: who
/// holds the folder's lock gives them, and takes away what an ended run left under them.
fn turn_name(path: &Path, turn: usize) -> PathBuf {
    folder_of(path).join(format!("{PREFIX}{turn}"))
}

/// Takes away what an ended run left in `folder`, whose lock is held.
pub(super) fn sweep(folder: &Path) {
    const TURNS: usize = 8;
    for turn in 0..TURNS {
        take_away(&folder.join(format!("{PREFIX}{turn}")));
    }
}

fn buffered(file: File) -> BufWriter<File> {
    BufWriter::with_capacity(BUFFER, file)
}

/// Gives the file without a name the name `path`.
#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> io::Result<()> {
    use std::os::fd::AsRawFd;

    use rustix::fs::{AtFlags, CWD, linkat};

    let from = format!("/proc/self/fd/{}", file.as_raw_fd());
    Ok(linkat(CWD, &from, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// A new file in the folder of `path`.
fn named_beside(path: &Path) -> io::Result<(File, Leftover)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    let make = || kept(builder.tempfile_in(folder_of(path))?);
    let ((file, _), leftover) = Leftover::new(make, |(_, path)| path.clone())?;
    Ok((file, leftover))
}

/// A file whose name is no longer its own matter.
fn kept<F>(file: NamedTempFile<F>) -> io::Result<(F, PathBuf)> {
    let (file, path) = file.into_parts();
    Ok((file, path.keep()?))
}

/// A new folder beside `path`, under the first of its turns' names if the folder's lock `is_held`.
pub(super) fn folder_beside(path: &Path, is_held: bool) -> io::Result<Leftover> {
    if is_held {
        let name = turn_name(path, 0);
        return Leftover::new(|| std::fs::create_dir(&name), |()| name.clone())
            .map(|((), name)| name);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o777));
    let make = || builder.tempdir_in(folder_of(path)).map(tempfile::TempDir::keep);
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
