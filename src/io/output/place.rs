//! Resolves the name of an output through links to a file, a pipe or a device. Writes nothing.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The largest number of links that are followed, the same as in Linux.
const MOST_LINKS: usize = 40;

/// The destination of an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A file, which need not exist and is replaced as a whole.
    File(PathBuf),
    /// A pipe or a device, which receives bytes in sequence.
    Stream(PathBuf),
}

impl Place {
    /// Resolves `target`. Links are kept, also those to a file that does not exist yet.
    pub(super) fn of(target: &Path) -> io::Result<Self> {
        check_platform()?;
        let named = target.file_name().is_some() && !ends_as_folder(target);
        if !named {
            let is_folder = target.is_dir();
            let kind = if is_folder { ErrorKind::IsADirectory } else { ErrorKind::InvalidFilename };
            return Err(io::Error::from(kind));
        }
        let mut path = target.to_owned();
        for _ in 0..MOST_LINKS {
            let metadata = match fs::symlink_metadata(&path) {
                // Whether its folder exists is checked later.
                Err(error)
                    if [ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&error.kind()) =>
                {
                    return Ok(Self::File(path));
                }
                metadata => metadata?,
            };
            if metadata.is_dir() {
                return Err(io::Error::from(ErrorKind::IsADirectory));
            }
            if metadata.is_file() {
                return Ok(Self::File(path));
            }
            if !metadata.is_symlink() || is_descriptor(&path) {
                return Ok(Self::Stream(path));
            }
            path = folder_of(&path).join(fs::read_link(&path)?);
        }
        Err(io::Error::other("too many levels of symbolic links"))
    }

    /// Checks that an existing file may be overwritten, or that there is a folder for a new one.
    pub(super) fn check(&self) -> io::Result<()> {
        match self {
            Self::File(path) if path.exists() => {
                OpenOptions::new().append(true).open(path).map(drop)
            }
            Self::File(path) => check_folder(path),
            Self::Stream(_) => Ok(()),
        }
    }
}

/// The folder that contains `path`.
pub(in crate::io) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Checks that the platform has files: a browser has none.
pub(super) fn check_platform() -> io::Result<()> {
    if cfg!(all(target_family = "wasm", target_os = "unknown")) {
        let why = "this platform has no files to write to";
        return Err(io::Error::new(ErrorKind::Unsupported, why));
    }
    Ok(())
}

/// Checks that the folder of the file or folder `path` exists.
pub(super) fn check_folder(path: &Path) -> io::Result<()> {
    let folder = folder_of(path);
    let (kind, why) = match fs::metadata(folder) {
        Ok(found) if found.is_dir() => return Ok(()),
        Ok(_) => (ErrorKind::NotADirectory, "is not a folder"),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            (ErrorKind::NotFound, "does not exist")
        }
        Err(error) => return Err(error),
    };
    Err(io::Error::new(kind, format!("the folder '{}' {why}", folder.display())))
}

/// Whether the path ends as only a folder's can, with a separator.
fn ends_as_folder(path: &Path) -> bool {
    path.as_os_str().to_string_lossy().ends_with(std::path::is_separator)
}

/// Whether the link `path` refers to an open file of a process, such as standard output; where it
/// leads, no file could be put.
fn is_descriptor(path: &Path) -> bool {
    folder_of(path).canonicalize().is_ok_and(|folder| folder.starts_with("/proc"))
}
