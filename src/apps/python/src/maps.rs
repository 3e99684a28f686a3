//! Shadow maps: built, chosen and asked.

use std::path::PathBuf;

use deepshadow::compare::{self, Limits};
use deepshadow::glam::DVec3;
use deepshadow::io::Inputs;
use deepshadow::io::map_files::{NamedMap, encode_maps, write_maps};
use deepshadow::scene::{Beam, Channels, Media, Scene};
use deepshadow::shadow::{Map, Shadow};
use deepshadow::{Error, Result};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::errors::{raised, value};
use crate::numbers::rows;
use crate::scene::scene_of;
use crate::work::done;

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
    done(py, progress, |watch| {
        let loaded = request.load()?;
        let settings = loaded.map_settings();
        let kind = settings.map.kind.unwrap_or_default();
        let backend = loaded.backend(backend, Some(kind))?;
        backend.check_room(&settings.with(|settings| settings.image.size = [1; 2]))?;
        let beams = beams_of(&loaded.scene, light_index)?.into_iter();
        let map = |beam: Beam| {
            let map = backend.map(&beam, &settings, watch)?;
            map.prepare();
            Ok(Part { beam, map, certificate: None })
        };
        let parts = beams.map(map).collect::<Result<Vec<_>>>()?;
        let (window, media) = (settings.map.filter.window().0, loaded.scene.media);
        Ok(ShadowMap { parts, window, media, kind: kind.to_string(), by: backend.description() })
    })
}

/// Chooses the shadow map of one of the scene's lights that keeps a limit: the smallest within an
/// error, the most exact within a number of bytes. What is returned has been measured.
///
/// Parameters
/// ----------
/// scene : Scene, Volume, array_like, path-like, str or dict
///     As of `Scene`.
/// max_error : float, optional
///     Largest RMS error of transmittance at random points of the volume, above 0.
/// max_bytes : int or str, optional
///     Bytes that the map may take, or such per texel: "16/texel".
/// kind, size, light_index, backend, progress, **tables :
///     As of `shadow_map`; kind and size are chosen too unless they, or the scene, say them.
///
/// Returns
/// -------
/// ShadowMap
///     Its `certificate` says what was measured. Of a coloured scene each channel is chosen for
///     itself.
#[pyfunction]
#[pyo3(signature = (
    scene, *, max_error = None, max_bytes = None, kind = None, size = None, light_index = 0,
    backend = "auto", progress = None, **tables,
))]
#[allow(clippy::too_many_arguments)]
pub fn choose(
    scene: &Bound<'_, PyAny>,
    max_error: Option<f64>,
    max_bytes: Option<&Bound<'_, PyAny>>,
    kind: Option<&str>,
    size: Option<u32>,
    light_index: usize,
    backend: &str,
    progress: Option<&Bound<'_, PyAny>>,
    tables: Option<&Bound<'_, PyDict>>,
) -> PyResult<ShadowMap> {
    let py = scene.py();
    let mut limits = Limits::default();
    limits.error = max_error;
    limits.size = size;
    limits.kind = kind.map(str::parse).transpose().map_err(raised)?;
    if max_error.is_some_and(|error| !(error > 0.0 && error.is_finite())) {
        return Err(value("max_error", "is not above 0"));
    }
    if let Some(given) = max_bytes {
        let text: String = given.str()?.extract()?;
        limits.budget = Some(text.parse().map_err(raised)?);
    }
    if limits.error.is_none() && limits.budget.is_none() {
        return Err(value("max_error, max_bytes", "give one of them, or both"));
    }
    let request = scene_of(scene, tables)?.request(py)?;
    done(py, progress, |watch| {
        let loaded = request.load()?;
        let settings = loaded.map_settings();
        // What the scene says is given too.
        let shadow = &loaded.file.shadow;
        limits.kind = limits.kind.or(shadow.map.as_ref().and(settings.map.kind));
        limits.size = limits.size.or(shadow.size);
        limits.own_tolerance = shadow.tolerance.is_some();
        let backend = loaded.backend(backend, limits.kind)?;
        let mut parts = Vec::new();
        let mut kinds = Vec::new();
        for beam in beams_of(&loaded.scene, light_index)? {
            let found = compare::choose(&*backend, &beam, &settings, &limits, |_| true, watch)?;
            found.map.prepare();
            kinds.push(found.settings.map.kind.unwrap_or_default().to_string());
            parts.push(Part { beam, map: found.map, certificate: Some(found.certificate) });
        }
        kinds.dedup();
        let (window, media) = (settings.map.filter.window().0, loaded.scene.media);
        let (kind, by) = (kinds.join(", "), backend.description());
        Ok(ShadowMap { parts, window, media, kind, by })
    })
}

