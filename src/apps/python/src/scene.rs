//! Scenes: the tables of a scene file, with volumes that are in memory or in files.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use deepshadow::io::dense::{DenseGrid, DenseTarget};
use deepshadow::io::number::ValueType;
use deepshadow::io::remap::Remap;
use deepshadow::io::vdb::{Compression, Metadata, NewGrid, VdbWriter};
use deepshadow::io::{self, Described, SceneLoader, at_frame};
use deepshadow::scene::automatic::{Choice, Surroundings, complete};
use deepshadow::scene::{self, SceneFile};
use deepshadow::settings::MapKind;
use deepshadow::{Backend, Result, Settings};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use serde_json::{Map, Value};

use crate::backends::named;
use crate::errors::{raised, value};
use crate::tables::{overlaid, table_of, table_value};
use crate::volume::{Volume, volume_of};

/// A scene: what a picture shows, and how it is computed. What is left out is chosen for the volume
/// at hand.
///
/// Parameters
/// ----------
/// source : Volume, array_like of shape (z, y, x), path-like, str, or dict
///     A volume, the path of a file that the program renders (also a scene file, .toml), the name
///     of a preset ("bucky", "clouds", "rods", "box"), or the tables of a scene file.
/// volume, hair, mesh, light, ambient, camera, image, shadow, ground, background : dict or list
///     Tables of a scene file, with its keys; they are laid over those of `source`. In lists of
///     `volume`, a table may have the key "array" in place of "path".
/// size : int or (width, height)
///     Pixels of the picture.
/// map : str
///     Kind of shadow map: "fragments" (the default), "threshold", ...
/// transfer : str or dict
///     Transfer function: a name ("auto", "fire", ...) or the keys of `volume.transfer`.
///
/// `light` and `camera` may also be three numbers: the way the light travels, and the camera's
/// position. `ground=None`, `background=...` as in scene files.
#[pyclass(module = "deepshadow", frozen)]
pub struct Scene {
    described: Described,
    held: Vec<(PathBuf, Py<Volume>)>,
}

/// Texels along each edge of maps that are made without a picture.
const MAP_SIZE: u32 = 512;
/// Names of tables that may be given as keywords.
const TABLES: [&str; 10] = [
    "volume",
    "hair",
    "mesh",
    "light",
    "ambient",
    "camera",
    "image",
    "shadow",
    "ground",
    "background",
];

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source = None, **tables))]
    pub fn new(
        source: Option<&Bound<'_, PyAny>>,
        tables: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut held = Vec::new();
        let described = match source {
            None => Described::of_file(SceneFile::default()).map_err(raised)?,
            Some(source) => {
                if let Ok(own) = source.cast::<Scene>() {
                    let own = own.get();
                    let py = source.py();
                    held = own.held.iter().map(|(p, v)| (p.clone(), v.clone_ref(py))).collect();
                    own.described.clone()
                } else if let Ok(tables) = source.cast::<PyDict>() {
                    let given = given_tables(tables, &mut held)?;
                    let file = overlaid(&SceneFile::default(), given)?;
                    Described::of_file(file).map_err(raised)?
                } else if source.is_instance_of::<PyString>() || source.hasattr("__fspath__")? {
                    let input: PathBuf = source.extract()?;
                    Described::of(&input.to_string_lossy(), false).map_err(raised)?
                } else {
                    let mut file = SceneFile::default();
                    file.volume.one_mut().path = Some(hold(source, &mut held)?);
                    Described::of_file(file).map_err(raised)?
                }
            }
        };
        let Some(tables) = tables else { return Ok(Self { described, held }) };
        let over = given_tables(tables, &mut held)?;
        let file = overlaid(&described.file, over)?;
        Ok(Self { described: Described { file, ..described }, held })
    }

    /// The text of a scene file (TOML) with this scene's tables.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a volume is in memory: write it, and name its file.
    fn to_toml(&self) -> PyResult<String> {
        if self.has_arrays() {
            return Err(in_memory());
        }
        self.described.file.to_text().map_err(raised)
    }

    /// The scene of a scene file's text (TOML). Paths in it are relative to `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, folder = PathBuf::new()))]
    fn from_toml(text: &str, folder: PathBuf) -> PyResult<Self> {
        let file = SceneFile::parse(text, &folder.join("scene.toml")).map_err(raised)?;
        let described = Described::of_file(file).map_err(raised)?;
        Ok(Self { described, held: Vec::new() })
    }

    fn __repr__(&self) -> String {
        let file = &self.described.file;
        let (volumes, lights) = (file.volume.len(), file.light.len().max(1));
        let surfaces = file.surfaces().count();
        format!("<Scene: volumes {volumes}, surfaces {surfaces}, lights {lights}>")
    }
}

