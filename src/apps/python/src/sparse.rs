//! Grids of OpenVDB as trees, for those that are too large to be dense.

use std::sync::Arc;

use deepshadow::glam::{DMat4, IVec3};
use deepshadow::io::dense::{DEFAULT_MAX_BYTES, DenseGrid};
use deepshadow::io::number::ValueType;
use deepshadow::io::remap::Remap;
use deepshadow::io::vdb::{Grid, GridHeader, IndexBox, Tile, Tree, Value};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::errors::{raised, value};
use crate::metadata::dictionary;
use crate::numbers::{self, BOOL};
use crate::placement::matrix_array;
use crate::volume::Volume;
use crate::work::done;

/// Runs the expression on the grid's tree, with its number's name for NumPy.
macro_rules! with_tree {
    ($grid:expr, $tree:ident, $name:ident => $result:expr) => {{
        use deepshadow::io::vdb::Grid as G;
        match $grid {
            G::Float($tree) => {
                let $name = "<f4";
                $result
            }
            G::Double($tree) => {
                let $name = "<f8";
                $result
            }
            G::Half($tree) => {
                let $name = "<f2";
                $result
            }
            G::Int32($tree) => {
                let $name = "<i4";
                $result
            }
            G::Int64($tree) => {
                let $name = "<i8";
                $result
            }
            G::Bool($tree) => {
                let $name = BOOL;
                $result
            }
            G::Vec3s($tree) => {
                let $name = "<f4";
                $result
            }
            G::Vec3d($tree) => {
                let $name = "<f8";
                $result
            }
            G::Vec3i($tree) => {
                let $name = "<i4";
                $result
            }
            _ => Err(value("grid", "its type is not known")),
        }
    }};
}

/// A grid of an OpenVDB file as a tree: active voxels in leaves of 8 x 8 x 8, larger constant
/// regions as tiles. It is read by `VolumeFile.sparse`, and written as it is by `write`.
#[pyclass(module = "deepshadow", frozen)]
pub struct SparseGrid {
    pub grid: Arc<Grid>,
    pub header: GridHeader,
    pub world_from_index: DMat4,
}

#[pymethods]
impl SparseGrid {
    /// The grid's name.
    #[getter]
    fn name(&self) -> &str {
        &self.header.name
    }

