//! Vectors and numbers of surfaces from NumPy's arrays, and back.

use deepshadow::glam::Vec3;
use deepshadow::surface::Varying;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::value;
use crate::numbers::{as_array, shape_of};

/// The albedo of what says none: light grey.
const ALBEDO: f32 = 0.7;

/// Vectors, and the shape without the last axis of an array (..., 3).
pub fn vectors(what: &str, object: &Bound<'_, PyAny>) -> PyResult<(Vec<Vec3>, Vec<usize>)> {
    let (numbers, mut shape) = floats(what, object)?;
    if shape.len() < 2 || shape.pop() != Some(3) {
        return Err(value(what, format!("has shape {:?}, expected (n, 3)", shape_of_any(object)?)));
    }
    Ok((numbers.as_chunks().0.iter().map(|&xyz| Vec3::from(xyz)).collect(), shape))
}

fn floats(what: &str, object: &Bound<'_, PyAny>) -> PyResult<(Vec<f32>, Vec<usize>)> {
    let array = as_array(what, object)?;
    let flat = array.call_method1("astype", ("<f4",))?.call_method1("reshape", (-1,))?;
    Ok((flat.cast::<PyArray1<f32>>()?.to_vec()?, shape_of(&array)?))
}

/// The shape of what NumPy makes an array.
pub fn shape_of_any(object: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    shape_of(&as_array("", object)?)
}

/// Whole numbers of at least 0, as a flat list.
pub fn integers(what: &str, object: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let array = as_array(what, object)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "i" | "u") {
        return Err(value(what, "must be whole numbers"));
    }
    let wide = array.call_method1("astype", ("<i8",))?.call_method1("reshape", (-1,))?;
    let wide = wide.cast::<PyArray1<i64>>()?.to_vec()?;
    let wrong = |number: i64| value(what, format!("{number} is not a number of 32 bits"));
    wide.into_iter().map(|number| u32::try_from(number).map_err(|_| wrong(number))).collect()
}

/// A number for everything, or one for each of `count`.
pub fn numbers(
    what: &str,
    object: Option<&Bound<'_, PyAny>>,
    usual: f32,
    count: usize,
) -> PyResult<Varying<f32>> {
    let Some(object) = object else { return Ok(Varying::Same(usual)) };
    let (numbers, shape) = floats(what, object)?;
    match shape[..] {
        [] if numbers[0].is_nan() => Err(value(what, "is no number")),
        [] => Ok(Varying::Same(numbers[0])),
        [own] if own == count => Ok(Varying::PerPoint(numbers)),
        _ => Err(value(what, format!("has shape {shape:?}, expected a number or ({count},)"))),
    }
}

/// A colour for everything, or one for each of `count`.
pub fn colors(
    what: &str,
    object: Option<&Bound<'_, PyAny>>,
    count: usize,
) -> PyResult<Varying<Vec3>> {
    let Some(object) = object else { return Ok(Varying::Same(Vec3::splat(ALBEDO))) };
    let (numbers, shape) = floats(what, object)?;
    if !numbers.iter().all(|x| (0.0..=1.0).contains(x)) {
        return Err(value(what, "is not in 0..1"));
    }
    let vectors = || numbers.as_chunks().0.iter().map(|&rgb| Vec3::from(rgb));
    match shape[..] {
        [] => Ok(Varying::Same(Vec3::splat(numbers[0]))),
        [3] => Ok(Varying::Same(vectors().sum())),
        [own, 3] if own == count => Ok(Varying::PerPoint(vectors().collect())),
        _ => {
            let why = format!("has shape {shape:?}, expected a number, (3,) or ({count}, 3)");
            Err(value(what, why))
        }
    }
}

/// Vectors as float32 of shape (n, 3), or of another shape (..., 3).
pub fn array_of<'py>(
    py: Python<'py>,
    vectors: &[Vec3],
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let flat: Vec<f32> = vectors.iter().flat_map(Vec3::to_array).collect();
    let mut shape = if shape.is_empty() { vec![vectors.len()] } else { shape.to_vec() };
    shape.push(3);
    PyArray1::from_vec(py, flat).call_method1("reshape", (shape,))
}

/// A number, or float32 of shape (n,).
pub fn varying<'py>(py: Python<'py>, values: &Varying<f32>) -> PyResult<Bound<'py, PyAny>> {
    Ok(match values {
        Varying::Same(value) => f64::from(*value).into_pyobject(py)?.into_any(),
        Varying::PerPoint(values) => PyArray1::from_slice(py, values).into_any(),
    })
}
