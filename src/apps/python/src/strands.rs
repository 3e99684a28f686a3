//! Hair as arrays.

use std::sync::Arc;

use deepshadow::surface::{self, Varying};
use deepshadow::volume::Axis;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::{raised, value};
use crate::vectors::{array_of, colors, integers, numbers, varying, vectors};
use crate::work::done;

/// Strands, such as hair, fur or fibres: polylines with a thickness.
///
/// Parameters
/// ----------
/// points : array_like, shape (n, 3) or (strands, k, 3)
///     Positions (x, y, z), one strand after another; kept as float32.
/// counts : array_like of int, shape (strands,), optional
///     The number of points of each strand; not needed where all have k.
/// thickness : float or array_like of shape (n,)
///     Diameter, in the points' unit, also at each point.
/// opacity : float or array_like of shape (n,)
///     The share of light that one crossing takes, 0..1.
/// albedo : float or array_like of shape (3,) or (n, 3)
///     Reflectance, linear RGB, 0..1.
/// up : {"y", "z", "x", "-y", "-z", "-x"}
///     The axis that points up.
/// name : str
#[pyclass(module = "deepshadow", frozen)]
pub struct Strands {
    pub strands: Arc<surface::Strands>,
    /// The axis that points up.
    pub up: Axis,
    /// Remarks on what was left out, and on the file that it was read from, one line each.
    #[pyo3(get)]
    pub notes: Vec<String>,
}

impl Strands {
    /// Those of a scene, whose tables say what points up.
    pub fn of(strands: Arc<surface::Strands>) -> Self {
        Self { strands, up: Axis::Y, notes: Vec::new() }
    }
}

#[pymethods]
impl Strands {
    #[new]
    #[pyo3(signature = (
        points, counts = None, *, thickness, opacity = None, albedo = None, up = "y", name = "",
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        points: &Bound<'_, PyAny>,
        counts: Option<&Bound<'_, PyAny>>,
        thickness: &Bound<'_, PyAny>,
        opacity: Option<&Bound<'_, PyAny>>,
        albedo: Option<&Bound<'_, PyAny>>,
        up: &str,
        name: &str,
    ) -> PyResult<Self> {
        let py = points.py();
        let (points, shape) = vectors("points", points)?;
        let counts = match (counts, &shape[..]) {
            (Some(counts), [_]) => integers("counts", counts)?,
            (None, [strands, each]) => vec![*each as u32; *strands],
            (Some(_), _) => return Err(value("counts", "is given, so points must be (n, 3)")),
            (None, _) => {
                let why =
                    "say how many points each strand has, where points are not (strands, k, 3)";
                return Err(value("counts", why));
            }
        };
        let count = points.len();
        let thickness = numbers("thickness", Some(thickness), 0.0, count)?;
        let opacity = numbers("opacity", opacity, 1.0, count)?;
        let albedo = colors("albedo", albedo, count)?;
        let up: Axis = up.parse().map_err(raised)?;
        let strands = done(py, None, |_| {
            surface::Strands::new(name, points, &counts, thickness, opacity, albedo)
        })?;
        let notes = match strands.skipped() {
            0 => Vec::new(),
            count => vec![format!(
                "strands left out, of fewer than two points or with numbers that are not finite: \
                 {count}"
            )],
        };
        Ok(Self { strands: Arc::new(strands), up, notes })
    }

    /// Positions of the points: float32 of shape (n, 3). Strands of fewer than two points, or with
    /// numbers that are not finite, were left out.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, self.strands.points(), &[])
    }

    /// The number of points of each strand: uint32 of shape (strands,).
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let strands = 0..self.strands.count();
        let counts = strands.map(|strand| self.strands.strand(strand).len() as u32);
        PyArray1::from_vec(py, counts.collect()).into_any()
    }

    /// Diameter in the points' unit: a number, or float32 of shape (n,).
    #[getter]
    fn thickness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        varying(py, self.strands.thickness())
    }

    /// The share of light that one crossing takes: a number, or float32 of shape (n,).
    #[getter]
    fn opacity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        varying(py, self.strands.opacity())
    }

    /// Reflectance, linear RGB: float32 of shape (3,) or (n, 3).
    #[getter]
    fn albedo<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.strands.albedo() {
            Varying::Same(color) => Ok(PyArray1::from_slice(py, &color.to_array()).into_any()),
            Varying::PerPoint(colors) => array_of(py, colors, &[]),
        }
    }

    /// The axis that points up.
    #[getter]
    fn up(&self) -> &'static str {
        self.up.name()
    }

    /// Its name: a file's stem.
    #[getter]
    fn name(&self) -> &str {
        &self.strands.name
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let fields = PyDict::new(py);
        fields.set_item("thickness", self.thickness(py)?)?;
        fields.set_item("opacity", self.opacity(py)?)?;
        fields.set_item("albedo", self.albedo(py)?)?;
        fields.set_item("up", self.up())?;
        fields.set_item("name", self.name())?;
        Ok((PyTuple::new(py, [self.points(py)?, self.counts(py)])?, fields))
    }

    fn __len__(&self) -> usize {
        self.strands.count()
    }

    fn __repr__(&self) -> String {
        let (strands, points) = (self.strands.count(), self.strands.points().len());
        format!("<Strands '{}': {strands} strands, {points} points>", self.strands.name)
    }
}
