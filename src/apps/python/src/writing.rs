//! Writing of volumes, dense and sparse.

use std::path::{Path, PathBuf};

use deepshadow::Result;
use deepshadow::glam::IVec3;
use deepshadow::io::dense::{DEFAULT_MAX_BYTES, DenseGrid, DenseTarget};
use deepshadow::io::number::ValueType;
use deepshadow::io::vdb::{
    Compression, Grid, MetaValue, Metadata, NewGrid, TreeBuilder, VdbWriter,
};
use deepshadow::io::{Inputs, PendingFile};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyString, PyTuple};

use crate::errors::{raised, value};
use crate::mesh::Mesh;
use crate::metadata::meta_value;
use crate::sparse::{SparseGrid, dense};
use crate::strands::Strands;
use crate::surfaces::write_surface;
use crate::volume::{Volume, volume_of};
use crate::work::done;

/// The name in OpenVDB files of a grid without a name, which programs look for.
const DENSITY: &str = "density";

/// Writes a volume to `path`, in the format that the ending of its name tells: .vdb, .npy, .nrrd,
/// .nhdr, .mha, .mhd or .raw. Files appear whole or not at all.
///
/// Parameters
/// ----------
/// path : path-like
/// volume : Volume, SparseGrid, array_like, a list of them, Mesh, or Strands
///     What is written; a .vdb may hold several grids. Sparse grids are written to .vdb as they
///     are, without ever being dense. Meshes are written to .glb, where y points up, and strands
///     to .hair, where z does: they are turned if another axis does.
/// compression : str, optional
///     "blosc" (the default), "zip", "mask" or "none" for .vdb; "gzip" for .nrrd, "zlib" for .mha.
/// half : bool
///     Whether floats are stored as half floats in a .vdb; as they were by default.
/// name, spacing, origin, world_from_index, index, active, background, grid_class, metadata :
///     Of an array: as of `Volume`.
///
/// Returns
/// -------
/// list of str
///     What the format cannot store, one line each; empty if nothing is lost.
#[pyfunction]
#[pyo3(signature = (path, volume, *, compression = None, half = None, **place))]
pub fn write(
    py: Python<'_>,
    path: PathBuf,
    volume: &Bound<'_, PyAny>,
    compression: Option<&str>,
    half: Option<bool>,
    place: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<String>> {
    if volume.is_instance_of::<Mesh>() || volume.is_instance_of::<Strands>() {
        if compression.is_some() || half.is_some() || place.is_some() {
            let why = "how volumes are written does not apply to meshes and strands";
            return Err(value("compression, half, or a place", why));
        }
        write_surface(py, &path, volume)?;
        return Ok(Vec::new());
    }
    let several = volume.is_instance_of::<PyList>() || volume.is_instance_of::<PyTuple>();
    let items = match several && !is_array_like(volume) {
        true => volume.try_iter()?.collect::<PyResult<Vec<_>>>()?,
        false => vec![volume.clone()],
    };
    if items.is_empty() {
        return Err(value("volume", "there is nothing to write"));
    }
    let grids = items.into_iter().map(|item| written(item, place));
    let grids = grids.collect::<PyResult<Vec<_>>>()?;
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("vdb")) {
        let compression = vdb_compression(compression)?;
        return write_vdb(py, &path, grids, compression, half);
    }
    let Some(format) = DenseTarget::of_path(&path) else {
        let endings = ".vdb, .npy, .nrrd, .nhdr, .mha, .mhd, .raw";
        let why = format!("the ending of '{}' is not one of {endings}", path.display());
        return Err(value("path", why));
    };
    if half.is_some() {
        return Err(value("half", "applies to .vdb alone; give the array its type"));
    }
    let packed = match (compression, format.compression()) {
        (None | Some("none"), _) => false,
        (Some(name), Some(own)) if name == own => true,
        (Some(name), own) => {
            let known = own.map_or_else(String::new, |own| format!("{own}, "));
            return Err(value("compression", format!("'{name}' is not one of {known}none")));
        }
    };
    let volume = match &grids[..] {
        [Item::Dense(volume)] => volume.clone(),
        [Item::Sparse(sparse)] => {
            Bound::new(py, dense(py, sparse.get(), None, DEFAULT_MAX_BYTES)?)?
        }
        _ => return Err(value("volume", "a file of this format holds one grid")),
    };
    let (mut grid, _) = volume.get().to_grid(py)?;
    grid.metadata = volume.get().metadata_texts(py)?;
    let mut lost = unplaced(py, volume.get(), format, &grid)?;
    let written =
        done(py, None, |_| format.promise(&path, packed, &Inputs::default())?.write(grid))?;
    lost.extend(written.lost);
    Ok(lost)
}

/// What a format has no place for, of what Python knows of a grid.
fn unplaced(
    py: Python<'_>,
    volume: &Volume,
    format: DenseTarget,
    grid: &DenseGrid,
) -> PyResult<Vec<String>> {
    let mut lost = Vec::new();
    let has_sidecar = matches!(format, DenseTarget::Npy | DenseTarget::Raw);
    if grid.origin != IVec3::ZERO && !has_sidecar {
        lost.push(format!(
            "the first voxel's index {:?} (its place is kept)",
            grid.origin.to_array()
        ));
    }
    let metadata = volume.metadata.bind(py).iter();
    let other = metadata.filter(|(_, value)| !value.is_instance_of::<PyString>());
    let keys = other.map(|(key, _)| key.extract()).collect::<PyResult<Vec<String>>>()?;
    // Others say that they lose all of it.
    if matches!(format, DenseTarget::Nrrd { .. }) && !keys.is_empty() {
        lost.push(format!("the types of metadata {} (stored as text)", keys.join(", ")));
    }
    Ok(lost)
}

