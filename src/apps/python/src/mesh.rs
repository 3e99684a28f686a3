//! Meshes as arrays.

use std::collections::HashMap;
use std::sync::Arc;

use deepshadow::glam::{DVec3, Vec3};
use deepshadow::surface::{self, Material, Varying};
use deepshadow::volume::Axis;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::{raised, value};
use crate::vectors::{array_of, colors, integers, numbers, shape_of_any, vectors};
use crate::work::done;

/// A mesh of triangles, which need not be closed; both sides are alike.
///
/// Parameters
/// ----------
/// positions : array_like, shape (n, 3)
///     Positions (x, y, z) of the vertices; kept as float32.
/// triangles : array_like of int, shape (m, 3)
///     Indices of three vertices each.
/// normals : array_like, shape (n, 3) or (m, 3, 3), optional
///     For shading, of the vertices or of each triangle's corners; those of the triangles' planes by
///     default.
/// smooth_degrees : float, optional
///     Instead of `normals`: edges of at most this angle are smooth.
/// albedo : float or array_like of shape (3,) or (m, 3)
///     Reflectance, linear RGB, 0..1, also of each triangle.
/// opacity : float or array_like of shape (m,)
///     The share of light that one crossing takes, 0..1.
/// up : {"y", "z", "x", "-y", "-z", "-x"}
///     The axis that points up.
/// name : str
#[pyclass(module = "deepshadow", frozen)]
pub struct Mesh {
    pub mesh: Arc<surface::Mesh>,
    /// The axis that points up.
    pub up: Axis,
    /// Remarks on what was left out, and on the file that it was read from, one line each.
    #[pyo3(get)]
    pub notes: Vec<String>,
}

impl Mesh {
    /// Those of a scene, whose tables say what points up.
    pub fn of(mesh: Arc<surface::Mesh>) -> Self {
        Self { mesh, up: Axis::Y, notes: Vec::new() }
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (
        positions, triangles, *, normals = None, smooth_degrees = None, albedo = None,
        opacity = None, up = "y", name = "",
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        positions: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        smooth_degrees: Option<f64>,
        albedo: Option<&Bound<'_, PyAny>>,
        opacity: Option<&Bound<'_, PyAny>>,
        up: &str,
        name: &str,
    ) -> PyResult<Self> {
        let py = positions.py();
        let (positions, _) = vectors("positions", positions)?;
        let triangles = indices(triangles, positions.len())?;
        let count = triangles.len();
        let normals = normals.map(|normals| corner_normals(normals, &triangles, positions.len()));
        let normals = normals.transpose()?;
        if normals.is_some() && smooth_degrees.is_some() {
            return Err(value("smooth_degrees", "give it, or normals, not both"));
        }
        if smooth_degrees.is_some_and(|angle| !(0.0..=180.0).contains(&angle)) {
            return Err(value("smooth_degrees", "is not in 0..180"));
        }
        let albedo = colors("albedo", albedo, count)?;
        let opacity = numbers("opacity", opacity, 1.0, count)?;
        let (materials, material_of) = materials(&albedo, &opacity, count);
        let up: Axis = up.parse().map_err(raised)?;
        let mesh = done(py, None, |_| {
            let mesh =
                surface::Mesh::new(name, positions, triangles, materials, material_of, normals)?;
            Ok(match smooth_degrees {
                Some(angle) => mesh.smoothed(angle),
                None => mesh,
            })
        })?;
        let notes = match mesh.skipped() {
            0 => Vec::new(),
            count => {
                vec![format!("triangles left out, with vertices that are not finite: {count}")]
            }
        };
        Ok(Self { mesh: Arc::new(mesh), up, notes })
    }

    /// Positions of the vertices: float32 of shape (n, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, self.mesh.positions(), &[])
    }

