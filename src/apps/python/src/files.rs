//! Files of volumes: what is in them, and reading.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deepshadow::io::dense::{DEFAULT_MAX_BYTES, DenseFile, DenseGrid};
use deepshadow::io::number::{Endian, ValueType};
use deepshadow::io::vdb::{Transform, VdbFile};
use deepshadow::io::{Format, ReadOptions, fog};
use deepshadow::{Error, Result};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::raised;
use crate::metadata::dictionary;
use crate::sparse::{SparseGrid, dense};
use crate::volume::Volume;
use crate::work::done;

/// Opens the volume file `path` and reads what it says about its grids, without their voxels.
///
/// Parameters
/// ----------
/// path : path-like
/// dims, type, endian, spacing :
///     Of a raw file: voxel counts along x, y, z, the numbers' type ("u8", "f32"), "little" or
///     "big", and world lengths of a voxel.
/// max_bytes : int
///     Largest number of bytes for the voxels of one grid; 4 GiB by default.
///
/// Raises
/// ------
/// OSError
///     If the file cannot be read.
/// ValueError
///     If it is of no known format, or broken.
#[pyfunction]
#[pyo3(signature = (
    path, *, dims = None, r#type = None, endian = None, spacing = None,
    max_bytes = DEFAULT_MAX_BYTES,
))]
pub fn open(
    py: Python<'_>,
    path: PathBuf,
    dims: Option<[usize; 3]>,
    r#type: Option<&str>,
    endian: Option<&str>,
    spacing: Option<[f64; 3]>,
    max_bytes: u64,
) -> PyResult<VolumeFile> {
    let value_type: Option<ValueType> = r#type.map(str::parse).transpose().map_err(raised)?;
    let endian: Option<Endian> = endian.map(str::parse).transpose().map_err(raised)?;
    let options = ReadOptions::default().with(|options| {
        options.dims = dims;
        options.value_type = value_type;
        options.endian = endian;
        options.spacing = spacing;
        options.max_bytes = max_bytes;
    });
    done(py, None, |_| VolumeFile::open(path, options))
}

