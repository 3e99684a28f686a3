//! Shadow maps, and the light that arrives at points.

use deepshadow::glam::DVec3;
use deepshadow::probe::{Probe, ProbePoint, probe};
use deepshadow::scene::{Beam, Channels};
use deepshadow::shadow::{Map, Shadow};
use deepshadow::{Error, Result};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::backends::named;
use crate::errors::value;
use crate::numbers::rows;
use crate::scene::scene_of;
use crate::work::done;

/// Texels along each edge of maps that are made without a picture.
const MAP_SIZE: u32 = 512;

/// The share of each light that arrives at points: the transmittance of everything on the way.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like, path-like, str or dict
///     As of `Scene`.
/// points : array_like, shape (n, 3)
///     World positions.
/// exact : bool
///     Whether rays are traced in f64, which is the truth, instead of lookups in maps.
/// normals : array_like, shape (n, 3), optional
///     Of the surfaces that the points lie on: light from behind does not arrive.
/// footprint : float, optional
///     Edge, in world lengths, of a square across the ray over which the mean is taken.
/// backend, progress, **tables :
///     As of `render`.
///
/// Returns
/// -------
/// numpy.ndarray
///     float32 of shape (n, lights, 3), for red, green and blue; 0..1.
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
    let positions = rows("points", points)?;
    let normals = normals.map(|normals| rows("normals", normals)).transpose()?;
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
    let found = done(py, progress, |watch| {
        let loaded = request.load()?;
        let mut settings = loaded.settings;
        if loaded.file.shadow.size.is_none() {
            settings.map.size = MAP_SIZE;
        }
        let kind = settings.map.kind.unwrap_or_default();
        let backend = named(backend, kind, !loaded.scene.surfaces.is_empty())?;
        let found = probe(&loaded.scene, &settings, backend, &points, &how, watch)?;
        Ok((loaded.scene.lights.len(), found))
    })?;
    let (lights, found) = found;
    let count = found.len();
    let flat: Vec<f32> = found.into_iter().flatten().flatten().collect();
    PyArray1::from_vec(py, flat).call_method1("reshape", ((count, lights, 3),))
}

/// Builds the shadow map of one of the scene's lights.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like, path-like, str or dict
///     As of `Scene`.
/// kind : str, optional
///     "fragments" (the default), "threshold", and other kinds of the program.
/// size : int, optional
///     Texels along each edge; 512 by default.
/// tolerance : float, optional
///     Largest error of transmittance of the lists of a fragment map.
/// light_index : int
///     Which of the scene's lights.
/// backend, progress, **tables :
///     As of `render`.
///
/// Returns
/// -------
/// ShadowMap
#[pyfunction]
#[pyo3(signature = (
    scene, *, kind = None, size = None, tolerance = None, light_index = 0, backend = "auto",
    progress = None, **tables,
))]
#[allow(clippy::too_many_arguments)]
pub fn shadow_map(
    scene: &Bound<'_, PyAny>,
    kind: Option<&str>,
    size: Option<u32>,
    tolerance: Option<f64>,
    light_index: usize,
    backend: &str,
    progress: Option<&Bound<'_, PyAny>>,
    tables: Option<&Bound<'_, PyDict>>,
) -> PyResult<ShadowMap> {
    let py = scene.py();
    let shadow = PyDict::new(py);
    shadow.set_item("map", kind)?;
    shadow.set_item("size", size)?;
    shadow.set_item("tolerance", tolerance)?;
    let given = PyDict::new(py);
    given.set_item("shadow", shadow)?;
    let scene = Bound::new(py, scene_of(scene, tables)?)?;
    let request = scene_of(&scene, Some(&given))?.request(py)?;
    let parts = done(py, progress, |watch| {
        let loaded = request.load()?;
        let mut settings = loaded.settings;
        if loaded.file.shadow.size.is_none() {
            settings.map.size = MAP_SIZE;
        }
        let kind = settings.map.kind.unwrap_or_default();
        let backend = named(backend, kind, !loaded.scene.surfaces.is_empty())?;
        let lights = loaded.scene.lights.len();
        if light_index >= lights {
            return Err(Error::value(
                "light_index",
                format!("there are {lights} lights, from 0 on"),
            ));
        }
        let beams = loaded.scene.beams()?.into_iter().filter(|beam| beam.index == light_index);
        let map = |beam: Beam| {
            let map = backend.map(&beam, &settings, watch)?;
            map.prepare();
            Ok(Part { beam, map })
        };
        let parts = beams.map(map).collect::<Result<Vec<_>>>()?;
        Ok((parts, settings.map.filter.window().0, kind.to_string()))
    })?;
    let (parts, window, kind) = parts;
    Ok(ShadowMap { parts, window, kind })
}

