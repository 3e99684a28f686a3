//! The one error type of the crate: what went wrong, with the file and the number that is wrong;
//! how it is said, and memory that may be refused. It knows nothing of any module that raises it.

pub mod memory;
pub mod quote;

use std::fmt;
use std::path::{Path, PathBuf};

use quote::{LONGEST_LINE, one_line};

/// Short for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong; boxed so that results stay one word wide. Shown, it is one line of less than
/// [`LONGEST_LINE`] characters in which nothing steers a terminal, whatever it quotes.
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

/// Characters of a line that stay free for the name of a program.
const ROOM: usize = 20;

/// The kinds of failure, by who can act on them; their texts quote as it is what they hold.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system refused to read or write `path`.
    #[error("{}: {source}", path.display())]
    File {
        /// The file that was asked for.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The contents of `path` are not what they claim to be.
    #[error("{}: {why}", path.display())]
    Contents {
        /// The file that was read.
        path: PathBuf,
        /// What is wrong with it, with the numbers.
        why: String,
    },
    /// A value given by the caller (an option, a key of a scene, an argument) cannot be used.
    #[error("{what}: {why}")]
    Value {
        /// The option, key or argument.
        what: String,
        /// Why it cannot be used.
        why: String,
    },
    /// The work would take more memory or a larger resource than allowed.
    #[error("{what}: needs {needed}, the limit is {limit}")]
    Limit {
        /// What was to be allocated.
        what: String,
        /// How much it takes, with its unit.
        needed: String,
        /// How much is allowed, with its unit.
        limit: String,
    },
    /// The graphics device or its driver failed, or there is none.
    #[error("gpu: {why}")]
    Gpu {
        /// The driver's or wgpu's words.
        why: String,
    },
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

    /// A failure of the graphics device; of the many lines that drivers say, one is made.
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