/// The scene of an argument: a scene, or what [`Scene::new`] takes, with tables laid over it.
pub fn scene_of(source: &Bound<'_, PyAny>, tables: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
    Scene::new(Some(source), tables)
}

/// The tables of a scene file from keywords, with the short forms written out.
fn given_tables(
    keywords: &Bound<'_, PyDict>,
    held: &mut Vec<(PathBuf, Py<Volume>)>,
) -> PyResult<Map<String, Value>> {
    let py = keywords.py();
    let tables = PyDict::new(py);
    let table = |name: &str| -> PyResult<Bound<'_, PyDict>> {
        match tables.get_item(name)? {
            Some(table) => match table.cast_into() {
                Ok(table) => Ok(table),
                Err(_) => Err(value(name, "is a list; give its keys in it")),
            },
            None => {
                let table = PyDict::new(py);
                tables.set_item(name, &table)?;
                Ok(table)
            }
        }
    };
    // Whole tables first; what has a name of its own is laid over them.
    for (key, object) in keywords.iter() {
        let name: String = key.extract()?;
        if object.is_none() && name == "ground" {
            table("ground")?.set_item("enabled", false)?;
        } else if TABLES.contains(&name.as_str()) && !object.is_none() {
            tables.set_item(&name, in_full(&name, &object, held)?)?;
        }
    }
    for (key, object) in keywords.iter() {
        let name: String = key.extract()?;
        if object.is_none() || TABLES.contains(&name.as_str()) {
            continue;
        }
        match name.as_str() {
            "size" => {
                let square = object.extract::<u32>().map(|size| [size; 2]);
                let size: [u32; 2] = square.or_else(|_| object.extract()).map_err(|_| {
                    let why = format!("{object} is no number of pixels, and no (width, height)");
                    value("size", why)
                })?;
                let image = table("image")?;
                image.set_item("width", size[0])?;
                image.set_item("height", size[1])?;
            }
            "map" => table("shadow")?.set_item("map", object)?,
            "transfer" if object.is_instance_of::<PyString>() => {
                let transfer = PyDict::new(py);
                transfer.set_item("name", object)?;
                table("volume")?.set_item("transfer", transfer)?;
            }
            "transfer" => table("volume")?.set_item("transfer", object)?,
            _ => {
                let known = format!("{}, size, map, transfer", TABLES.join(", "));
                return Err(value(&name, format!("is not one of {known}")));
            }
        }
    }
    table_of(&tables)
}

/// A table as scene files have it.
fn in_full<'py>(
    name: &str,
    object: &Bound<'py, PyAny>,
    held: &mut Vec<(PathBuf, Py<Volume>)>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = object.py();
    let alone = |key: &str| {
        let table = PyDict::new(py);
        table.set_item(key, object)?;
        Ok(table.into_any())
    };
    let is_table = object.is_instance_of::<PyDict>();
    let is_vector = || object.extract::<[f64; 3]>().is_ok();
    match name {
        "light" if is_vector() => return alone("direction"),
        "camera" if is_vector() => return alone("position"),
        "ambient" | "background" if is_vector() => return alone("radiance"),
        "ground" if object.extract::<f64>().is_ok() => return alone("height"),
        "hair" | "mesh" if object.is_instance_of::<PyString>() => return alone("path"),
        "hair" | "mesh" if object.hasattr("__fspath__")? => return alone("path"),
        "volume" if object.is_instance_of::<PyList>() => {
            let tables = PyList::empty(py);
            for one in object.try_iter()? {
                tables.append(volume_table(&one?, held)?)?;
            }
            return Ok(tables.into_any());
        }
        "volume" => return volume_table(object, held).map(Bound::into_any),
        _ => {}
    }
    if is_table || object.is_instance_of::<PyList>() {
        return Ok(object.clone());
    }
    // For its message.
    table_value(name, object)?;
    Err(value(name, "must be a dictionary with the keys of scene files, or a list of such"))
}

/// The table of a volume: of a dictionary, whose key "array" becomes the name of what is held, of a
/// path, or of an array.
fn volume_table<'py>(
    object: &Bound<'py, PyAny>,
    held: &mut Vec<(PathBuf, Py<Volume>)>,
) -> PyResult<Bound<'py, PyDict>> {
    if let Ok(given) = object.cast::<PyDict>() {
        let table = given.copy()?;
        if let Some(array) = table.get_item("array")? {
            table.del_item("array")?;
            table.set_item("path", hold(&array, held)?)?;
        }
        return Ok(table);
    }
    let table = PyDict::new(object.py());
    if object.is_instance_of::<PyString>() || object.hasattr("__fspath__")? {
        table.set_item("path", object)?;
    } else {
        table.set_item("path", hold(object, held)?)?;
    }
    Ok(table)
}