    /// Indices of the triangles' vertices: uint32 of shape (m, 3). Triangles with vertices that are
    /// not finite were left out.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let flat = PyArray1::from_slice(py, self.mesh.triangles().as_flattened());
        flat.call_method1("reshape", ((self.mesh.triangles().len(), 3),))
    }

    /// Unit normals at the triangles' corners, float32 of shape (m, 3, 3); None if they are those of
    /// the planes.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        if self.mesh.is_flat() {
            return Ok(None);
        }
        let count = self.mesh.triangles().len();
        let normals: Vec<Vec3> = (0..count).flat_map(|i| self.mesh.normals(i)).collect();
        array_of(py, &normals, &[count, 3]).map(Some)
    }

    /// Reflectance of each triangle, linear RGB: float32 of shape (m, 3).
    #[getter]
    fn albedo<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.mesh.triangles().len();
        let albedo = (0..count).map(|i| self.mesh.material(i).albedo.as_vec3());
        array_of(py, &albedo.collect::<Vec<_>>(), &[])
    }

    /// The share of light that one crossing of each triangle takes: float32 of shape (m,).
    #[getter]
    fn opacity<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let count = self.mesh.triangles().len();
        let opacity = (0..count).map(|i| self.mesh.material(i).opacity as f32).collect();
        PyArray1::from_vec(py, opacity).into_any()
    }

    /// The axis that points up.
    #[getter]
    fn up(&self) -> &'static str {
        self.up.name()
    }

    /// Its name: a file's stem.
    #[getter]
    fn name(&self) -> &str {
        &self.mesh.name
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let fields = PyDict::new(py);
        fields.set_item("normals", self.normals(py)?)?;
        fields.set_item("albedo", self.albedo(py)?)?;
        fields.set_item("opacity", self.opacity(py))?;
        fields.set_item("up", self.up())?;
        fields.set_item("name", self.name())?;
        Ok((PyTuple::new(py, [self.positions(py)?, self.triangles(py)?])?, fields))
    }

    fn __repr__(&self) -> String {
        let (triangles, vertices) = (self.mesh.triangles().len(), self.mesh.positions().len());
        format!("<Mesh '{}': {triangles} triangles, {vertices} vertices>", self.mesh.name)
    }
}

/// Triangles between so many vertices.
fn indices(object: &Bound<'_, PyAny>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
    let shape = shape_of_any(object)?;
    if !matches!(shape[..], [_, 3]) {
        return Err(value("triangles", format!("has shape {shape:?}, expected (m, 3)")));
    }
    let flat = integers("triangles", object)?;
    if let Some(index) = flat.iter().find(|&&index| index as usize >= vertices) {
        return Err(value("triangles", format!("one has vertex {index} of {vertices}")));
    }
    Ok(flat.as_chunks().0.to_vec())
}

/// Normals at the corners of triangles, from those or from the vertices' own.
fn corner_normals(
    object: &Bound<'_, PyAny>,
    triangles: &[[u32; 3]],
    vertices: usize,
) -> PyResult<Vec<[Vec3; 3]>> {
    let (normals, shape) = vectors("normals", object)?;
    match shape[..] {
        [count] if count == vertices => {
            Ok(triangles.iter().map(|corners| corners.map(|i| normals[i as usize])).collect())
        }
        [count, 3] if count == triangles.len() => Ok(normals.as_chunks().0.to_vec()),
        _ => {
            let (n, m) = (vertices, triangles.len());
            let why = format!("has shape {shape:?} of vectors, expected ({n},) or ({m}, 3)");
            Err(value("normals", why))
        }
    }
}

/// The different materials of triangles, and the index of each one's.
fn materials(
    albedo: &Varying<Vec3>,
    opacity: &Varying<f32>,
    count: usize,
) -> (Vec<Material>, Vec<u32>) {
    let mut known: HashMap<[u32; 4], u32> = HashMap::new();
    let mut materials = Vec::new();
    let material_of = (0..count).map(|triangle| {
        let (albedo, opacity) = (albedo.at(triangle), opacity.at(triangle));
        let key = albedo.extend(opacity).to_array().map(f32::to_bits);
        *known.entry(key).or_insert_with(|| {
            let (albedo, opacity) = (DVec3::from(albedo), f64::from(opacity));
            materials.push(Material { name: String::new(), albedo, opacity });
            materials.len() as u32 - 1
        })
    });
    let material_of = material_of.collect();
    (materials, material_of)
}
