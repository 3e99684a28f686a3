//! The light that arrives at points.

use deepshadow::probe::{Probe, ProbePoint, probe};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::value;
use crate::numbers::rows;
use crate::scene::scene_of;
use crate::work::done;

/// The share of each light that arrives at points: the transmittance of everything on the way.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like, path-like, str or dict
///     As of `Scene`.
/// points : array_like, shape (..., 3)
///     World positions.
/// exact : bool
///     Whether rays are traced in f64, which is the truth, instead of lookups in maps. These are
///     built anew at each call: for few points `exact` takes less time, and for many calls a
///     `ShadowMap` that is kept.
/// normals : array_like, shape (..., 3), optional
///     Of the surfaces that the points lie on: light from behind does not arrive.
/// footprint : float, optional
///     Edge, in world lengths, of a square across the ray over which the mean is taken.
/// backend, progress, **tables :
///     As of `render`.
///
/// Returns
/// -------
/// numpy.ndarray
///     float32 of shape (..., lights, 3), for red, green and blue; 0..1.
#[pyfunction]
#[pyo3(signature = (
    scene, points, *, exact = false, normals = None, footprint = None, backend = "auto",
    progress = None, **tables,
))]
#[allow(clippy::too_many_arguments)]
pub fn transmittance<'py>(
    scene: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    exact: bool,
    normals: Option<&Bound<'py, PyAny>>,
    footprint: Option<f64>,
    backend: &str,
    progress: Option<&Bound<'py, PyAny>>,
    tables: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = scene.py();
    let request = scene_of(scene, tables)?.request(py)?;
    let (positions, mut shape) = rows("points", points)?;
    let normals = normals.map(|normals| rows("normals", normals)).transpose()?;
    let normals = normals.map(|(normals, _)| normals);
    if normals.as_ref().is_some_and(|normals| normals.len() != positions.len()) {
        return Err(value("normals", "must be as many as points"));
    }
    let points = positions.iter().enumerate().map(|(i, &position)| ProbePoint {
        position: position.into(),
        normal: normals.as_ref().map(|normals| normals[i].into()),
    });
    let points: Vec<ProbePoint> = points.collect();
    let mut how = Probe::default();
    (how.exact, how.footprint) = (exact, footprint);
    let (lights, found) = done(py, progress, |watch| {
        let loaded = request.load()?;
        let settings = loaded.map_settings();
        let backend = loaded.backend(backend, settings.map.kind)?;
        let found = probe(&loaded.scene, &settings, &*backend, &points, &how, watch)?;
        Ok((loaded.scene.lights.len(), found))
    })?;
    shape.extend([lights, 3]);
    let flat: Vec<f32> = found.into_iter().flatten().flatten().collect();
    PyArray1::from_vec(py, flat).call_method1("reshape", (shape,))
}
