//! The map of a grid from index to world space, as a matrix. It knows nothing of voxels.
//!
//! The file stores row-vector matrices; the crate's are for column vectors, and as glam's matrices
//! are stored by columns, the sixteen numbers of the file are glam's columns in the same order.

use glam::{DMat4, DVec3};

use super::fault::{Fault, Parsed};
use super::source::Bytes;

/// Where a grid lies in the world.
#[derive(Clone, Debug, PartialEq)]
pub enum Transform {
    /// World position (column vector) from index position; voxel (i, j, k) has its centre at
    /// (i, j, k).
    Affine(DMat4),
    /// The map cannot be used, for this reason; the voxels can still be read.
    Refused(String),
}

/// A transform and the name of its map in the file.
pub(super) struct NamedTransform {
    pub(super) map: String,
    pub(super) transform: Transform,
}

/// Reads the map's name and numbers.
pub(super) fn read(bytes: &mut Bytes) -> Parsed<NamedTransform> {
    let start = bytes.position();
    let map = bytes.string()?;
    if map == "NonlinearFrustumMap" {
        // Index box, taper and depth; then the affine map behind the frustum.
        bytes.each::<f64, 8>(Bytes::f64)?;
        let inner_start = bytes.position();
        let inner = bytes.string()?;
        affine(&inner, bytes, inner_start)?;
        let why = "a frustum (NonlinearFrustumMap) is not an affine transform".to_owned();
        return Ok(NamedTransform { map, transform: Transform::Refused(why) });
    }
    let matrix = affine(&map, bytes, start)?;
    Ok(NamedTransform { transform: usable(&map, matrix), map })
}

fn affine(map: &str, bytes: &mut Bytes, start: u64) -> Parsed<DMat4> {
    let vector = |bytes: &mut Bytes| -> Parsed<DVec3> {
        bytes.each::<f64, 3>(Bytes::f64).map(DVec3::from_array)
    };
    // The voxel size and the three inverses behind a scale follow from it.
    let scale = |bytes: &mut Bytes| -> Parsed<DVec3> {
        let scale = vector(bytes)?;
        bytes.each::<f64, 12>(Bytes::f64)?;
        Ok(scale)
    };
    Ok(match map {
        "UniformScaleMap" | "ScaleMap" => DMat4::from_scale(scale(bytes)?),
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let translation = vector(bytes)?;
            DMat4::from_translation(translation) * DMat4::from_scale(scale(bytes)?)
        }
        "TranslationMap" => DMat4::from_translation(vector(bytes)?),
        "AffineMap" | "UnitaryMap" => DMat4::from_cols_array(&bytes.each(Bytes::f64)?),
        _ => return Err(Fault::bad(start, format!("unknown transform {map:?}"))),
    })
}

fn usable(map: &str, matrix: DMat4) -> Transform {
    let bottom = matrix.row(3);
    if !matrix.is_finite() || bottom.to_array() != [0.0, 0.0, 0.0, 1.0] {
        return Transform::Refused(format!("{map}: not an affine matrix: {matrix}"));
    }
    if !matrix.inverse().is_finite() {
        return Transform::Refused(format!("{map}: the matrix has no inverse: {matrix}"));
    }
    Transform::Affine(matrix)
}
