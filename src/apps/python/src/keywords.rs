//! The tables of a scene file from keyword arguments and dictionaries, with the short forms written
//! out.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use serde_json::{Map, Value};

use crate::errors::value;
use crate::held::Held;
use crate::mesh::Mesh;
use crate::strands::Strands;
use crate::tables::{table_of, table_value};

/// Names of tables that may be given as keywords.
const TABLES: [&str; 10] = [
    "volume",
    "hair",
    "mesh",
    "light",
    "ambient",
    "camera",
    "image",
    "shadow",
    "ground",
    "background",
];

/// The tables of a scene file from keywords; `held` keeps what is in memory.
pub fn given_tables(keywords: &Bound<'_, PyDict>, held: &mut Held) -> PyResult<Map<String, Value>> {
    let py = keywords.py();
    let tables = PyDict::new(py);
    let table = |name: &str| -> PyResult<Bound<'_, PyDict>> {
        match tables.get_item(name)? {
            Some(table) => match table.cast_into() {
                Ok(table) => Ok(table),
                Err(_) => Err(value(name, "is a list; give its keys in it")),
            },
            None => {
                let table = PyDict::new(py);
                tables.set_item(name, &table)?;
                Ok(table)
            }
        }
    };
    // Whole tables first; what has a name of its own is laid over them.
    for (key, object) in keywords.iter() {
        let name: String = key.extract()?;
        if object.is_none() && name == "ground" {
            table("ground")?.set_item("enabled", false)?;
        } else if TABLES.contains(&name.as_str()) && !object.is_none() {
            tables.set_item(&name, in_full(&name, &object, held)?)?;
        }
    }
    for (key, object) in keywords.iter() {
        let name: String = key.extract()?;
        if object.is_none() || TABLES.contains(&name.as_str()) {
            continue;
        }
        match name.as_str() {
            "size" => {
                let square = object.extract::<u32>().map(|size| [size; 2]);
                let size: [u32; 2] = square.or_else(|_| object.extract()).map_err(|_| {
                    let why = format!("{object} is no number of pixels, and no (width, height)");
                    value("size", why)
                })?;
                let image = table("image")?;
                image.set_item("width", size[0])?;
                image.set_item("height", size[1])?;
            }
            "map" => table("shadow")?.set_item("map", object)?,
            "transfer" if object.is_instance_of::<PyString>() => {
                let transfer = PyDict::new(py);
                transfer.set_item("name", object)?;
                table("volume")?.set_item("transfer", transfer)?;
            }
            "transfer" => table("volume")?.set_item("transfer", object)?,
            _ => {
                let known = format!("{}, size, map, transfer, frame", TABLES.join(", "));
                return Err(value(&name, format!("is not one of {known}")));
            }
        }
    }
    table_of(&tables)
}

/// A table as scene files have it.
fn in_full<'py>(
    name: &str,
    object: &Bound<'py, PyAny>,
    held: &mut Held,
) -> PyResult<Bound<'py, PyAny>> {
    let py = object.py();
    let alone = |key: &str| {
        let table = PyDict::new(py);
        table.set_item(key, object)?;
        Ok(table.into_any())
    };
    let is_list = object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>();
    let is_vector = || object.extract::<[f64; 3]>().is_ok();
    match name {
        "light" if is_list && object.len()? == 0 => {
            let why =
                "is empty, which would be the usual light; for darkness give {'irradiance': 0}";
            return Err(value("light", why));
        }
        "light" if is_vector() => return alone("direction"),
        "light" if is_list => {
            let tables = PyList::empty(py);
            for one in object.try_iter()? {
                let one = one?;
                let is_vector = one.extract::<[f64; 3]>().is_ok();
                tables.append(if is_vector { in_full(name, &one, held)? } else { one })?;
            }
            return Ok(tables.into_any());
        }
        "camera" if is_vector() => return alone("position"),
        "ambient" | "background" if is_vector() => return alone("radiance"),
        "ground" if object.extract::<f64>().is_ok() => return alone("height"),
        "volume" | "hair" | "mesh" if object.is_instance_of::<PyList>() => {
            let tables = PyList::empty(py);
            for one in object.try_iter()? {
                tables.append(caster_table(name, &one?, held)?)?;
            }
            return Ok(tables.into_any());
        }
        "volume" | "hair" | "mesh" => return caster_table(name, object, held).map(Bound::into_any),
        _ => {}
    }
    if is_list || object.is_instance_of::<PyDict>() {
        return Ok(object.clone());
    }
    // For its message.
    table_value(name, object)?;
    Err(value(name, "must be a dictionary with the keys of scene files, or a list of such"))
}

/// The table of a volume, a mesh or hair: of a dictionary, whose key "array" becomes the name of what
/// is held, of a path, or of what is in memory.
fn caster_table<'py>(
    name: &str,
    object: &Bound<'py, PyAny>,
    held: &mut Held,
) -> PyResult<Bound<'py, PyDict>> {
    if let Ok(given) = object.cast::<PyDict>() {
        let table = given.copy()?;
        if let Some(array) = table.get_item("array")? {
            table.del_item("array")?;
            hold(name, &array, &table, held)?;
        }
        return Ok(table);
    }
    let table = PyDict::new(object.py());
    if object.is_instance_of::<PyString>() || object.hasattr("__fspath__")? {
        table.set_item("path", object)?;
    } else {
        hold(name, object, &table, held)?;
    }
    Ok(table)
}

/// Keeps what is in memory, and names it in its table.
pub fn hold(
    name: &str,
    object: &Bound<'_, PyAny>,
    table: &Bound<'_, PyDict>,
    held: &mut Held,
) -> PyResult<()> {
    let (path, up) = match name {
        "volume" => (held.volume(object)?, None),
        "mesh" => {
            let wrong = |_| value("mesh", "is neither a Mesh nor the name of a file");
            let mesh = object.cast::<Mesh>().map_err(wrong)?.get();
            (held.mesh(mesh), Some(mesh.up))
        }
        _ => {
            let wrong = |_| value(name, "is neither Strands nor the name of a file");
            let strands = object.cast::<Strands>().map_err(wrong)?.get();
            (held.strands(strands), Some(strands.up))
        }
    };
    table.set_item("path", path)?;
    if let Some(up) = up
        && !table.contains("up")?
    {
        table.set_item("up", up.name())?;
    }
    Ok(())
}
