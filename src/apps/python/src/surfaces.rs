//! Files of meshes and hair.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deepshadow::io::dense::DEFAULT_MAX_BYTES;
use deepshadow::io::{
    Format, Inputs, PendingFile, SurfaceFile, encode_gltf, encode_hair, read_surface_as, surface_up,
};
use deepshadow::{Error, Result};
use pyo3::prelude::*;

use crate::errors::raised;
use crate::mesh::Mesh;
use crate::strands::Strands;
use crate::work::done;

/// Reads the hair (.hair, .tfx) or the mesh (.obj, .gltf, .glb) in the file `path`.
///
/// Parameters
/// ----------
/// path : path-like
/// max_bytes : int
///     Largest number of bytes that the file and what is made of it may take; 4 GiB by default.
///
/// Returns
/// -------
/// Mesh or Strands
///     In the file's own unit and axes; `up` says which axis points up.
#[pyfunction]
#[pyo3(signature = (path, *, max_bytes = DEFAULT_MAX_BYTES))]
pub fn read_surface(py: Python<'_>, path: PathBuf, max_bytes: u64) -> PyResult<Py<PyAny>> {
    let (file, notes, up) = done(py, None, |_| {
        let format = Format::of_file(&path)?;
        let (file, notes) = read_surface_as(&path, format, max_bytes)?;
        Ok((file, notes, surface_up(format)))
    })?;
    Ok(match file {
        SurfaceFile::Mesh(mesh) => {
            Py::new(py, Mesh { mesh: Arc::new(mesh), up, notes })?.into_any()
        }
        SurfaceFile::Strands(strands) => {
            Py::new(py, Strands { strands: Arc::new(strands), up, notes })?.into_any()
        }
    })
}

/// Writes a mesh to a .glb, or strands to a .hair.
pub fn write_surface(py: Python<'_>, path: &Path, object: &Bound<'_, PyAny>) -> PyResult<()> {
    let is = |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let wrong = |what: &str, ending: &str| {
        let why = format!("the name of a file of {what} must end in {ending}");
        raised(Error::contents(path, why))
    };
    let encode: Box<dyn FnOnce() -> Result<Vec<u8>> + Send> = match object.cast::<Mesh>() {
        Ok(_) if !is("glb") => return Err(wrong("a mesh", ".glb")),
        Ok(mesh) => {
            let (mesh, up) = (mesh.get().mesh.clone(), mesh.get().up);
            Box::new(move || encode_gltf(&mesh, up))
        }
        Err(_) if !is("hair") => return Err(wrong("strands", ".hair")),
        Err(_) => {
            let strands = object.cast::<Strands>()?.get();
            let (strands, up) = (strands.strands.clone(), strands.up);
            Box::new(move || encode_hair(&strands, up))
        }
    };
    done(py, None, |_| {
        let file = PendingFile::create(path, &Inputs::default())?;
        file.finish_with(&encode()?)
    })
}
