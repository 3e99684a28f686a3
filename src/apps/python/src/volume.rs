//! Voxels as an array, with their place and all else that files say about them.

use deepshadow::glam::IVec3;
use deepshadow::io::dense::{DEFAULT_MAX_BYTES, DenseGrid};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::errors::value;
use crate::files::VolumeFile;
use crate::metadata::meta_value;
use crate::numbers::{self, BOOL, as_array, bytes_of, shape_of, type_of};
use crate::placement::{matrix_array, matrix_of, place};
use crate::sparse::{SparseGrid, dense};

/// What OpenVDB's grids can be.
const CLASSES: [&str; 4] = ["level set", "fog volume", "staggered", "unknown"];

/// Voxels on a regular grid, and the grid's place in the world.
///
/// Parameters
/// ----------
/// array : array_like, shape (z, y, x) or (z, y, x, components)
///     The values. NumPy arrays are kept as they are, without a copy.
/// name : str
///     The grid's name.
/// spacing : float or (x, y, z)
///     World lengths of a voxel's edges, above 0; 1 by default.
/// origin : (x, y, z)
///     World position of the first voxel's centre; 0 by default.
/// world_from_index : array_like, shape (4, 4)
///     Transform from index (x, y, z) to world position, for column vectors, instead of `spacing`
///     and `origin`.
/// index : (i, j, k)
///     Index of the first voxel, along x, y, z; 0 by default.
/// active : array_like of bool, shape (z, y, x), optional
///     Which voxels are active; all, or those that differ from `background` if that is given.
/// background : float or sequence, optional
///     The value outside of the array.
/// grid_class : str, optional
///     "level set", "fog volume", "staggered" or "unknown".
/// metadata : dict, optional
///     Further values that files keep.
#[pyclass(module = "deepshadow", frozen)]
pub struct Volume {
    /// The values, shape (z, y, x) or (z, y, x, components).
    #[pyo3(get)]
    pub array: Py<PyAny>,
    /// Which voxels are active, shape (z, y, x); None if all are, or if nothing is known.
    #[pyo3(get)]
    active: Option<Py<PyAny>>,
    /// Further values that the file has.
    #[pyo3(get)]
    pub metadata: Py<PyDict>,
    /// All else.
    known: DenseGrid,
    /// Whether all voxels are active, even those that have the background's value.
    all_active: bool,
}

