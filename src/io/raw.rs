//! Raw voxels: numbers and nothing else, x fastest, described by options or by a sidecar.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};
use serde::Deserialize;

use super::dense::DenseHeader;
pub use super::number::{Endian, ValueType};
use crate::error::{Error, ErrorKind, Result};
use crate::scene::file::VolumeTable;
use crate::volume::MAX_DIM;

/// A sidecar, `NAME.toml` beside `NAME.raw`; every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Sidecar {
    pub dims: Option<[usize; 3]>,
    #[serde(rename = "type")]
    pub value_type: Option<String>,
    pub endian: Option<String>,
    pub spacing: Option<[f64; 3]>,
    /// Rows, for column vectors.
    pub world_from_index: Option<[[f64; 4]; 4]>,
    pub index_origin: Option<[f64; 3]>,
    pub background: Option<f64>,
    pub up: Option<String>,
}

impl Sidecar {
    /// The sidecar of the raw file `path`, if there is one, and its own path.
    ///
    /// # Errors
    /// If there is one that cannot be read.
    pub fn beside(path: &Path) -> Result<Option<(PathBuf, Self)>> {
        let beside = path.with_extension("toml");
        if beside == path || !beside.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&beside).map_err(|error| Error::file(&beside, error))?;
        // A scene file of the same name is no sidecar.
        if text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("volume")) {
            return Ok(None);
        }
        let sidecar = toml::from_str(&text)
            .map_err(|error| Error::contents(&beside, error.message().replace('\n', " ")))?;
        Ok(Some((beside, sidecar)))
    }

    /// From voxel index to the file's own world; `None` if the sidecar does not say.
    pub fn world_from_index(&self) -> Option<DMat4> {
        let origin = DVec3::from(self.index_origin.unwrap_or_default());
        let placed = match (self.world_from_index, self.spacing) {
            (Some(rows), _) => DMat4::from_cols_array_2d(&rows).transpose(),
            (None, Some(spacing)) => DMat4::from_scale(spacing.into()),
            (None, None) if self.index_origin.is_some() => DMat4::IDENTITY,
            (None, None) => return None,
        };
        Some(placed * DMat4::from_translation(origin))
    }
}

/// What the options of `table`, or else the sidecar, say of the raw file `path` of `size` bytes.
///
/// # Errors
/// If neither says what is needed, or if the file does not have exactly the size that follows.
pub fn describe(path: &Path, size: u64, table: &VolumeTable) -> Result<DenseHeader> {
    let sidecar = Sidecar::beside(path)?;
    let sidecar_path = sidecar.as_ref().map_or(path, |(path, _)| path).to_owned();
    let sidecar = sidecar.map(|(_, sidecar)| sidecar).unwrap_or_default();
    let in_sidecar = |error: Error| Error::contents(&sidecar_path, error.to_string());

    let dims = table.dims.or(sidecar.dims);
    let dims = dims.ok_or_else(|| undescribed(path, "--dims and --type"))?;
    let value_type = match (&table.value_type, &sidecar.value_type) {
        (Some(given), _) => given.parse::<ValueType>()?,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => return Err(undescribed(path, "--type")),
    };
    let mut header = DenseHeader::new(dims, value_type);
    header.endian = match (&table.endian, &sidecar.endian) {
        (Some(given), _) => given.parse::<Endian>()?,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => Endian::default(),
    };
    header.up = sidecar.up.as_deref().map(str::parse).transpose().map_err(in_sidecar)?;
    if table.spacing.is_none() {
        let spacing = DVec3::from(sidecar.spacing.unwrap_or([1.0; 3]));
        if !(spacing.is_finite() && spacing.min_element() > 0.0) {
            let why = format!("spacing: {spacing} is not above 0 on every axis");
            return Err(Error::contents(&sidecar_path, why));
        }
    }
    header.world_from_index = sidecar.world_from_index().unwrap_or(DMat4::IDENTITY);

    let [x, y, z] = dims;
    if dims.iter().any(|&n| n == 0 || n > MAX_DIM) {
        return Err(Error::value("dims", format!("{x},{y},{z} must each be 1 to {MAX_DIM}")));
    }
    let expected = header.bytes();
    if u128::from(size) != expected {
        let why = format!("{size} bytes, but dims {x},{y},{z} of this type take {expected}");
        return Err(Error::contents(path, why));
    }
    Ok(header)
}

/// An error for a raw file that nothing describes.
pub fn undescribed(path: &Path, missing: &str) -> Error {
    ErrorKind::Contents {
        path: path.to_owned(),
        why: format!(
            "no format that this program reads; raw voxels need {missing} (or a sidecar {})",
            path.with_extension("toml").display()
        ),
    }
    .into()
}