/// Keeps a volume, and returns the name by which the scene's tables know it.
fn hold(object: &Bound<'_, PyAny>, held: &mut Vec<(PathBuf, Py<Volume>)>) -> PyResult<PathBuf> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let volume = volume_of(object)?;
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    // The files' names are those of volumes.
    let name = match volume.get().grid_name() {
        "" => "array",
        name => name,
    };
    let name: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    let path = Path::new("deepshadow:memory").join(number.to_string()).join(name);
    held.push((path.clone(), volume.unbind()));
    Ok(path)
}

/// A scene that is ready to be loaded, without anything of Python's.
pub struct Request {
    described: Described,
    grids: Vec<(PathBuf, DenseGrid)>,
}

/// A scene that is loaded.
pub struct Loaded {
    pub file: SceneFile,
    pub scene: scene::Scene,
    pub settings: Settings,
    pub windows: Vec<Option<[f32; 2]>>,
    pub choices: Vec<Choice>,
    pub notes: Vec<String>,
}

/// The error for a scene that no file can hold.
pub fn in_memory() -> PyErr {
    value("scene", "a volume is in memory; write it, and make a scene of its file")
}

impl Scene {
    /// Whether volumes are in memory.
    pub fn has_arrays(&self) -> bool {
        !self.held.is_empty()
    }

    /// What is needed to load the scene.
    pub fn request(&self, py: Python<'_>) -> PyResult<Request> {
        let grid = |(path, volume): &(PathBuf, Py<Volume>)| {
            let (grid, _) = volume.get().to_grid(py)?;
            Ok((path.clone(), grid))
        };
        let grids = self.held.iter().map(grid).collect::<PyResult<_>>()?;
        Ok(Request { described: self.described.clone(), grids })
    }
}

impl Loaded {
    /// The backend `name` for maps of `kind` of this scene.
    ///
    /// # Errors
    /// As [`named`].
    pub fn backend(&self, name: &str, kind: Option<MapKind>) -> Result<&'static dyn Backend> {
        named(name, kind.unwrap_or_default(), !self.scene.surfaces.is_empty())
    }

    /// The settings, for maps without a picture.
    pub fn map_settings(&self) -> Settings {
        let mut settings = self.settings.clone();
        if self.file.shadow.size.is_none() {
            settings.map.size = MAP_SIZE;
        }
        settings
    }
}

impl Request {
    /// Loads the volumes and surfaces, and chooses what was left out, as the program does.
    pub fn load(self) -> Result<Loaded> {
        let Self { mut described, grids } = self;
        let _mounted = grids.into_iter().map(Mounted::new).collect::<Result<Vec<_>>>()?;
        if let Some(keyframes) = described.file.keyframes()? {
            described.file = at_frame(&described.file, *keyframes.start())?;
        }
        described.stand_up(&described.file.clone())?;
        let Described { file, surroundings, mut notes } = described;
        let scan = surroundings == Surroundings::Studio;
        let (loaded, said) = SceneLoader::default().load(&file, scan)?;
        notes.extend(said);
        let windows = loaded.volumes.iter().map(|own| own.window).collect();
        let (scene, settings, choices) = complete(&file, loaded, surroundings)?;
        Ok(Loaded { file, scene, settings, windows, choices, notes })
    }
}

/// A grid that this thread reads as a file, for as long as this lives: so arrays are treated as
/// files are.
struct Mounted(PathBuf);

impl Mounted {
    fn new((path, grid): (PathBuf, DenseGrid)) -> Result<Self> {
        // Those of OpenVDB have a background where their array ends, and may be distances.
        let sparse = grid.active.is_some() || grid.background.is_some() || grid.class.is_some();
        io::mount(&path, if sparse { openvdb(grid)? } else { nrrd(grid)? });
        Ok(Self(path))
    }
}

fn openvdb(grid: DenseGrid) -> Result<Vec<u8>> {
    let (place, class) = (grid.world_from_index, grid.class.clone());
    let mut new = NewGrid::new(grid.into_vdb()?, &place);
    if let Some(class) = class {
        new = new.with_class(&class);
    }
    let mut writer = VdbWriter::new(&["density"], Compression::NONE, &Metadata::default());
    writer.add(new)?;
    writer.finish()
}

fn nrrd(grid: DenseGrid) -> Result<Vec<u8>> {
    // NRRD has no halves; floats hold them all.
    let grid = match grid.value_type {
        ValueType::F16 => grid.retyped(ValueType::F32, Remap::Cast)?,
        _ => grid,
    };
    Ok(DenseTarget::Nrrd { detached: false }.encode(&grid))
}

impl Drop for Mounted {
    fn drop(&mut self) {
        io::unmount(&self.0);
    }
}