#[pymethods]
impl Volume {
    #[new]
    #[pyo3(signature = (
        array, *, name = "", spacing = None, origin = None, world_from_index = None,
        index = [0; 3], active = None, background = None, grid_class = None, metadata = None,
    ))]
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        array: &Bound<'_, PyAny>,
        name: &str,
        spacing: Option<&Bound<'_, PyAny>>,
        origin: Option<[f64; 3]>,
        world_from_index: Option<&Bound<'_, PyAny>>,
        index: [i32; 3],
        active: Option<&Bound<'_, PyAny>>,
        background: Option<&Bound<'_, PyAny>>,
        grid_class: Option<String>,
        metadata: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = array.py();
        let array = as_array("array", array)?;
        let shape = shape_of(&array)?;
        let (dims, components) = match shape[..] {
            [z, y, x] => ([x, y, z], 1),
            [z, y, x, components] => ([x, y, z], components),
            _ => {
                let why = format!("has shape {shape:?}, expected (z, y, x) or (z, y, x, numbers)");
                return Err(value("array", why));
            }
        };
        if dims.contains(&0) || components == 0 {
            return Err(value("array", format!("has shape {shape:?}, which is empty")));
        }
        let active = active.map(|active| as_array("active", active)).transpose()?;
        if let Some(active) = &active
            && (shape_of(active)? != shape[..3] || !type_of("active", active)?.1)
        {
            let shape = &shape[..3];
            return Err(value("active", format!("must be booleans of shape {shape:?}")));
        }
        let background = match background {
            None => None,
            Some(one) => Some(one.extract().or_else(|_| Ok::<_, PyErr>(vec![one.extract()?]))?),
        };
        if background.as_ref().is_some_and(|values: &Vec<f64>| values.len() != components) {
            let why = format!("must be as many numbers as a voxel has, {components}");
            return Err(value("background", why));
        }
        if let Some(class) = &grid_class
            && !CLASSES.contains(&class.as_str())
        {
            let why = format!("'{class}' is not one of {}", CLASSES.join(", "));
            return Err(value("grid_class", why));
        }
        let world_from_index = match world_from_index {
            Some(_) if spacing.is_some() || origin.is_some() => {
                let why = "give it, or spacing and origin, not both";
                return Err(value("world_from_index", why));
            }
            Some(matrix) => matrix_of(matrix)?,
            None => place(spacing, origin, index)?,
        };
        let (value_type, _) = type_of("array", &array)?;
        let known = DenseGrid {
            name: name.to_owned(),
            class: grid_class,
            dims,
            components,
            value_type,
            bytes: Vec::new(),
            active: None,
            background,
            world_from_index,
            origin: IVec3::from_array(index),
            value_scale: [1.0, 0.0],
            space: None,
            up: None,
            metadata: Vec::new(),
        };
        let metadata = metadata.unwrap_or_else(|| PyDict::new(py)).unbind();
        let active = active.map(Bound::unbind);
        Ok(Self { array: array.unbind(), active, metadata, known, all_active: false })
    }

    /// The grid's name; empty if it has none.
    #[getter]
    fn name(&self) -> &str {
        &self.known.name
    }

    /// Transform from index (x, y, z) to world position, shape (4, 4), for column vectors. The
    /// first voxel's index is `index`.
    #[getter]
    fn world_from_index<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        matrix_array(py, &self.known.world_from_index)
    }

    /// Index (i, j, k) of the first voxel, along x, y and z.
    #[getter]
    fn index(&self) -> (i32, i32, i32) {
        self.known.origin.into()
    }

    /// World lengths of a voxel's edges along x, y and z.
    #[getter]
    fn spacing(&self) -> (f64, f64, f64) {
        let axis = |i: usize| self.known.world_from_index.col(i).truncate().length();
        (axis(0), axis(1), axis(2))
    }

    /// World position of the first voxel's centre.
    #[getter]
    fn origin(&self) -> (f64, f64, f64) {
        self.known.world_from_voxel().w_axis.truncate().into()
    }

    /// The value outside of the array: a number, or a tuple of them; None if unknown.
    #[getter]
    fn background<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(match self.known.background.as_deref() {
            None => None,
            Some(&[one]) => Some(one.into_pyobject(py)?.into_any()),
            Some(several) => Some(PyTuple::new(py, several)?.into_any()),
        })
    }

    /// OpenVDB's class: "level set", "fog volume", "staggered" or "unknown"; None if nobody says.
    #[getter]
    fn grid_class(&self) -> Option<&str> {
        self.known.class.as_deref()
    }

    /// The world that positions are in, such as "left-posterior-superior"; None if unknown.
    #[getter]
    fn space(&self) -> Option<&'static str> {
        self.known.space.map(|space| space.name())
    }

    /// The same volume with other values of what `Volume` takes: ``volume.replace(spacing=0.5)``.
    #[pyo3(signature = (**changes))]
    fn replace<'py>(
        &self,
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let fields = self.fields(py)?;
        let mut array = self.array.bind(py).clone();
        if let Some(changes) = changes {
            for key in ["spacing", "origin"] {
                if changes.contains(key)? && fields.contains("world_from_index")? {
                    fields.del_item("world_from_index")?;
                    fields.set_item("spacing", self.spacing())?;
                    fields.set_item("origin", self.origin())?;
                }
            }
            fields.update(changes.as_mapping())?;
            if let Some(other) = fields.get_item("array")? {
                fields.del_item("array")?;
                array = other;
            }
        }
        py.get_type::<Self>().call((array,), Some(&fields))
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::new(py, [&self.array])?, self.fields(py)?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let array = self.array.bind(py);
        let (shape, numbers) = (array.getattr("shape")?, array.getattr("dtype")?);
        Ok(format!("<Volume '{}': shape {shape} of {numbers}>", self.known.name))
    }

    /// The array itself, so that NumPy takes a volume for one.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        numbers::as_numpy(self.array.bind(py), dtype, copy)
    }
}

