//! The map of a grid from index to world space, as a matrix. Knows nothing of voxels.
//!
//! The file stores matrices for row vectors; the crate's are for column vectors. As glam stores
//! matrices by columns, the file's sixteen numbers are glam's columns in the same order.

use glam::{DMat4, DVec3};

use super::fault::{Fault, Parsed};
use super::metadata::put_text;
use super::source::Bytes;

/// A grid's transform from index to world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Transform {
    /// World position (column vector) from index position; the centre of voxel (i, j, k) is (i, j,
    /// k).
    Affine(DMat4),
    /// The map is not supported, for this reason; the voxels can still be read.
    Refused(String),
}

/// A transform and the name of its map in the file.
pub(super) struct NamedTransform {
    pub(super) map: String,
    pub(super) transform: Transform,
    /// Name and numbers as encoded in the file.
    pub(super) bytes: Vec<u8>,
}

impl Transform {
    /// The encoded name and numbers of the simplest map that equals `world_from_index`, chosen like
    /// OpenVDB does.
    pub(super) fn map_bytes(world_from_index: &DMat4) -> Vec<u8> {
        let columns = world_from_index.to_cols_array_2d();
        let scale = DVec3::new(columns[0][0], columns[1][1], columns[2][2]);
        let translation = world_from_index.w_axis.truncate();
        let rebuilt = DMat4::from_translation(translation) * DMat4::from_scale(scale);
        let (name, numbers) = if rebuilt == *world_from_index {
            let uniform = scale == DVec3::splat(scale.x);
            let (inverse, still) = (scale.recip(), translation == DVec3::ZERO);
            let mut parts = vec![scale, scale.abs(), inverse, inverse * inverse, inverse * 0.5];
            if !still {
                parts.insert(0, translation);
            }
            let name = match (uniform, still) {
                (true, true) => "UniformScaleMap",
                (true, false) => "UniformScaleTranslateMap",
                (false, true) => "ScaleMap",
                (false, false) => "ScaleTranslateMap",
            };
            (name, parts.into_iter().flat_map(|part| part.to_array()).collect())
        } else {
            ("AffineMap", world_from_index.to_cols_array().to_vec())
        };
        let mut bytes = Vec::new();
        put_text(&mut bytes, name);
        bytes.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
        bytes
    }
}

/// Reads the map's name and numbers.
pub(super) fn read(bytes: &mut Bytes) -> Parsed<NamedTransform> {
    let whole = bytes.rest();
    let before = bytes.taken();
    let (map, transform) = read_parts(bytes)?;
    let bytes = whole[..bytes.taken() - before].to_vec();
    Ok(NamedTransform { map, transform, bytes })
}

fn read_parts(bytes: &mut Bytes) -> Parsed<(String, Transform)> {
    let start = bytes.position();
    let map = bytes.string()?;
    if map == "NonlinearFrustumMap" {
        // Index box, taper and depth; then the affine map behind the frustum.
        bytes.each::<f64, 8>(Bytes::f64)?;
        let inner_start = bytes.position();
        let inner = bytes.string()?;
        affine(&inner, bytes, inner_start)?;
        let why = "a frustum (NonlinearFrustumMap) is not an affine transform".to_owned();
        return Ok((map, Transform::Refused(why)));
    }
    let matrix = affine(&map, bytes, start)?;
    let transform = usable(&map, matrix);
    Ok((map, transform))
}

fn affine(map: &str, bytes: &mut Bytes, start: u64) -> Parsed<DMat4> {
    let vector = |bytes: &mut Bytes| -> Parsed<DVec3> {
        bytes.each::<f64, 3>(Bytes::f64).map(DVec3::from_array)
    };
    // The voxel size and three inverses, which follow a scale in the file, are redundant.
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
