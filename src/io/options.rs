//! How files are read, where they leave it open.

use std::path::Path;

use super::dense::DEFAULT_MAX_BYTES;
use super::fog::Class;
use super::format::Format;
use super::number::{Endian, ValueType};
use crate::error::{Error, Result};
use crate::scene::file::VolumeTable;

/// What a reader is told beside the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// The format; `None` for what the file begins with, and raw where there are `dims`.
    pub format: Option<Format>,
    /// The grid of an OpenVDB file, or the array of a VTK file; `None` for the one that looks most
    /// like densities.
    pub grid: Option<String>,
    /// What the numbers are; `None` for what the file says.
    pub class: Option<Class>,
    /// Bytes that voxels may take in memory.
    pub max_bytes: u64,
    /// Voxels of a raw file along x, y and z.
    pub dims: Option<[usize; 3]>,
    /// Type of a raw file's numbers.
    pub value_type: Option<ValueType>,
    /// Order of their bytes.
    pub endian: Option<Endian>,
    /// World lengths of a voxel's edges in place of the file's, above 0.
    pub spacing: Option<[f64; 3]>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            format: None,
            grid: None,
            class: None,
            max_bytes: DEFAULT_MAX_BYTES,
            dims: None,
            value_type: None,
            endian: None,
            spacing: None,
        }
    }
}

impl ReadOptions {
    /// What a scene file's table says of how its file is read.
    ///
    /// # Errors
    /// If a name in it is none.
    pub fn of(table: &VolumeTable) -> Result<Self> {
        Ok(Self {
            format: table.from.as_deref().map(str::parse).transpose()?,
            grid: table.grid.clone(),
            class: table.class.as_deref().map(str::parse).transpose()?,
            max_bytes: table.max_bytes.unwrap_or(DEFAULT_MAX_BYTES),
            dims: table.dims,
            value_type: table.value_type.as_deref().map(str::parse).transpose()?,
            endian: table.endian.as_deref().map(str::parse).transpose()?,
            spacing: table.spacing,
        })
    }

    /// The format of `path`.
    ///
    /// # Errors
    /// If there is no such file.
    pub fn format_of(&self, path: &Path) -> Result<Format> {
        match (self.format, self.dims) {
            (Some(format), _) => Ok(format),
            (None, Some(_)) => Ok(Format::Raw),
            (None, None) => Format::of_file(path),
        }
    }

    /// Holds the options against what a file of this format takes.
    ///
    /// # Errors
    /// With the name of the first that it does not take.
    pub fn check(&self, path: &Path, format: Format) -> Result<()> {
        let what = format!("{}, of format {}", path.display(), format.name());
        match format {
            Format::Raw => Ok(()),
            Format::DeepExr => Err(Error::contents(path, "a deep image, no volume")),
            Format::OpenVdb => self.refuse(&what, &["dims", "type", "endian", "spacing"]),
            _ => self.refuse(&what, &["dims", "type", "endian"]),
        }
    }

    /// An error that names a key of `keys` that was given and means nothing for `what`.
    pub(super) fn refuse(&self, what: &str, keys: &[&str]) -> Result<()> {
        let given = [
            ("dims", self.dims.is_some()),
            ("type", self.value_type.is_some()),
            ("endian", self.endian.is_some()),
            ("spacing", self.spacing.is_some()),
            ("grid", self.grid.is_some()),
            ("from", self.format.is_some()),
            ("class", self.class.is_some()),
        ];
        match given.into_iter().find(|(key, given)| *given && keys.contains(key)) {
            Some((key, _)) => Err(Error::value(key, format!("means nothing for {what}"))),
            None => Ok(()),
        }
    }
}
