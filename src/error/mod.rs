//! The crate's error type: what went wrong, with the file and the number in question. Its
//! submodules format messages, and allocate memory that may be refused. Knows none of the modules
//! that raise errors.

pub mod memory;
pub mod quote;

use std::fmt;
use std::path::{Path, PathBuf};

use quote::{LONGEST_LINE, one_line};

/// The result type of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong; boxed so that results are one word wide. Its text is one line of fewer than
/// [`LONGEST_LINE`] characters, without characters that control a terminal, whatever it quotes.
#[derive(Debug)]
pub struct Error(Box<ErrorKind>);

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&one_line(&self.0.to_string(), LONGEST_LINE - ROOM))
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source()
    }
}

/// Characters of a line that are reserved for the name of a program.
const ROOM: usize = 20;

/// The kinds of failure, by who can act on them. Their fields hold quoted text unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system refused to read or write `path`.
    #[error("{}: {source}", path.display())]
    File {
        /// The file that was to be read or written.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The contents of `path` are not what they claim to be.
    #[error("{}: {why}", path.display())]
    Contents {
        /// The file that was read.
        path: PathBuf,
        /// What is wrong with it, with the numbers in question.
        why: String,
    },
    /// A value from the caller (an option, a key of a scene, an argument) cannot be used.
    #[error("{what}: {why}")]
    Value {
        /// The option, key or argument.
        what: String,
        /// Why it cannot be used.
        why: String,
    },
    /// The work would take more memory, or a larger resource, than allowed.
    #[error("{what}: needs {needed}, the limit is {limit}")]
    Limit {
        /// What was to be allocated.
        what: String,
        /// The amount that it takes, with its unit.
        needed: String,
        /// The amount that is allowed, with its unit.
        limit: String,
    },
    /// The graphics device or its driver failed, or there is none.
    #[error("gpu: {why}")]
    Gpu {
        /// The message of the driver or of wgpu.
        why: String,
    },
    /// The caller did not want the result any more (`Progress::cancelled`).
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// The kind, for callers that want to act on it.
    pub fn kind(&self) -> &ErrorKind {
        &self.0
    }

    /// A failure of the operating system at `path`.
    pub fn file(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        ErrorKind::File { path: path.as_ref().to_owned(), source }.into()
    }

    /// Contents of `path` that cannot be used.
    pub fn contents(path: impl AsRef<Path>, why: impl Into<String>) -> Self {
        ErrorKind::Contents { path: path.as_ref().to_owned(), why: why.into() }.into()
    }

    /// A value that cannot be used.
    pub fn value(what: impl Into<String>, why: impl Into<String>) -> Self {
        ErrorKind::Value { what: what.into(), why: why.into() }.into()
    }

    /// A failure of the graphics device; a driver's message of several lines becomes one line.
    pub fn gpu(why: impl Into<String>) -> Self {
        let why: String = why.into();
        let words: Vec<&str> = why.split_whitespace().collect();
        ErrorKind::Gpu { why: words.join(" ") }.into()
    }
}

impl From<ErrorKind> for Error {
    fn from(kind: ErrorKind) -> Self {
        Self(Box::new(kind))
    }
}
