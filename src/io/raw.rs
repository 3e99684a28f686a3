//! Raw voxels: numbers without a header, x fastest, described by options or by a sidecar.

use std::path::Path;

use glam::DVec3;

use super::dense::DenseHeader;
pub use super::number::{Endian, ValueType};
use super::options::ReadOptions;
pub use super::sidecar::Sidecar;
use crate::error::{Error, ErrorKind, Result};
use crate::volume::MAX_DIM;

/// Describes the raw file `path` of `size` bytes from `options` or else from its sidecar.
///
/// # Errors
/// If neither says what is needed, or if the file does not have exactly the size that follows from
/// them.
pub fn describe(path: &Path, size: u64, options: &ReadOptions) -> Result<DenseHeader> {
    let sidecar = Sidecar::beside(path)?;
    let sidecar_path = sidecar.as_ref().map_or(path, |(path, _)| path).to_owned();
    let sidecar = sidecar.map(|(_, sidecar)| sidecar).unwrap_or_default();
    let in_sidecar = |error: Error| Error::contents(&sidecar_path, error.to_string());

    let dims = options.dims.or(sidecar.dims);
    let dims = dims.ok_or_else(|| undescribed(path, "`volume.dims` and `volume.type`"))?;
    let value_type = match (options.value_type, &sidecar.value_type) {
        (Some(given), _) => given,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => return Err(undescribed(path, "`volume.type`")),
    };
    let mut header = DenseHeader::new(dims, value_type);
    header.endian = match (options.endian, &sidecar.endian) {
        (Some(given), _) => given,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => Endian::default(),
    };
    header.components = sidecar.components.unwrap_or(1);
    sidecar.describe(&mut header).map_err(in_sidecar)?;
    if options.spacing.is_none() {
        let spacing = DVec3::from(sidecar.spacing.unwrap_or([1.0; 3]));
        if !(spacing.is_finite() && spacing.min_element() > 0.0) {
            let why = format!("spacing: {spacing} is not above 0 on every axis");
            return Err(Error::contents(&sidecar_path, why));
        }
    }

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

/// The error for a raw file without a description; `missing` names what is lacking.
pub fn undescribed(path: &Path, missing: &str) -> Error {
    ErrorKind::Contents {
        path: path.to_owned(),
        why: format!(
            "not a format that this program can read; raw voxels need {missing} (or \
             the sidecar {})",
            Sidecar::path_beside(path).display()
        ),
    }
    .into()
}
