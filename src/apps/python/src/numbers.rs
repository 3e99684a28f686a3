//! NumPy's arrays as bytes in the library's order, and back.

use deepshadow::io::number::ValueType;
use numpy::{PyArray1, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::value;

/// NumPy's name of a little-endian number type.
pub fn name_of(value_type: ValueType) -> &'static str {
    match value_type {
        ValueType::U8 => "|u1",
        ValueType::I8 => "|i1",
        ValueType::U16 => "<u2",
        ValueType::I16 => "<i2",
        ValueType::U32 => "<u4",
        ValueType::I32 => "<i4",
        ValueType::U64 => "<u8",
        ValueType::I64 => "<i8",
        ValueType::F16 => "<f2",
        ValueType::F32 => "<f4",
        ValueType::F64 => "<f8",
    }
}

/// NumPy's name of booleans.
pub const BOOL: &str = "|b1";

/// An array of `shape` that owns `bytes`, as numbers of the type `name`.
pub fn array<'py>(
    py: Python<'py>,
    bytes: Vec<u8>,
    name: &str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let flat = PyArray1::from_vec(py, bytes);
    flat.call_method1("view", (name,))?.call_method1("reshape", (shape.to_vec(),))
}

/// The array for NumPy's protocol `__array__`: itself, if it need not be another one.
pub fn as_numpy<'py>(
    array: &Bound<'py, PyAny>,
    dtype: Option<&Bound<'py, PyAny>>,
    copy: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let how = PyDict::new(array.py());
    how.set_item("dtype", dtype)?;
    if let Some(copy) = copy {
        how.set_item("copy", copy)?;
    }
    array.py().import("numpy")?.call_method("asarray", (array,), Some(&how))
}

/// The array that `object` is, or becomes by NumPy's `asarray`.
///
/// # Errors
/// `ValueError` if it has no numbers.
pub fn as_array<'py>(what: &str, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let array = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    type_of(what, &array)?;
    Ok(array)
}

/// The number type of an array; `true` if its numbers are booleans.
///
/// # Errors
/// `ValueError` if its elements are no numbers that files have.
pub fn type_of(what: &str, array: &Bound<'_, PyAny>) -> PyResult<(ValueType, bool)> {
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    let size: usize = dtype.getattr("itemsize")?.extract()?;
    Ok(match (kind.as_str(), size) {
        ("b", 1) => (ValueType::U8, true),
        ("u", 1) => (ValueType::U8, false),
        ("i", 1) => (ValueType::I8, false),
        ("u", 2) => (ValueType::U16, false),
        ("i", 2) => (ValueType::I16, false),
        ("u", 4) => (ValueType::U32, false),
        ("i", 4) => (ValueType::I32, false),
        ("u", 8) => (ValueType::U64, false),
        ("i", 8) => (ValueType::I64, false),
        ("f", 2) => (ValueType::F16, false),
        ("f", 4) => (ValueType::F32, false),
        ("f", 8) => (ValueType::F64, false),
        _ => {
            let why = format!("numbers of type {dtype} are not those of any format");
            return Err(value(what, why));
        }
    })
}

/// The bytes of an array, little endian, the last axis fastest.
pub fn bytes_of(array: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    let py = array.py();
    let little = array.getattr("dtype")?.call_method1("newbyteorder", ("<",))?;
    let numpy = py.import("numpy")?;
    let plain = numpy.call_method1("ascontiguousarray", (array, little))?;
    let flat = plain.call_method1("reshape", (-1,))?.call_method1("view", ("u1",))?;
    Ok(flat.cast::<PyArray1<u8>>()?.readonly().as_slice()?.to_vec())
}

/// The shape of an array.
pub fn shape_of(array: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    Ok(array.cast::<PyUntypedArray>()?.shape().to_vec())
}

/// World positions or directions, and the shape without the last axis of an array (..., 3).
///
/// # Errors
/// `ValueError` if it has another shape, or no numbers.
pub fn rows(what: &str, object: &Bound<'_, PyAny>) -> PyResult<(Vec<[f64; 3]>, Vec<usize>)> {
    let array = as_array(what, object)?;
    let mut shape = shape_of(&array)?;
    if shape.pop() != Some(3) {
        let shape = shape_of(&array)?;
        return Err(value(what, format!("has shape {shape:?}, expected (..., 3)")));
    }
    let numbers = array.call_method1("astype", ("<f8",))?.call_method1("reshape", (-1,))?;
    let numbers = numbers.cast::<PyArray1<f64>>()?.to_vec()?;
    Ok((numbers.as_chunks().0.to_vec(), shape))
}
