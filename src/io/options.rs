//! Options for reading files, for what a file itself leaves open.

use std::path::Path;

use super::dense::DEFAULT_MAX_BYTES;
use super::files;
use super::fog::Class;
use super::format::Format;
use super::number::{Endian, ValueType};
use crate::error::{Error, Result};
use crate::scene::file::VolumeTable;

/// Options for reading a volume file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReadOptions {
    /// The format; `None` recognises it by the file's first bytes, or takes raw if `dims` are
    /// given.
    pub format: Option<Format>,
    /// The grid of an OpenVDB file, or the array of a VTK file; `None` for the one that looks most
    /// like densities.
    pub grid: Option<String>,
    /// What the numbers mean; `None` for what the file says.
    pub class: Option<Class>,
    /// The largest number of bytes for voxels in memory.
    pub max_bytes: u64,
    /// Voxel counts of a raw file along x, y and z.
    pub dims: Option<[usize; 3]>,
    /// Type of a raw file's numbers.
    pub value_type: Option<ValueType>,
    /// Byte order of a raw file's numbers.
    pub endian: Option<Endian>,
    /// World lengths of a voxel's edges along x, y and z, above 0, instead of the file's.
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
    /// A copy with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// The options in the `[volume]` table of a scene file.
    ///
    /// # Errors
    /// If a name in it is unknown.
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

    /// The format in which `path` is read.
    ///
    /// # Errors
    /// If the file cannot be read, if it is a pipe or a device, or if its format is recognised and
    /// not supported.
    pub fn format_of(&self, path: &Path) -> Result<Format> {
        refuse_stream(path)?;
        match (self.format, self.dims) {
            (Some(format), _) => Ok(format),
            (None, Some(_)) => Ok(Format::Raw),
            (None, None) => Format::of_file(path),
        }
    }

    /// Checks that every given option applies to a file of this format.
    ///
    /// # Errors
    /// With the name of the first option that does not apply.
    pub fn check(&self, path: &Path, format: Format) -> Result<()> {
        if let Some(what) = format.no_volume() {
            return Err(Error::contents(path, what));
        }
        let what = format!("{} (format {})", path.display(), format.name());
        match format {
            Format::Raw => Ok(()),
            Format::OpenVdb => self.refuse(&what, &["dims", "type", "endian", "spacing"]),
            _ => self.refuse(&what, &["dims", "type", "endian"]),
        }
    }

    /// Fails if one of `keys` was given, because it means nothing for `what`; the error names the
    /// key.
    pub(crate) fn refuse(&self, what: &str, keys: &[&str]) -> Result<()> {
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
            Some((key, _)) => Err(Error::value(key, format!("does not apply to {what}"))),
            None => Ok(()),
        }
    }
}

/// Checks that `path` can be read at any place, which formats and limits need.
pub(super) fn refuse_stream(path: &Path) -> Result<()> {
    let found = files::metadata(path).map_err(|error| Error::file(path, error))?;
    if found.is_folder() {
        return Err(Error::contents(path, "a folder, not a file"));
    }
    if found.is_stream() {
        let why = "a pipe or a device, which can be read only once; put its contents in a file";
        return Err(Error::contents(path, why));
    }
    Ok(())
}
