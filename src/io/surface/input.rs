//! A file of a surface while it is read, and the memory that this may take. Knows no format.

use std::io::Read;
use std::path::Path;

use glam::Vec3;

use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::io::files;

/// A file that is being read.
pub(super) struct Input<'a> {
    pub(super) path: &'a Path,
    /// Bytes of the file.
    pub(super) size: u64,
    max_bytes: u64,
    /// Bytes that may still be taken.
    left: u64,
    /// What people should know of the file, one line each.
    pub(super) notes: Vec<String>,
}

impl<'a> Input<'a> {
    pub(super) fn new(path: &'a Path, max_bytes: u64) -> Result<Self> {
        let size = size_of_file(path)?;
        Ok(Self { path, size, max_bytes, left: max_bytes, notes: Vec::new() })
    }

    /// The error for contents that are invalid.
    pub(super) fn bad(&self, why: impl Into<String>) -> Error {
        Error::contents(self.path, why)
    }

    /// Counts `bytes` of memory for `what`.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if they are more than what is left.
    pub(super) fn take(&mut self, bytes: u64, what: &str) -> Result<()> {
        let Some(left) = self.left.checked_sub(bytes) else {
            let needed = u128::from(self.max_bytes - self.left) + u128::from(bytes);
            let what = format!("{}: {what}", self.path.display());
            let (needed, limit) = (format!("{needed} bytes"), format!("{} bytes", self.max_bytes));
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        };
        self.left = left;
        Ok(())
    }

    /// The whole of `file`: this one, or one that it names.
    pub(super) fn whole(&mut self, file: &Path) -> Result<Vec<u8>> {
        let size = size_of_file(file)?;
        self.take(size, "the file")?;
        let failed = |error| Error::file(file, error);
        let mut bytes = memory::room(memory::count(size), &file.display().to_string())?;
        // Bounded by the room that was reserved, in case the file has grown meanwhile.
        files::open(file).map_err(failed)?.take(size).read_to_end(&mut bytes).map_err(failed)?;
        Ok(bytes)
    }
}

/// The bytes of a file. What can only be read once, or never ends, is refused.
fn size_of_file(path: &Path) -> Result<u64> {
    let found = files::metadata(path).map_err(|error| Error::file(path, error))?;
    if found.is_file() { Ok(found.len()) } else { Err(Error::contents(path, "not a file")) }
}

/// The number at the beginning of `bytes`, little endian; 0 if there are too few.
pub(super) fn u32_of(bytes: &[u8]) -> u32 {
    bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// The number at the beginning of `bytes`, little endian; NaN if there are too few.
pub(super) fn f32_of(bytes: &[u8]) -> f32 {
    bytes.first_chunk().map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes))
}

/// Vectors of three numbers, each at the beginning of `stride` bytes.
pub(super) fn vectors(bytes: &[u8], stride: usize, what: &str) -> Result<Vec<Vec3>> {
    let vector = |b: &[u8]| Vec3::new(f32_of(b), f32_of(&b[4..]), f32_of(&b[8..]));
    memory::collected(bytes.chunks_exact(stride.max(12)).map(vector), what)
}

/// Brings numbers to 0..1, and counts those that were outside. NaN stays.
#[derive(Default)]
pub(super) struct Clamp {
    count: usize,
}

impl Clamp {
    pub(super) fn number(&mut self, x: f32) -> f32 {
        self.count += usize::from(!x.is_nan() && !(0.0..=1.0).contains(&x));
        x.clamp(0.0, 1.0)
    }

    pub(super) fn color(&mut self, color: Vec3) -> Vec3 {
        Vec3::from(color.to_array().map(|x| self.number(x)))
    }

    pub(super) fn colors(&mut self, colors: &mut [Vec3]) {
        for color in colors {
            *color = self.color(*color);
        }
    }

    /// Says how many there were, if any.
    pub(super) fn note(&self, what: &str, notes: &mut Vec<String>) {
        if self.count > 0 {
            notes.push(format!("{} of its {what} are not in 0..1 and are clamped", self.count));
        }
    }
}