enum Item<'py> {
    Dense(Bound<'py, Volume>),
    Sparse(Bound<'py, SparseGrid>),
}

/// Whether a list is one of numbers instead of grids.
fn is_array_like(list: &Bound<'_, PyAny>) -> bool {
    let first = list.get_item(0).ok();
    first.is_some_and(|first| first.is_instance_of::<PyList>() || first.is_instance_of::<PyTuple>())
}

fn written<'py>(
    item: Bound<'py, PyAny>,
    place: Option<&Bound<'py, PyDict>>,
) -> PyResult<Item<'py>> {
    let placed = place.is_some_and(|place| !place.is_empty());
    if let Ok(sparse) = item.cast::<SparseGrid>()
        && !placed
    {
        return Ok(Item::Sparse(sparse.clone()));
    }
    if !placed {
        return volume_of(&item).map(Item::Dense);
    }
    if item.is_instance_of::<Volume>() || item.is_instance_of::<SparseGrid>() {
        return Err(value("volume", "has its own place and name; they are given for arrays alone"));
    }
    let volume = item.py().get_type::<Volume>().call((item,), place)?;
    Ok(Item::Dense(volume.cast_into()?))
}

fn vdb_compression(name: Option<&str>) -> PyResult<Compression> {
    Ok(match name {
        None | Some("blosc") => Compression::BLOSC,
        Some("zip") => Compression::ZIP,
        Some("mask") => Compression::ACTIVE_MASK,
        Some("none") => Compression::NONE,
        Some(name) => {
            let why = format!("'{name}' is not one of blosc, zip, mask, none");
            return Err(value("compression", why));
        }
    })
}

fn write_vdb(
    py: Python<'_>,
    path: &Path,
    items: Vec<Item<'_>>,
    compression: Compression,
    half: Option<bool>,
) -> PyResult<Vec<String>> {
    let file = PendingFile::create(path, &Inputs::default()).map_err(raised)?;
    let name_of = |item: &Item<'_>| match item {
        Item::Sparse(sparse) => sparse.get().header.name.clone(),
        Item::Dense(volume) => match volume.get().grid_name() {
            "" => DENSITY.to_owned(),
            name => name.to_owned(),
        },
    };
    let names: Vec<String> = items.iter().map(name_of).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut writer = VdbWriter::new(&names, compression, &Metadata::default());
    let mut lost = Vec::new();
    for item in items {
        let new = match item {
            Item::Sparse(sparse) => {
                let sparse = sparse.get();
                let mut new = NewGrid::like(&sparse.header, Grid::clone(&sparse.grid));
                if let Some(half) = half {
                    new = new.with_half(half);
                }
                new
            }
            Item::Dense(volume) => new_grid(py, &volume, half, &mut lost)?,
        };
        done(py, None, |_| writer.add(new))?;
    }
    done(py, None, |_| file.finish_with(&writer.finish()?))?;
    Ok(lost)
}

fn new_grid(
    py: Python<'_>,
    volume: &Bound<'_, Volume>,
    half: Option<bool>,
    lost: &mut Vec<String>,
) -> PyResult<NewGrid> {
    let (grid, is_bool) = volume.get().to_grid(py)?;
    let known = grid.without_bytes();
    let (from, to) = (grid.value_type, grid.vdb_type());
    if from != to && from != ValueType::F16 && !is_bool {
        lost.push(format!("{} numbers (stored as {}, which holds them)", from.name(), to.name()));
    }
    let is_half = half.unwrap_or(known.value_type == ValueType::F16);
    let tree = done(py, None, |_| if is_bool { booleans(&grid) } else { grid.into_vdb() })?;
    let mut new = NewGrid::new(tree, &known.world_from_index).with_half(is_half);
    for (key, value) in volume.get().metadata.bind(py).iter() {
        let key: String = key.extract()?;
        if value.is_instance_of::<PyBytes>() {
            lost.push(format!("metadata '{key}', whose type is not known"));
            continue;
        }
        let value = meta_value(&key, &value)?;
        new.metadata().set(&key, value);
    }
    if let Some(class) = &known.class {
        new = new.with_class(class);
    }
    if let Some(space) = known.space {
        new.metadata().set("space", MetaValue::String(space.name().to_owned()));
    }
    Ok(new)
}

/// The tree of a grid of booleans.
fn booleans(grid: &DenseGrid) -> Result<Grid> {
    let low = grid.bounds()?.min;
    let background = grid.background.as_ref().is_some_and(|values| values.contains(&1.0));
    let mut builder = TreeBuilder::new(background);
    let [nx, ny, nz] = grid.dims.map(|n| n as i32);
    let mut at = 0;
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let on = grid.bytes[at] != 0;
                let active = match &grid.active {
                    Some(active) => active[at],
                    None => grid.background.is_none() || on != background,
                };
                if active || on != background {
                    let index = low + IVec3::new(x, y, z);
                    builder.set(index, on, active);
                }
                at += 1;
            }
        }
    }
    Ok(Grid::Bool(builder.finish()))
}
