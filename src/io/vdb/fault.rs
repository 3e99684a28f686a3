//! Errors in the bytes of a file, before the file's name is known. Knows nothing of the format: the
//! parsers say what they were reading.

use std::io;
use std::path::Path;

use crate::error::Error;

/// A failure inside the reader; [`Fault::in_file`] makes it the crate's error.
#[derive(Debug)]
pub(super) enum Fault {
    /// The operating system failed.
    Io(io::Error),
    /// `needed` bytes were to be read at byte `at`, but the available data ends before.
    Short { at: u64, needed: u64 },
    /// The bytes at `at` contradict the format.
    Bad { at: u64, why: String },
    /// There is not enough memory for the contents.
    Memory(Error),
}

impl Fault {
    /// An error: the bytes at `at` contradict the format.
    pub(super) fn bad(at: u64, why: impl Into<String>) -> Self {
        Self::Bad { at, why: why.into() }
    }

    /// The crate's error, with the file and what was being read ("header", `grid "density"`).
    pub(super) fn in_file(self, path: &Path, what: &str) -> Error {
        match self {
            Self::Io(source) => Error::file(path, source),
            Self::Short { at, needed } => Error::contents(
                path,
                format!("{what}: it ends early: {needed} bytes needed at byte {at}"),
            ),
            Self::Bad { at, why } => Error::contents(path, format!("{what}: {why} (byte {at})")),
            Self::Memory(error) => error,
        }
    }
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Memory(error)
    }
}

/// Results inside the reader.
pub(super) type Parsed<T> = Result<T, Fault>;
