//! Tables of a scene from Python's dictionaries.

use deepshadow::scene::SceneFile;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde_json::{Map, Number, Value};

use crate::errors::value;

/// Containers within containers; scene files have five.
const DEEPEST: usize = 16;

/// The value of a scene file that `object` is: a dictionary is a table; lists, tuples and arrays
/// are lists; paths are text.
///
/// # Errors
/// `ValueError` for anything else, with the name of its key.
pub fn table_value(key: &str, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    value_within(0, key, object)
}

/// The table that a dictionary is; keys whose value is None are left out.
pub fn table_of(dictionary: &Bound<'_, PyDict>) -> PyResult<Map<String, Value>> {
    table_within(0, "", dictionary)
}

/// Like [`table_value`], for what is within so many containers, one of which it may be itself.
fn value_within(depth: usize, key: &str, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(value("scene", "its tables are nested too deeply"));
    }
    if object.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Value::String(text.extract()?));
    }
    if object.is_instance_of::<PyBool>() {
        return Ok(Value::Bool(object.extract()?));
    }
    if object.is_instance_of::<PyInt>() {
        return Ok(Value::Number(object.extract::<i64>()?.into()));
    }
    if object.is_instance_of::<PyFloat>() {
        let number: f64 = object.extract()?;
        let finite = || value(key, format!("{number} is not finite"));
        return Number::from_f64(number).map(Value::Number).ok_or_else(finite);
    }
    if let Ok(table) = object.cast::<PyDict>() {
        return table_within(depth + 1, key, table).map(Value::Object);
    }
    if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let items = object.try_iter()?.map(|item| value_within(depth + 1, key, &item?));
        return items.collect::<PyResult<Vec<_>>>().map(Value::Array);
    }
    if object.hasattr("tolist")? {
        return value_within(depth + 1, key, &object.call_method0("tolist")?);
    }
    if object.hasattr("__fspath__")? {
        return value_within(depth + 1, key, &object.call_method0("__fspath__")?);
    }
    let kind = object.get_type().name()?;
    Err(value(key, format!("is a {kind}; scenes have numbers, text, lists and dictionaries")))
}

fn table_within(
    depth: usize,
    name: &str,
    dictionary: &Bound<'_, PyDict>,
) -> PyResult<Map<String, Value>> {
    let mut table = Map::new();
    for (key, object) in dictionary.iter() {
        let Ok(key) = key.extract::<String>() else {
            return Err(value(name, "keys must be text"));
        };
        let full = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
        let found = value_within(depth, &full, &object)?;
        if !found.is_null() {
            table.insert(key, found);
        }
    }
    Ok(table)
}

/// The scene file with other tables laid over it: their keys replace its own.
///
/// # Errors
/// `ValueError` about an unknown key, or a value that its key cannot have.
pub fn overlaid(file: &SceneFile, tables: Map<String, Value>) -> PyResult<SceneFile> {
    if tables.is_empty() {
        return Ok(file.clone());
    }
    let refused = |error: serde_json::Error| value("scene", error.to_string());
    let mut all = serde_json::to_value(file).map_err(refused)?;
    overlay(&mut all, Value::Object(tables));
    serde_path_to_error::deserialize(all).map_err(|error| {
        let key = error.path().to_string();
        let key = if key == "." { "scene" } else { &key };
        value(key, error.inner().to_string())
    })
}

fn overlay(under: &mut Value, over: Value) {
    match (under, over) {
        (Value::Object(under), Value::Object(over)) => {
            for (key, value) in over {
                overlay(under.entry(key).or_insert(Value::Null), value);
            }
        }
        (under, over) => *under = over,
    }
}