/// What answers for one view of the light, in one channel or all.
struct Part {
    beam: Beam,
    map: Map,
}

/// A shadow map of one light: transmittance from the light to every point.
#[pyclass(module = "deepshadow", frozen)]
pub struct ShadowMap {
    parts: Vec<Part>,
    window: u32,
    /// The kind of map, such as "fragments".
    #[pyo3(get)]
    kind: String,
}

#[pymethods]
impl ShadowMap {
    /// Texels along each edge.
    #[getter]
    fn size(&self) -> u32 {
        self.parts.first().map_or(0, |part| part.map.size())
    }

    /// Bytes of the map, of all its parts.
    #[getter]
    fn bytes(&self) -> u64 {
        self.parts.iter().map(|part| part.map.bytes()).sum()
    }

    /// Number of maps that it consists of: views of a light among the media, and channels of
    /// coloured ones.
    #[getter]
    fn parts(&self) -> usize {
        self.parts.len()
    }

    /// Transmittance, 0..1, from the light to world positions.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (n, 3)
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     float32 of shape (n,), or (n, 3) where extinction is coloured.
    fn transmittance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let points = rows("points", points)?;
        if let Some(bad) = points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return Err(value("points", format!("point {bad} is not finite")));
        }
        let coloured = self.parts.iter().any(|part| part.beam.channels != Channels::All);
        let count = points.len();
        let found = done(py, None, |_| {
            let mut found = vec![1.0_f32; if coloured { 3 * count } else { count }];
            if coloured {
                let each = found.par_chunks_exact_mut(3).zip(&points);
                each.for_each(|(values, &point)| self.light(point.into(), values));
            } else {
                let each = found.par_iter_mut().zip(&points);
                each.for_each(|(value, &point)| {
                    self.light(point.into(), std::slice::from_mut(value));
                });
            }
            Ok(found)
        })?;
        let array = PyArray1::from_vec(py, found);
        if coloured { array.call_method1("reshape", ((count, 3),)) } else { Ok(array.into_any()) }
    }

    /// The lists of a fragment map.
    ///
    /// Returns
    /// -------
    /// (offsets, depth, optical_depth)
    ///     Of texel ``t = row * size + column``, the nodes ``offsets[t]:offsets[t + 1]`` (uint32 of
    ///     size * size + 1): depths along the ray from the light, and optical depths from the
    ///     light up to there, float32, linear in between.
    fn lists<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let [part] = &self.parts[..] else {
            let why =
                format!("the light has {} maps, of several views or colours", self.parts.len());
            return Err(value("lists", why));
        };
        let Some(map) = part.map.as_fragments() else {
            return Err(value("lists", format!("a '{}' map has none", self.kind)));
        };
        let runs = map.runs();
        let column = |of: fn(&deepshadow::shadow::Node) -> f32| {
            PyArray1::from_vec(py, runs.nodes().iter().map(of).collect()).into_any()
        };
        let offsets = PyArray1::from_slice(py, runs.starts()).into_any();
        Ok((offsets, column(|node| node.depth), column(|node| node.optical_depth)))
    }

    fn __repr__(&self) -> String {
        let (size, bytes) = (self.size(), self.bytes());
        format!("<ShadowMap '{}' of {size} x {size} texels, {bytes} bytes>", self.kind)
    }
}

impl ShadowMap {
    /// Sets the shares of the light that arrive at a point, of one channel or of three.
    fn light(&self, point: DVec3, values: &mut [f32]) {
        for Part { beam, map } in &self.parts {
            if !beam.view.answers_for(point) {
                continue;
            }
            let Some(place) = beam.view.place(point) else { continue };
            let light = map.lookup(self.window, place.x, place.y, place.z);
            match beam.channels {
                Channels::All => values.fill(light),
                Channels::One(channel) => values[channel.min(values.len() - 1)] = light,
            }
        }
    }
}
