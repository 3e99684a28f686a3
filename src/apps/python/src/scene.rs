//! Scenes: the tables of a scene file, with volumes, meshes and hair that are in memory or in files.

use std::path::{Path, PathBuf};

use deepshadow::io::{Described, frames_of};
use deepshadow::scene::SceneFile;
use deepshadow::scene::automatic::Surroundings;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors::{raised, value};
use crate::held::{Held, is_memory};
use crate::keywords::{given_tables, hold};
use crate::loading::Request;
use crate::mesh::Mesh;
use crate::strands::Strands;
use crate::tables::{overlaid, table_of};
use crate::work::done;

/// A scene: what a picture shows, and how it is computed. What is left out is chosen for the volume
/// at hand.
///
/// Parameters
/// ----------
/// source : Volume, array_like of shape (z, y, x), Mesh, Strands, path-like, str, or dict
///     What casts shadows, the path of a file that the program renders (also a scene file, .toml,
///     and the name of a sequence, "smoke.####.vdb"), the name of a preset ("bucky", "clouds",
///     "rods", "box"), or the tables of a scene file.
/// volume, hair, mesh, light, ambient, camera, image, shadow, ground, background : dict or list
///     Tables of a scene file, with its keys; they are laid over those of `source`. A `volume`, a
///     `mesh` and `hair` may also be what is in memory, and so may the key "array" in their tables.
/// size : int or (width, height)
///     Pixels of the picture.
/// map : str
///     Kind of shadow map: "fragments" (the default), "threshold", ...
/// transfer : str or dict
///     Transfer function: a name ("auto", "fire", ...) or the keys of `volume.transfer`.
/// frame : int
///     The number of a frame, where the scene is a sequence.
///
/// The keys of the tables, each of which may be left out:
///
/// - volume: path (or array, or preset), grid, density_scale, albedo, tint, phase_g, window, up, clip,
///   bounds, spacing, translate, rotate_degrees, scale, transfer (name, file, points, range,
///   gradient), emission (grid, colors, range, kelvin, radiance), keyframes
/// - mesh and hair: path (or array), albedo, opacity, up, translate, rotate_degrees, scale, casts,
///   receives, keyframes; of hair also thickness, specular, shininess
/// - light: kind ("directional", "point", "spot"), direction, position, irradiance, cone_degrees,
///   cone_softness, keyframes
/// - camera: position, target, up, azimuth_degrees, elevation_degrees, distance, zoom, fit,
///   fov_y_degrees, kind ("perspective", "orthographic"), height, keyframes
/// - image: width, height, samples, tolerance, exposure, tonemap
/// - shadow: map, size, tolerance, quality, steps, view_steps, filter, bias, slices, truncation,
///   links, coverage, memory, thresholds, crossing, lookup, shading, light_samples, octaves
/// - ground: enabled, height, albedo, half_extent
/// - ambient and background: radiance
///
/// `light` and `camera` may also be three numbers: the way the light travels (of several lights, a
/// list of such), and the camera's position. `ground=None`, `background=...` as in scene files.
#[pyclass(module = "deepshadow", frozen)]
pub struct Scene {
    described: Described,
    held: Held,
    frame: Option<i64>,
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source = None, *, frame = None, **tables))]
    pub fn new(
        source: Option<&Bound<'_, PyAny>>,
        frame: Option<i64>,
        tables: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut own = match source {
            None => Self::of_file(SceneFile::default(), Held::default())?,
            Some(source) => Self::of(source)?,
        };
        own.frame = frame.or(own.frame);
        let Some(tables) = tables else { return Ok(own) };
        let Self { described, mut held, frame } = own;
        let over = given_tables(tables, &mut held)?;
        let file = overlaid(&described.file, over)?;
        Ok(Self { described: Described { file, ..described }, held, frame })
    }

    /// The numbers of the frames, where the scene is a sequence; empty where it is not.
    #[getter]
    fn frames(&self) -> PyResult<Vec<i64>> {
        Ok(frames_of(&self.described.file).map_err(raised)?.unwrap_or_default())
    }

    /// The same scene with everything chosen that its frames must have in common, so that nothing
    /// flickers when they are rendered one by one, on whatever machines. Exposure and tone curve are
    /// not among it.
    ///
    /// Parameters
    /// ----------
    /// frames : sequence of int, optional
    ///     The frames that are looked at; `frames`, all that there are, by default.
    /// turns : int, optional
    ///     The camera goes once around in so many frames, 2 or more. Of a scene without frames they
    ///     are 1 to `turns`; `frames` of the result has one more, which is the first again.
    /// progress : callable, optional
    ///     As of `render`.
    ///
    /// Returns
    /// -------
    /// Scene
    #[pyo3(signature = (frames = None, *, turns = None, progress = None))]
    fn shot(
        &self,
        py: Python<'_>,
        frames: Option<Vec<i64>>,
        turns: Option<u32>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let request = self.request(py)?;
        let described = done(py, progress, |_| request.shot(frames, turns))?;
        Ok(Self { described, held: self.held.copy(py), frame: self.frame })
    }

    /// The text of a scene file (TOML) with this scene's tables.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If something is in memory: write it, and name its file.
    fn to_toml(&self) -> PyResult<String> {
        if self.has_arrays() {
            return Err(in_memory());
        }
        self.absolute()?.to_text().map_err(raised)
    }

    /// The scene of a scene file's text (TOML). Paths in it are relative to `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, folder = PathBuf::new()))]
    fn from_toml(text: &str, folder: PathBuf) -> PyResult<Self> {
        let file = SceneFile::parse(text, &folder.join("scene.toml")).map_err(raised)?;
        Self::of_file(file, Held::default())
    }

    /// Pickles hold volumes, meshes and strands that are in memory, and absolute paths of files.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let restore = py.get_type::<Self>().getattr("_restored")?;
        let text = self.absolute()?.to_text().map_err(raised)?;
        Ok((restore, (text, self.described.notes.clone(), self.frame, self.held.pairs(py)?)))
    }

    #[staticmethod]
    fn _restored(
        text: &str,
        notes: Vec<String>,
        frame: Option<i64>,
        pairs: Vec<(PathBuf, Bound<'_, PyAny>)>,
    ) -> PyResult<Self> {
        let file = SceneFile::parse(text, Path::new("scene.toml")).map_err(raised)?;
        let held = Held::of_pairs(pairs)?;
        let described = Described::of_file(file).map_err(raised)?;
        Ok(Self { described: Described { notes, ..described }, held, frame })
    }

    fn __repr__(&self) -> String {
        let file = &self.described.file;
        let (volumes, lights) = (file.volume.len(), file.light.len().max(1));
        let surfaces = file.surfaces().count();
        format!("<Scene: volumes {volumes}, surfaces {surfaces}, lights {lights}>")
    }
}

