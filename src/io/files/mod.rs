//! Reads files: those of the disk, and those that a program has [mounted](mount). Everything in `io`
//! that reads goes through here. Knows no format and writes nothing.
//!
//! In practice: a browser has no disk, so there a program mounts what people chose, under the names
//! that people see, and everything else of `io` works as elsewhere. On other platforms a mounted
//! file hides a file of the same name on the disk.

mod store;

use std::ffi::OsString;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

pub use store::{FileSource, mount, unmount, unmount_all};

/// What a file can be read from.
pub(super) trait Stream: Read + Seek + Send {}
impl<T: Read + Seek + Send> Stream for T {}

/// An open file.
pub(super) type File = Box<dyn Stream>;

/// What a path leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    File,
    Folder,
    /// A pipe or a device, whose bytes can be read only once.
    Stream,
}

/// What is known of a file without opening it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metadata {
    /// `None` for something else, such as a disk.
    kind: Option<Kind>,
    len: u64,
}

impl Metadata {
    pub(super) fn is_file(&self) -> bool {
        self.kind == Some(Kind::File)
    }

    pub(super) fn is_folder(&self) -> bool {
        self.kind == Some(Kind::Folder)
    }

    /// Whether it is a pipe or a device, whose bytes can be read only once.
    pub(super) fn is_stream(&self) -> bool {
        self.kind == Some(Kind::Stream)
    }

    /// Bytes of the file.
    pub(super) fn len(&self) -> u64 {
        self.len
    }
}

/// Opens a file.
pub(super) fn open(path: &Path) -> io::Result<File> {
    open_sized(path).map(|(file, _)| file)
}

/// Opens a file; the number is how many bytes it has.
pub(super) fn open_sized(path: &Path) -> io::Result<(File, u64)> {
    match store::open(path) {
        Some(mounted) => {
            let mounted = mounted?;
            let length = mounted.len();
            Ok((Box::new(mounted), length))
        }
        None => disk::open(path),
    }
}

/// What `path` leads to.
pub(super) fn metadata(path: &Path) -> io::Result<Metadata> {
    store::metadata(path).map_or_else(|| disk::metadata(path), Ok)
}

pub(super) fn exists(path: &Path) -> bool {
    metadata(path).is_ok()
}

pub(super) fn is_file(path: &Path) -> bool {
    metadata(path).is_ok_and(|found| found.is_file())
}

/// The whole of a file of text.
pub(super) fn read_to_string(path: &Path) -> io::Result<String> {
    match store::open(path) {
        Some(mounted) => {
            let mut text = String::new();
            mounted?.read_to_string(&mut text)?;
            Ok(text)
        }
        None => disk::read_to_string(path),
    }
}

/// The path without links and detours.
pub(super) fn canonicalize(path: &Path) -> io::Result<PathBuf> {
    store::metadata(path).map_or_else(|| disk::canonicalize(path), |_| Ok(store::plain(path)))
}

/// The names in a folder, in no order.
pub(super) fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
    let mut names = store::names_in(folder);
    match disk::names_in(folder) {
        Ok(on_disk) => names.extend(on_disk),
        // A folder that only mounted files are in is none on the disk.
        Err(error) if names.is_empty() => return Err(error),
        Err(_) => {}
    }
    Ok(names)
}

/// The disk, by the standard library.
#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
mod disk {
    use std::ffi::OsString;
    use std::fs;
    use std::io;
    use std::path::Path;

    use super::{File, Kind, Metadata};

    pub(super) use std::fs::{canonicalize, read_to_string};

    pub(super) fn open(path: &Path) -> io::Result<(File, u64)> {
        let file = fs::File::open(path)?;
        let length = file.metadata()?.len();
        Ok((Box::new(file), length))
    }

    pub(super) fn metadata(path: &Path) -> io::Result<Metadata> {
        let found = fs::metadata(path)?;
        let kind = match found.file_type() {
            kind if kind.is_file() => Some(Kind::File),
            kind if kind.is_dir() => Some(Kind::Folder),
            kind if is_stream(kind) => Some(Kind::Stream),
            _ => None,
        };
        Ok(Metadata { kind, len: found.len() })
    }

    #[cfg(unix)]
    fn is_stream(kind: fs::FileType) -> bool {
        use std::os::unix::fs::FileTypeExt;

        kind.is_fifo() || kind.is_char_device() || kind.is_socket()
    }

    #[cfg(not(unix))]
    fn is_stream(_: fs::FileType) -> bool {
        false
    }

    pub(super) fn names_in(folder: &Path) -> io::Result<Vec<OsString>> {
        Ok(fs::read_dir(folder)?.flatten().map(|entry| entry.file_name()).collect())
    }
}

/// No disk: nothing is there.
#[cfg(all(target_family = "wasm", target_os = "unknown"))]
mod disk {
    use std::ffi::OsString;
    use std::io;
    use std::path::{Path, PathBuf};

    use super::{File, Metadata};

    fn missing<T>() -> io::Result<T> {
        Err(io::Error::new(io::ErrorKind::NotFound, "no such file"))
    }

    pub(super) fn open(_: &Path) -> io::Result<(File, u64)> {
        missing()
    }

    pub(super) fn metadata(_: &Path) -> io::Result<Metadata> {
        missing()
    }

    pub(super) fn read_to_string(_: &Path) -> io::Result<String> {
        missing()
    }

    pub(super) fn canonicalize(_: &Path) -> io::Result<PathBuf> {
        missing()
    }

    pub(super) fn names_in(_: &Path) -> io::Result<Vec<OsString>> {
        missing()
    }
}
