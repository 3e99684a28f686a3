//! The beginning of a file with its header, read once, and checked access to it. Knows no format.

use std::io::Read;
use std::path::Path;

use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::io::files;

/// The largest number of bytes for a header.
const LONGEST_HEADER: u64 = 1 << 20;

/// A file whose header is being read.
pub(super) struct Input<'a> {
    pub(super) path: &'a Path,
    /// The first bytes of the file.
    pub(super) head: Vec<u8>,
    /// Bytes in the whole file.
    pub(super) size: u64,
    /// The largest number of bytes for unpacked data.
    pub(super) max_bytes: u64,
}

impl<'a> Input<'a> {
    pub(super) fn open(path: &'a Path, max_bytes: u64) -> Result<Self> {
        let failed = |error| Error::file(path, error);
        let (file, size) = files::open_sized(path).map_err(failed)?;
        let mut head = Vec::new();
        file.take(LONGEST_HEADER).read_to_end(&mut head).map_err(failed)?;
        Ok(Self { path, head, size, max_bytes })
    }

    /// The whole file, for formats whose header is not only at its beginning.
    pub(super) fn whole(&self) -> Result<Vec<u8>> {
        if self.size > self.max_bytes {
            return Err(self.too_large("the file", u128::from(self.size)));
        }
        let failed = |error| Error::file(self.path, error);
        let mut bytes = memory::room(memory::count(self.size), &self.path.display().to_string())?;
        let file = files::open(self.path).map_err(failed)?;
        // Bounded by the room that was reserved, in case the file has grown meanwhile.
        file.take(self.size).read_to_end(&mut bytes).map_err(failed)?;
        Ok(bytes)
    }

    /// The error for contents that are invalid.
    pub(super) fn bad(&self, why: impl Into<String>) -> Error {
        Error::contents(self.path, why)
    }

    pub(super) fn too_large(&self, what: &str, needed: u128) -> Error {
        let what = format!("{}: {what}", self.path.display());
        let (needed, limit) = (format!("{needed} bytes"), format!("{} bytes", self.max_bytes));
        ErrorKind::Limit { what, needed, limit }.into()
    }

    /// `N` bytes at `at`.
    pub(super) fn array<const N: usize>(&self, at: usize) -> Result<[u8; N]> {
        let bytes = at.checked_add(N).and_then(|end| self.head.get(at..end));
        bytes.and_then(|bytes| bytes.try_into().ok()).ok_or_else(|| {
            self.bad(format!("it ends early: {N} bytes needed at byte {at} of {}", self.size))
        })
    }

    /// Voxel counts along x, y, z, checked, from a header's integers.
    pub(super) fn dims(&self, lengths: [i64; 3]) -> Result<[usize; 3]> {
        let [x, y, z] = lengths;
        if lengths.iter().any(|&n| n < 1 || n > crate::volume::MAX_DIM as i64) {
            let why = format!("dims {x},{y},{z} must each be 1 to {}", crate::volume::MAX_DIM);
            return Err(self.bad(why));
        }
        Ok(lengths.map(|n| n as usize))
    }

    /// Parses `N` numbers, separated by white space or commas, from a header's line.
    pub(super) fn numbers<T: std::str::FromStr, const N: usize>(
        &self,
        key: &str,
        text: &str,
    ) -> Result<[T; N]> {
        let words = text.split([' ', '\t', ',', '\r', '\n']).filter(|word| !word.is_empty());
        let numbers: Option<Vec<T>> = words.take(N + 1).map(|word| word.parse().ok()).collect();
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
            let text: String = text.chars().take(60).collect();
            self.bad(format!("{key}: '{}' is not {N} numbers", text.trim()))
        })
    }
}
