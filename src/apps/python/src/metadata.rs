//! Metadata of files as Python's values, and back.

use deepshadow::io::vdb::{MetaValue, Metadata};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};

use crate::errors::value;

/// A dictionary of an OpenVDB file's or grid's metadata: booleans, numbers, text, and tuples of
/// numbers; bytes for what cannot be interpreted.
pub fn dictionary<'py>(py: Python<'py>, metadata: &Metadata) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    for (key, value) in metadata.iter() {
        dictionary.set_item(key, object(py, value)?)?;
    }
    Ok(dictionary)
}

fn object(py: Python<'_>, value: &MetaValue) -> PyResult<Py<PyAny>> {
    use MetaValue::{
        Bool, Double, Float, Int32, Int64, Mat4d, Mat4s, Other, Vec2d, Vec2i, Vec2s, Vec3d, Vec3i,
        Vec3s, Vec4d, Vec4i, Vec4s,
    };
    match value {
        Bool(value) => value.into_py_any(py),
        Int32(value) => value.into_py_any(py),
        Int64(value) => value.into_py_any(py),
        Float(value) => value.into_py_any(py),
        Double(value) => value.into_py_any(py),
        MetaValue::String(text) => text.into_py_any(py),
        Vec2i(values) => tuple(py, values),
        Vec2s(values) => tuple(py, values),
        Vec2d(values) => tuple(py, values),
        Vec3i(values) => tuple(py, values),
        Vec3s(values) => tuple(py, values),
        Vec3d(values) => tuple(py, values),
        Vec4i(values) => tuple(py, values),
        Vec4s(values) => tuple(py, values),
        Vec4d(values) => tuple(py, values),
        Mat4s(values) => tuple(py, values),
        Mat4d(values) => tuple(py, values),
        Other { bytes, .. } => pyo3::types::PyBytes::new(py, bytes).into_py_any(py),
        other => other.to_string().into_py_any(py),
    }
}

fn tuple<'py, T: Copy + IntoPyObject<'py>>(py: Python<'py>, values: &[T]) -> PyResult<Py<PyAny>> {
    pyo3::types::PyTuple::new(py, values.iter().copied())?.into_py_any(py)
}

/// A value for an OpenVDB file: a boolean, an integer, a float, text, or 2, 3, 4 or 16 numbers.
///
/// # Errors
/// `ValueError` for anything else.
pub fn meta_value(key: &str, object: &Bound<'_, PyAny>) -> PyResult<MetaValue> {
    if object.is_instance_of::<PyBool>() {
        return Ok(MetaValue::Bool(object.extract()?));
    }
    if object.is_instance_of::<PyInt>() {
        return Ok(match object.extract::<i32>() {
            Ok(small) => MetaValue::Int32(small),
            Err(_) => MetaValue::Int64(object.extract()?),
        });
    }
    if object.is_instance_of::<PyFloat>() {
        return Ok(MetaValue::Double(object.extract()?));
    }
    if object.is_instance_of::<PyString>() {
        return Ok(MetaValue::String(object.extract()?));
    }
    // NumPy's numbers say what they are as Python's.
    if object.hasattr("dtype")? && object.getattr("ndim")?.extract::<usize>()? == 0 {
        return meta_value(key, &object.call_method0("item")?);
    }
    let numbers: Vec<f64> = object.extract().unwrap_or_default();
    let integers: Option<Vec<i32>> = object.extract().ok();
    Ok(match (numbers.as_slice(), integers.as_deref()) {
        (_, Some(&[x, y])) => MetaValue::Vec2i([x, y]),
        (_, Some(&[x, y, z])) => MetaValue::Vec3i([x, y, z]),
        (_, Some(&[x, y, z, w])) => MetaValue::Vec4i([x, y, z, w]),
        (&[x, y], _) => MetaValue::Vec2d([x, y]),
        (&[x, y, z], _) => MetaValue::Vec3d([x, y, z]),
        (&[x, y, z, w], _) => MetaValue::Vec4d([x, y, z, w]),
        (matrix, _) if matrix.len() == 16 => {
            let mut all = [0.0; 16];
            all.copy_from_slice(matrix);
            MetaValue::Mat4d(all)
        }
        _ => {
            let kind = object.get_type().name()?;
            let why =
                format!("'{key}' is a {kind}; files hold numbers, text, and 2, 3, 4 or 16 numbers");
            return Err(value("metadata", why));
        }
    })
}