/// The beams of one of a scene's lights.
fn beams_of(scene: &Scene, light_index: usize) -> Result<Vec<Beam>> {
    let lights = scene.lights.len();
    if light_index >= lights {
        let why = format!("{light_index} is none of the scene's {lights} lights, from 0 on");
        return Err(Error::value("light_index", why));
    }
    Ok(scene.beams()?.into_iter().filter(|beam| beam.index == light_index).collect())
}

/// What answers for one view of the light, in one channel or all.
struct Part {
    beam: Beam,
    map: Map,
    certificate: Option<String>,
}

/// A shadow map of one light: transmittance from the light to every point.
#[pyclass(module = "deepshadow", frozen)]
pub struct ShadowMap {
    parts: Vec<Part>,
    window: u32,
    /// What its files say of the scene.
    media: Media,
    /// The kind of map, such as "fragments".
    #[pyo3(get)]
    kind: String,
    /// What built it: the processor or the graphics adapter.
    #[pyo3(get, name = "backend")]
    by: String,
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

    /// What was measured of a map that was chosen, one sentence for each part; None of others.
    #[getter]
    fn certificate(&self) -> Option<String> {
        let each: Option<Vec<&str>> =
            self.parts.iter().map(|part| part.certificate.as_deref()).collect();
        each.map(|each| each.join("\n"))
    }

    /// The numbers of a threshold map: float32 of shape (size, size, 4), the depths where 10, 50 and
    /// 90 % of the light are lost, and the largest opacity A. A depth whose opacity is above A holds
    /// that of a share of A instead: 10, 50 or 85 %.
    #[getter]
    fn thresholds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Map::Threshold(map) = &self.only("thresholds")?.map else {
            return Err(value("thresholds", format!("a '{}' map has none", self.kind)));
        };
        let size = self.size() as usize;
        let flat = PyArray1::from_slice(py, map.texels().as_flattened());
        flat.call_method1("reshape", ((size, size, 4),))
    }

    /// Transmittance, 0..1, from the light to world positions.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (..., 3)
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     float32 of shape (...,), or (..., 3) where extinction is coloured.
    fn transmittance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (points, mut shape) = rows("points", points)?;
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
        if coloured {
            shape.push(3);
        }
        PyArray1::from_vec(py, found).call_method1("reshape", (shape,))
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
        let part = self.only("lists")?;
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

    /// Writes the map as OpenEXR: threshold maps as images, lists as deep images. Of a light with
    /// several maps, each becomes a file with its name in front of the ending, or a layer. The files
    /// appear whole or not at all.
    ///
    /// Returns
    /// -------
    /// list of path
    ///     The files.
    #[pyo3(signature = (path))]
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<Vec<PathBuf>> {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("exr")) {
            return Err(value("path", format!("'{}' does not end in .exr", path.display())));
        }
        done(py, None, |_| {
            let beams: Vec<Beam> = self.parts.iter().map(|part| part.beam.clone()).collect();
            let maps = self.parts.iter().map(|part| NamedMap {
                label: part.beam.label(&beams),
                map: &part.map,
                certificate: part.certificate.as_deref(),
            });
            let maps: Vec<_> = maps.collect();
            let files = encode_maps(&self.media, &maps, &path, false)?;
            write_maps(&files, &Inputs::default())?;
            Ok(files.into_iter().map(|file| file.path).collect())
        })
    }

    fn __repr__(&self) -> String {
        let (size, bytes) = (self.size(), self.bytes());
        format!("<ShadowMap '{}' of {size} x {size} texels, {bytes} bytes>", self.kind)
    }
}

impl ShadowMap {
    /// The map, if the light has a single one.
    fn only(&self, what: &str) -> PyResult<&Part> {
        match &self.parts[..] {
            [only] => Ok(only),
            parts => {
                let why = format!("the light has {} maps, of views or colours", parts.len());
                Err(value(what, why))
            }
        }
    }

    /// Sets the shares of the light that arrive at a point, of one channel or of three.
    fn light(&self, point: DVec3, values: &mut [f32]) {
        for Part { beam, map, .. } in &self.parts {
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
