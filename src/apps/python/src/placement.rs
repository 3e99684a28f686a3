//! Where voxels are: transforms as arrays, and from spacing and origin.

use deepshadow::glam::{DMat4, DVec3, DVec4, IVec3};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::value;
use crate::numbers::{as_array, shape_of};

/// The place of voxels of `spacing` whose first one is at `origin` and has this `index`.
pub fn place(
    spacing: Option<&Bound<'_, PyAny>>,
    origin: Option<[f64; 3]>,
    index: [i32; 3],
) -> PyResult<DMat4> {
    let spacing: [f64; 3] = match spacing {
        None => [1.0; 3],
        Some(one) => one.extract::<f64>().map(|one| [one; 3]).or_else(|_| one.extract())?,
    };
    if !spacing.iter().all(|&edge| edge > 0.0 && edge.is_finite()) {
        return Err(value("spacing", format!("{spacing:?} is not above 0 on every axis")));
    }
    if origin.is_some_and(|origin| origin.iter().any(|x| !x.is_finite())) {
        return Err(value("origin", "is not finite"));
    }
    let scaled = DMat4::from_scale(spacing.into());
    // The origin is that of the first voxel, whatever its index.
    let first = scaled.transform_point3(IVec3::from_array(index).as_dvec3());
    let moved = origin.map_or(DVec3::ZERO, |origin| DVec3::from(origin) - first);
    Ok(DMat4::from_translation(moved) * scaled)
}

/// A matrix for column vectors from an array of rows.
pub fn matrix_of(object: &Bound<'_, PyAny>) -> PyResult<DMat4> {
    let array = as_array("world_from_index", object)?;
    let shape = shape_of(&array)?;
    if shape != [4, 4] {
        let why = format!("has shape {shape:?}, expected (4, 4)");
        return Err(value("world_from_index", why));
    }
    let rows = array.call_method1("astype", ("<f8",))?.call_method1("reshape", (-1,))?;
    let numbers = rows.cast::<PyArray1<f64>>()?.to_vec()?;
    let mut all = [0.0; 16];
    all.copy_from_slice(&numbers);
    let matrix = DMat4::from_cols_array(&all).transpose();
    if matrix.row(3) != DVec4::W {
        let why = "is not affine: its last row must be 0, 0, 0, 1";
        return Err(value("world_from_index", why));
    }
    let determinant = matrix.determinant();
    if !matrix.is_finite() || !determinant.is_normal() {
        let why = format!("has no inverse (determinant {determinant})");
        return Err(value("world_from_index", why));
    }
    Ok(matrix)
}

/// A matrix for column vectors as an array of rows.
pub fn matrix_array<'py>(py: Python<'py>, matrix: &DMat4) -> PyResult<Bound<'py, PyAny>> {
    let rows = matrix.transpose().to_cols_array().to_vec();
    PyArray1::from_vec(py, rows).call_method1("reshape", (4, 4))
}