    /// Transform from index (x, y, z) to world position, shape (4, 4), for column vectors.
    #[getter]
    fn world_from_index<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        matrix_array(py, &self.world_from_index)
    }

    /// The grid's metadata.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        dictionary(py, &self.header.metadata)
    }

    /// Number of active voxels.
    #[getter]
    fn active_voxel_count(&self) -> u64 {
        self.grid.active_voxel_count()
    }

    /// Lowest and highest index (i, j, k) of active voxels; None if there are none.
    #[getter]
    fn active_bounds(&self) -> Option<(Index, Index)> {
        self.grid.active_bounds().map(|bounds| (bounds.min.into(), bounds.max.into()))
    }

    /// Number of leaves.
    #[getter]
    fn leaf_count(&self) -> PyResult<usize> {
        with_tree!(&*self.grid, tree, _name => Ok(tree.leaf_count()))
    }

    /// All active voxels: their indices, int32 of shape (n, 3) as (i, j, k) along x, y, z, and
    /// their values, shape (n,) or (n, 3). Tiles are expanded; `max_bytes` limits the memory for
    /// both, 4 GiB by default.
    #[pyo3(signature = (*, max_bytes = DEFAULT_MAX_BYTES))]
    fn active_values<'py>(
        &self,
        py: Python<'py>,
        max_bytes: u64,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        with_tree!(&*self.grid, tree, name => active_values(py, tree, name, max_bytes))
    }

    /// The tiles, which are constant regions larger than voxels: a list of (index of the first voxel,
    /// edge in voxels, value, whether it is active). Voxels are in leaves, in tiles, or have the
    /// background's value.
    fn tiles<'py>(&self, py: Python<'py>) -> PyResult<Vec<TileOf<'py>>> {
        with_tree!(&*self.grid, tree, name => {
            let tile = |tile: Tile<_>| {
                let edge = tile.bounds().dims()[0];
                Ok((tile.origin.into(), edge, scalar(py, tile.value, name)?, tile.active))
            };
            tree.tiles().map(tile).collect()
        })
    }

    /// The value outside of leaves and tiles.
    #[getter]
    fn background<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        with_tree!(&*self.grid, tree, name => scalar(py, tree.background(), name))
    }

    /// OpenVDB's class: "level set", "fog volume", "staggered" or "unknown".
    #[getter]
    fn grid_class(&self) -> &str {
        self.header.class()
    }

    /// Iterates over the leaves, not over `tiles`: (index of the first voxel, values of shape (8, 8, 8) or
    /// (8, 8, 8, 3) by z, y, x, which of them are active).
    fn leaves(&self) -> PyResult<Leaves> {
        let boxes = with_tree!(&*self.grid, tree, _name => {
            Ok(tree.leaves().map(|leaf| leaf.bounds()).collect::<Vec<_>>())
        })?;
        Ok(Leaves { grid: self.grid.clone(), boxes: boxes.into_iter() })
    }

    /// The voxels of a box as a volume: from `low` to `high`, both included, by default the box
    /// around the active ones. `max_bytes` limits its memory.
    #[pyo3(signature = (low = None, high = None, *, max_bytes = DEFAULT_MAX_BYTES))]
    fn volume(
        &self,
        py: Python<'_>,
        low: Option<[i32; 3]>,
        high: Option<[i32; 3]>,
        max_bytes: u64,
    ) -> PyResult<Volume> {
        let bounds = match (low, high) {
            (None, None) => None,
            (Some(low), Some(high)) if (0..3).all(|axis| low[axis] <= high[axis]) => {
                Some(IndexBox { min: low.into(), max: high.into() })
            }
            _ => return Err(value("low, high", "give both; low must not be above high")),
        };
        dense(py, self, bounds, max_bytes)
    }

    /// The value at an index (i, j, k) along x, y, z.
    fn __getitem__<'py>(&self, py: Python<'py>, at: [i32; 3]) -> PyResult<Bound<'py, PyAny>> {
        let at = IVec3::from_array(at);
        with_tree!(&*self.grid, tree, name => scalar(py, tree.get(at).0, name))
    }

    fn __repr__(&self) -> String {
        let (count, name) = (self.grid.active_voxel_count(), &self.header.name);
        format!("<SparseGrid '{name}' of {}, {count} active voxels>", self.grid.value_type().name())
    }
}

/// An iterator over leaves.
#[pyclass(module = "deepshadow")]
pub struct Leaves {
    grid: Arc<Grid>,
    boxes: std::vec::IntoIter<IndexBox>,
}

/// An index (i, j, k) as Python has it.
type Index = (i32, i32, i32);
/// First voxel, edge, value, activity.
type TileOf<'py> = (Index, u64, Bound<'py, PyAny>, bool);
type LeafArrays<'py> = (Index, Bound<'py, PyAny>, Bound<'py, PyAny>);

#[pymethods]
impl Leaves {
    fn __iter__(own: PyRef<'_, Self>) -> PyRef<'_, Self> {
        own
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<LeafArrays<'py>>> {
        let Some(bounds) = self.boxes.next() else { return Ok(None) };
        with_tree!(&*self.grid, tree, name => leaf(py, tree, name, bounds)).map(Some)
    }
}

/// A value as NumPy has it: a number, or an array of three.
fn scalar<'py, T: Value>(py: Python<'py>, value: T, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let shape: &[usize] = if T::COMPONENTS > 1 { &[3] } else { &[] };
    numbers::array(py, encoded(&[value]), name, shape)?.get_item(())
}

fn encoded<T: Value>(values: &[T]) -> Vec<u8> {
    let mut bytes = Vec::new();
    T::encode(values, &mut bytes);
    bytes
}

