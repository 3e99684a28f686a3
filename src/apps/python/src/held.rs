//! What of a scene is in memory: volumes, meshes and hair of Python's. The library reads them as the
//! files that they would be, so that arrays are treated as files are.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use deepshadow::io::dense::{DenseGrid, DenseTarget};
use deepshadow::io::number::ValueType;
use deepshadow::io::remap::Remap;
use deepshadow::io::vdb::{Compression, Metadata, NewGrid, VdbWriter};
use deepshadow::io::{self, encode_gltf, encode_hair};
use deepshadow::volume::Axis;
use deepshadow::{Result, surface};
use pyo3::prelude::*;

use crate::mesh::Mesh;
use crate::strands::Strands;
use crate::volume::{Volume, volume_of};

/// Everything of a scene that is in memory, each with the name by which the scene's tables know it.
#[derive(Default)]
pub struct Held(Vec<(PathBuf, Object)>);

/// The first part of the names of what is in memory.
const MEMORY: &str = "deepshadow:memory";

/// Whether a path is such a name.
pub fn is_memory(path: &Path) -> bool {
    path.starts_with(MEMORY)
}

enum Object {
    Volume(Py<Volume>),
    Mesh(Arc<surface::Mesh>),
    Strands(Arc<surface::Strands>),
}

impl Held {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The same objects.
    pub fn copy(&self, py: Python<'_>) -> Self {
        let object = |object: &Object| match object {
            Object::Volume(volume) => Object::Volume(volume.clone_ref(py)),
            Object::Mesh(mesh) => Object::Mesh(mesh.clone()),
            Object::Strands(strands) => Object::Strands(strands.clone()),
        };
        Self(self.0.iter().map(|(path, own)| (path.clone(), object(own))).collect())
    }

    /// Keeps a volume, or that of an array, and returns its name.
    pub fn volume(&mut self, object: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
        let volume = volume_of(object)?;
        let name = volume.get().grid_name().to_owned();
        Ok(self.keep(&name, Object::Volume(volume.unbind())))
    }

    /// Keeps a mesh, and returns its name.
    pub fn mesh(&mut self, mesh: &Mesh) -> PathBuf {
        self.keep(&mesh.mesh.name, Object::Mesh(mesh.mesh.clone()))
    }

    /// Keeps strands, and returns their name.
    pub fn strands(&mut self, strands: &Strands) -> PathBuf {
        self.keep(&strands.strands.name, Object::Strands(strands.strands.clone()))
    }

    fn keep(&mut self, name: &str, object: Object) -> PathBuf {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        // The files' names are those of what they hold.
        let name = if name.is_empty() { "array" } else { name };
        let name: String =
            name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        // Scenes may come from other processes.
        let number = format!("{}-{number}", std::process::id());
        let path = Path::new(MEMORY).join(number).join(name);
        self.0.push((path.clone(), object));
        path
    }

    /// The names and the objects, for a pickle.
    pub fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Vec<(PathBuf, Bound<'py, PyAny>)>> {
        let pair = |(path, object): &(PathBuf, Object)| {
            let object = match object {
                Object::Volume(volume) => volume.bind(py).clone().into_any(),
                Object::Mesh(mesh) => Bound::new(py, Mesh::of(mesh.clone()))?.into_any(),
                Object::Strands(own) => Bound::new(py, Strands::of(own.clone()))?.into_any(),
            };
            Ok((path.clone(), object))
        };
        self.0.iter().map(pair).collect()
    }

    /// What a pickle had.
    pub fn of_pairs(pairs: Vec<(PathBuf, Bound<'_, PyAny>)>) -> PyResult<Self> {
        let object = |(path, object): (PathBuf, Bound<'_, PyAny>)| {
            let object = if let Ok(mesh) = object.cast::<Mesh>() {
                Object::Mesh(mesh.get().mesh.clone())
            } else if let Ok(strands) = object.cast::<Strands>() {
                Object::Strands(strands.get().strands.clone())
            } else {
                Object::Volume(volume_of(&object)?.unbind())
            };
            Ok((path, object))
        };
        Ok(Self(pairs.into_iter().map(object).collect::<PyResult<_>>()?))
    }

    /// The objects without anything of Python's.
    pub fn taken(&self, py: Python<'_>) -> PyResult<Taken> {
        let each = self.0.iter().map(|(path, object)| {
            let taken = match object {
                Object::Volume(volume) => Content::Grid(Box::new(volume.get().to_grid(py)?.0)),
                Object::Mesh(mesh) => Content::Mesh(mesh.clone()),
                Object::Strands(strands) => Content::Strands(strands.clone()),
            };
            Ok((path.clone(), taken))
        });
        Ok(Taken(each.collect::<PyResult<_>>()?))
    }
}

/// What is in memory, without anything of Python's.
pub struct Taken(Vec<(PathBuf, Content)>);

enum Content {
    Grid(Box<DenseGrid>),
    Mesh(Arc<surface::Mesh>),
    Strands(Arc<surface::Strands>),
}

impl Taken {
    /// Lets this thread read everything as files, for as long as what is returned lives.
    pub fn mounted(self) -> Result<Vec<Mounted>> {
        let each = self.0.into_iter().map(|(path, content)| {
            let bytes = match content {
                Content::Grid(grid) => file_of(*grid)?,
                // As they are: the tables say what points up.
                Content::Mesh(mesh) => encode_gltf(&mesh, Axis::Y)?,
                Content::Strands(strands) => encode_hair(&strands, Axis::Z)?,
            };
            io::mount(&path, bytes);
            Ok(Mounted(path))
        });
        each.collect()
    }
}

/// Something that this thread reads as a file, for as long as this lives.
pub struct Mounted(PathBuf);

impl Drop for Mounted {
    fn drop(&mut self) {
        io::unmount(&self.0);
    }
}

fn file_of(grid: DenseGrid) -> Result<Vec<u8>> {
    // Those of OpenVDB have a background where their array ends, and may be distances.
    let sparse = grid.active.is_some() || grid.background.is_some() || grid.class.is_some();
    if sparse { openvdb(grid) } else { nrrd(grid) }
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