/// The scene of an argument: a scene, or what [`Scene::new`] takes, with tables laid over it. The
/// keyword `frame` may be among the tables.
pub fn scene_of(source: &Bound<'_, PyAny>, tables: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
    let Some(tables) = tables else { return Scene::new(Some(source), None, None) };
    let rest = tables.copy()?;
    let frame = rest.get_item("frame")?.map(|frame| frame.extract::<Option<i64>>()).transpose()?;
    if frame.is_some() {
        rest.del_item("frame")?;
    }
    Scene::new(Some(source), frame.flatten(), Some(&rest))
}

/// What a pickle of a scene holds: its scene file, notes, frame, and what is in memory.
type Pickled<'py> = (String, Vec<String>, Option<i64>, Vec<(PathBuf, Bound<'py, PyAny>)>);

/// Names of what is in memory are no paths.
fn keep_memory(path: &mut Option<PathBuf>, before: &Option<PathBuf>) {
    if before.as_ref().is_some_and(|before| is_memory(before)) {
        path.clone_from(before);
    }
}

/// The error for a scene that no file can hold.
pub fn in_memory() -> PyErr {
    value("scene", "something is in memory; write it, and make a scene of its file")
}

impl Scene {
    fn of_file(file: SceneFile, held: Held) -> PyResult<Self> {
        Ok(Self { described: Described::of_file(file).map_err(raised)?, held, frame: None })
    }

    /// The scene of what is not one yet, without further tables.
    fn of(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut held = Held::default();
        if let Ok(own) = source.cast::<Self>() {
            let own = own.get();
            let (described, held) = (own.described.clone(), own.held.copy(source.py()));
            return Ok(Self { described, held, frame: own.frame });
        }
        let tables = if let Ok(tables) = source.cast::<PyDict>() {
            given_tables(tables, &mut held)?
        } else if source.is_instance_of::<PyString>() || source.hasattr("__fspath__")? {
            let input: PathBuf = source.extract()?;
            let described = Described::of(&input.to_string_lossy(), false).map_err(raised)?;
            return Ok(Self { described, held, frame: None });
        } else {
            let (tables, table) = (PyDict::new(source.py()), PyDict::new(source.py()));
            let name = match source {
                _ if source.is_instance_of::<Mesh>() => "mesh",
                _ if source.is_instance_of::<Strands>() => "hair",
                _ => "volume",
            };
            hold(name, source, &table, &mut held)?;
            tables.set_item(name, table)?;
            table_of(&tables)?
        };
        Self::of_file(overlaid(&SceneFile::default(), tables)?, held)
    }

    /// The scene file with absolute paths, whatever is in memory, which says what surrounds it.
    fn absolute(&self) -> PyResult<SceneFile> {
        let own = &self.described.file;
        let mut file = own.with_absolute_paths().map_err(raised)?;
        let volumes = file.volume.iter_mut().map(|table| &mut table.path);
        for (path, before) in volumes.zip(own.volume.iter().map(|table| &table.path)) {
            keep_memory(path, before);
        }
        let surfaces = file.surfaces_mut().map(|table| &mut table.path);
        for (path, before) in surfaces.zip(own.surfaces().map(|(_, table)| &table.path)) {
            keep_memory(path, before);
        }
        // Tables that were given as keywords do not change it.
        if Surroundings::of(&file) != self.described.surroundings {
            file.surroundings = Some(self.described.surroundings);
        }
        Ok(file)
    }

    /// Whether something is in memory.
    pub fn has_arrays(&self) -> bool {
        !self.held.is_empty()
    }

    /// What is needed to load the scene.
    pub fn request(&self, py: Python<'_>) -> PyResult<Request> {
        let (described, taken) = (self.described.clone(), self.held.taken(py)?);
        Ok(Request { described, taken, frame: self.frame })
    }
}