/// The leaf that fills `bounds`, in the order of arrays.
fn leaf<'py, T: Value>(
    py: Python<'py>,
    tree: &Tree<T>,
    name: &str,
    bounds: IndexBox,
) -> PyResult<LeafArrays<'py>> {
    let (low, edge) = (bounds.min, bounds.dims()[0] as usize);
    let mut shape = vec![edge; 3];
    let (mut values, mut active) = (Vec::new(), Vec::new());
    for z in 0..edge as i32 {
        for y in 0..edge as i32 {
            for x in 0..edge as i32 {
                let (value, on) = tree.get(low + IVec3::new(x, y, z));
                values.push(value);
                active.push(on);
            }
        }
    }
    let active = PyArray1::from_vec(py, active).call_method1("reshape", (shape.clone(),))?;
    if T::COMPONENTS > 1 {
        shape.push(T::COMPONENTS);
    }
    Ok((low.into(), numbers::array(py, encoded(&values), name, &shape)?, active))
}

fn active_values<'py, T: Value>(
    py: Python<'py>,
    tree: &Tree<T>,
    name: &str,
    max_bytes: u64,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let count = tree.active_voxel_count();
    let needed = count.saturating_mul((12 + size_of::<T>()) as u64);
    if needed > max_bytes {
        return Err(raised(
            deepshadow::ErrorKind::Limit {
                what: format!("{count} active voxels"),
                needed: format!("{needed} bytes"),
                limit: format!("{max_bytes} bytes"),
            }
            .into(),
        ));
    }
    let (mut indices, mut values) = (Vec::new(), Vec::new());
    for region in tree.active_values() {
        let bounds = region.bounds();
        for x in bounds.min.x..=bounds.max.x {
            for y in bounds.min.y..=bounds.max.y {
                for z in bounds.min.z..=bounds.max.z {
                    indices.extend([x, y, z]);
                    values.push(region.value);
                }
            }
        }
    }
    let all = values.len();
    let indices = PyArray1::from_vec(py, indices).call_method1("reshape", (all, 3))?;
    let shape = if T::COMPONENTS > 1 { vec![all, T::COMPONENTS] } else { vec![all] };
    Ok((indices, numbers::array(py, encoded(&values), name, &shape)?))
}

/// The voxels of `bounds`, else of the box around the active ones, in their own type; a single voxel
/// of background if there are none.
pub fn dense(
    py: Python<'_>,
    of: &SparseGrid,
    bounds: Option<IndexBox>,
    max_bytes: u64,
) -> PyResult<Volume> {
    let SparseGrid { grid, header, world_from_index } = of;
    // A grid without active voxels is one voxel of background.
    let nothing = IndexBox { min: IVec3::ZERO, max: IVec3::ZERO };
    let bounds = bounds.or_else(|| grid.active_bounds()).unwrap_or(nothing);
    let is_bool = matches!(**grid, Grid::Bool(_));
    let mut dense = done(py, None, |_| {
        let dense = DenseGrid::of_vdb(grid, bounds, *world_from_index, max_bytes)?;
        // Floats as halves, as the file has them.
        let halved = header.saved_as_half && !is_bool;
        if halved { dense.retyped(ValueType::F16, Remap::Cast) } else { Ok(dense) }
    })?;
    dense.name.clone_from(&header.name);
    dense.class = Some(header.class().to_owned());
    Volume::of_grid(py, dense, is_bool, own_metadata(py, header)?)
}

/// What a grid's metadata say that no attribute of a volume does.
fn own_metadata<'py>(
    py: Python<'py>,
    header: &GridHeader,
) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
    let all = dictionary(py, &header.metadata)?;
    for (key, _) in header.metadata.iter() {
        if key.starts_with("file_") || ["name", "class", "is_saved_as_half_float"].contains(&key) {
            all.del_item(key)?;
        }
    }
    Ok(all)
}