impl Volume {
    /// What [`Volume::new`] takes besides the array.
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let fields = PyDict::new(py);
        fields.set_item("name", &self.known.name)?;
        fields.set_item("world_from_index", self.world_from_index(py)?)?;
        fields.set_item("index", self.index())?;
        fields.set_item("active", &self.active)?;
        if self.all_active && self.known.background.is_some() {
            let [x, y, z] = self.known.dims;
            fields
                .set_item("active", py.import("numpy")?.call_method1("ones", ((z, y, x), BOOL))?)?;
        }
        fields.set_item("background", self.background(py)?)?;
        fields.set_item("grid_class", self.grid_class())?;
        fields.set_item("metadata", self.metadata.bind(py).copy()?)?;
        Ok(fields)
    }

    /// The volume of a grid of the library's. Its numbers are booleans if `is_bool`.
    pub fn of_grid(
        py: Python<'_>,
        mut grid: DenseGrid,
        is_bool: bool,
        metadata: Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let [x, y, z] = grid.dims;
        let mut shape = vec![z, y, x];
        let active = match grid.active.take() {
            None => None,
            Some(active) => {
                let flat = PyArray1::from_vec(py, active);
                Some(flat.call_method1("reshape", (shape.clone(),))?.unbind())
            }
        };
        if grid.components > 1 {
            shape.push(grid.components);
        }
        let name = if is_bool { BOOL } else { numbers::name_of(grid.value_type) };
        let bytes = std::mem::take(&mut grid.bytes);
        let all_active = active.is_none();
        let array = numbers::array(py, bytes, name, &shape)?.unbind();
        Ok(Self { array, active, metadata: metadata.unbind(), known: grid, all_active })
    }

    /// The grid of the library's, with a copy of the voxels; `true` if they are booleans.
    ///
    /// # Errors
    /// `ValueError` if the array has changed its shape since.
    pub fn to_grid(&self, py: Python<'_>) -> PyResult<(DenseGrid, bool)> {
        let mut grid = self.known.without_bytes();
        let array = self.array.bind(py);
        let (value_type, is_bool) = type_of("array", array)?;
        grid.value_type = value_type;
        grid.bytes = bytes_of(array)?;
        if grid.bytes.len() != grid.voxels() * grid.voxel_bytes() {
            return Err(value("array", "has changed its shape since the volume was made"));
        }
        if let Some(active) = &self.active {
            let bytes = bytes_of(active.bind(py))?;
            grid.active = Some(bytes.iter().map(|&byte| byte != 0).collect());
        } else if self.all_active && grid.background.is_some() {
            grid.active = Some(vec![true; grid.voxels()]);
        }
        Ok((grid, is_bool))
    }

    /// The grid's name; empty if it has none.
    pub fn grid_name(&self) -> &str {
        &self.known.name
    }

    /// Metadata as text, for formats that have nothing else.
    pub fn metadata_texts(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        let pairs = self.metadata.bind(py).iter();
        pairs
            .map(|(key, value)| {
                let key = key.extract::<String>()?;
                let text = match value.extract::<String>() {
                    Ok(text) => text,
                    Err(_) if value.is_instance_of::<PyBytes>() => value.repr()?.to_string(),
                    Err(_) => meta_value(&key, &value)?.to_string(),
                };
                Ok((key, text))
            })
            .collect()
    }
}

/// The volume that `object` is, or that of an array, a tree or an opened file.
pub fn volume_of<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Volume>> {
    if let Ok(volume) = object.cast::<Volume>() {
        return Ok(volume.clone());
    }
    if let Ok(sparse) = object.cast::<SparseGrid>() {
        return Bound::new(object.py(), dense(object.py(), sparse.get(), None, DEFAULT_MAX_BYTES)?);
    }
    if let Ok(file) = object.cast::<VolumeFile>() {
        return Bound::new(object.py(), file.get().read(object.py(), None)?);
    }
    let volume = Volume::new(object, "", None, None, None, [0; 3], None, None, None, None)?;
    Bound::new(object.py(), volume)
}
