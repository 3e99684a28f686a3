//! Raw voxels: numbers without a header, x fastest, described by options or by a sidecar.

use std::io::Read;
use std::path::Path;

use glam::DVec3;

use super::dense::DenseHeader;
use super::files;
pub use super::number::{Endian, ValueType};
use super::options::ReadOptions;
pub use super::sidecar::Sidecar;
use crate::error::{Error, Result};
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

/// The error for a file of no known format and without a description; `missing` names what raw
/// voxels lack. What is surely something else is called by its name.
pub fn undescribed(path: &Path, missing: &str) -> Error {
    let mut start = Vec::new();
    // A file that cannot be read is not recognised.
    let _ = files::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    if let Some(what) = no_volume(&start) {
        return Error::contents(path, what);
    }
    let unread = Sidecar::unread_beside(path).map(|why| format!("; {why}")).unwrap_or_default();
    let sidecar = Sidecar::path_beside(path);
    let why = format!(
        "not a format that this program can read; raw voxels need {missing} (or the sidecar {}){unread}",
        sidecar.display()
    );
    Error::contents(path, why)
}

/// Bytes from which a file is recognised.
const START: u64 = 2048;

/// What a file is that begins with `start` and is no volume, if that is known.
fn no_volume(start: &[u8]) -> Option<&'static str> {
    const PICTURES: [(&[u8], &str); 6] = [
        (b"\x89PNG", "a picture (PNG), not a volume"),
        (b"\xff\xd8\xff", "a picture (JPEG), not a volume"),
        (b"GIF8", "a picture (GIF), not a volume"),
        (b"II*\0", "a picture (TIFF), which is not supported as a volume"),
        (b"MM\0*", "a picture (TIFF), which is not supported as a volume"),
        (b"#?RADIANCE", "a picture (Radiance), not a volume"),
    ];
    const MESHES: [&[u8]; 3] = [b"ply\n", b"ply\r", b"solid "];
    if start.is_empty() {
        return Some("an empty file");
    }
    if let Some((_, what)) = PICTURES.iter().find(|(mark, _)| start.starts_with(mark)) {
        return Some(what);
    }
    if MESHES.iter().any(|mark| start.starts_with(mark)) {
        return Some("a mesh in PLY or STL, which is not supported yet; .obj and .gltf are");
    }
    None
}