/// Reads one grid of the volume file `path`, its voxels in their own type.
///
/// Parameters
/// ----------
/// path : path-like
/// grid : str, optional
///     The grid's name, in files with several; "density" or else the first of numbers by default.
/// **how :
///     As of `open`.
///
/// Returns
/// -------
/// Volume
///
/// Raises
/// ------
/// OSError, ValueError
///     As `open`.
/// MemoryError
///     If the voxels take more than `max_bytes`.
#[pyfunction]
#[pyo3(signature = (
    path, grid = None, *, dims = None, r#type = None, endian = None, spacing = None,
    max_bytes = DEFAULT_MAX_BYTES,
))]
#[allow(clippy::too_many_arguments)]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    grid: Option<&str>,
    dims: Option<[usize; 3]>,
    r#type: Option<&str>,
    endian: Option<&str>,
    spacing: Option<[f64; 3]>,
    max_bytes: u64,
) -> PyResult<Volume> {
    open(py, path, dims, r#type, endian, spacing, max_bytes)?.read(py, grid)
}

/// A volume file whose headers have been read. Voxels are read on request.
#[pyclass(module = "deepshadow", frozen)]
pub struct VolumeFile {
    path: PathBuf,
    format: Format,
    options: ReadOptions,
    vdb: Option<VdbFile>,
    dense: Option<DenseFile>,
}

/// What a file says about one of its grids.
#[pyclass(module = "deepshadow", frozen, get_all)]
pub struct GridInfo {
    /// The grid's name; may be empty.
    name: String,
    /// The type of its values, such as "float" or "u8".
    r#type: String,
    /// Voxel counts along x, y, z; None for a sparse grid, whose extent is not known yet.
    dims: Option<(usize, usize, usize)>,
    /// OpenVDB's class, such as "level set"; None if nobody says.
    grid_class: Option<String>,
    /// Why its voxels cannot be read; None if they can.
    refused: Option<String>,
    /// All that the file says besides.
    metadata: Py<PyDict>,
}

#[pymethods]
impl GridInfo {
    fn __repr__(&self) -> String {
        let dims = self
            .dims
            .map_or_else(|| "sparse".to_owned(), |(x, y, z)| format!("shape ({z}, {y}, {x})"));
        format!("<GridInfo '{}': {dims} of {}>", self.name, self.r#type)
    }
}

#[pymethods]
impl VolumeFile {
    /// The file's path, as it was given.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// The file's format, such as "openvdb" or "nrrd".
    #[getter]
    fn format(&self) -> &'static str {
        self.format.name()
    }

    /// What the file says about each of its grids, without their voxels.
    #[getter]
    fn grids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let mut grids = Vec::new();
        for header in self.vdb.iter().flat_map(VdbFile::grids) {
            grids.push(GridInfo {
                name: header.name.clone(),
                r#type: header.value_type.name().to_owned(),
                dims: None,
                grid_class: Some(header.class().to_owned()),
                refused: header.refused.clone(),
                metadata: dictionary(py, &header.metadata)?.unbind(),
            });
        }
        if let Some(file) = &self.dense {
            let header = file.header();
            grids.push(GridInfo {
                name: file.name(),
                r#type: header.value_type.name().to_owned(),
                dims: Some(header.dims.into()),
                grid_class: header.class.clone(),
                refused: None,
                metadata: texts(py, &header.metadata)?.unbind(),
            });
        }
        PyList::new(py, grids)
    }

    /// The metadata of the whole file.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        match &self.vdb {
            Some(file) => dictionary(py, file.metadata()),
            None => Ok(PyDict::new(py)),
        }
    }

    /// Reads a grid, dense, its voxels in their own type: the one called `grid`, by default
    /// "density" or else the first of numbers.
    #[pyo3(signature = (grid = None))]
    pub fn read(&self, py: Python<'_>, grid: Option<&str>) -> PyResult<Volume> {
        if self.vdb.is_some() {
            return dense(py, &self.sparse(py, grid)?, None, self.options.max_bytes);
        }
        if let (Some(name), Some(own)) = (grid, self.dense.as_ref().map(DenseFile::name))
            && self.format != Format::NanoVdb
            && name != own
        {
            let why = format!("no grid '{name}'; its only one is called '{own}'");
            return Err(raised(Error::contents(&self.path, why)));
        }
        let options = self.options.with(|options| options.grid = grid.map(str::to_owned));
        let mut grid = done(py, None, |_| match (&self.dense, grid) {
            (Some(file), None) => DenseGrid::read(file),
            _ => DenseGrid::read(&DenseFile::open(&self.path, self.format, &options)?),
        })?;
        let metadata = texts(py, &std::mem::take(&mut grid.metadata))?;
        Volume::of_grid(py, grid, false, metadata)
    }

    /// Reads a grid of an OpenVDB file as a tree, whatever its extent.
    #[pyo3(signature = (grid = None))]
    fn sparse(&self, py: Python<'_>, grid: Option<&str>) -> PyResult<SparseGrid> {
        let Some(file) = &self.vdb else {
            let why = format!("{} has no sparse grids", self.format.name());
            return Err(raised(Error::contents(&self.path, why)));
        };
        done(py, None, |_| {
            let index = fog::chosen(file, grid)?;
            let header = file.grids()[index].clone();
            let world_from_index = match &header.transform {
                Transform::Affine(matrix) => *matrix,
                Transform::Refused(why) => {
                    let why = format!("grid '{}': {why}", header.name);
                    return Err(Error::contents(file.path(), why));
                }
            };
            let grid = Arc::new(file.load(index)?);
            Ok(SparseGrid { grid, header, world_from_index })
        })
    }

    /// The grids' names, in the order of the file. The third of several grids of one name is
    /// ``file["name[2]"]``.
    fn keys(&self) -> Vec<String> {
        let sparse = self.vdb.iter().flat_map(VdbFile::grids).map(|grid| grid.name.clone());
        sparse.chain(self.dense.iter().map(DenseFile::name)).collect()
    }

    fn __len__(&self) -> usize {
        self.keys().len()
    }

    fn __contains__(&self, grid: &str) -> bool {
        self.keys().iter().any(|name| name == grid)
            || self.vdb.as_ref().is_some_and(|file| file.find(grid).is_some())
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(PyList::new(py, self.keys())?.try_iter()?.into_any().unbind())
    }

    fn __getitem__(&self, py: Python<'_>, grid: &str) -> PyResult<Volume> {
        if self.format != Format::NanoVdb && !self.__contains__(grid) {
            let names = self.keys().join(", ");
            return Err(PyKeyError::new_err(format!("no grid '{grid}'; there are {names}")));
        }
        self.read(py, Some(grid))
    }

    fn __repr__(&self) -> String {
        let count = self.vdb.as_ref().map_or(1, |file| file.grids().len());
        let grids = if count == 1 { "grid" } else { "grids" };
        format!("<VolumeFile {}: {}, {count} {grids}>", self.path.display(), self.format.name())
    }
}

impl VolumeFile {
    fn open(path: PathBuf, options: ReadOptions) -> Result<Self> {
        let format = options.format_of(&path)?;
        options.check(&path, format)?;
        let (vdb, dense) = match format {
            Format::OpenVdb => (Some(VdbFile::open(&path)?), None),
            _ => (None, Some(DenseFile::open(&path, format, &options)?)),
        };
        Ok(Self { path, format, options, vdb, dense })
    }
}

fn texts<'py>(py: Python<'py>, pairs: &[(String, String)]) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    for (key, value) in pairs {
        dictionary.set_item(key, value)?;
    }
    Ok(dictionary)
}
