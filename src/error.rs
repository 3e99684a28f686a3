//! The one error type of the crate: what went wrong, with the file and the number that is wrong.
//! It knows nothing of any module that raises it.

use std::path::{Path, PathBuf};

/// Short for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong, in one line; boxed so that results stay one word wide.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct Error(Box<ErrorKind>);

/// The kinds of failure, by who can act on them.
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

    /// A failure of the graphics device.
    pub fn gpu(why: impl Into<String>) -> Self {
        ErrorKind::Gpu { why: why.into() }.into()
    }
}

impl From<ErrorKind> for Error {
    fn from(kind: ErrorKind) -> Self {
        Self(Box::new(kind))
    }
}
