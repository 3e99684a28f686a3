//! Loads the surfaces that `[mesh]` and `[hair]` tables name, and places them in the world.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::dense::DEFAULT_MAX_BYTES;
use super::format::Format;
use super::load::Motion;
use super::surface::{SurfaceFile, read_surface, surface_up};
use crate::error::{Error, Result};
use crate::scene::file::{HairTable, MeshTable};
use crate::scene::{SceneFile, Shape, Surface, Surfaces};
use crate::volume::Axis;

/// Loads the surfaces of all `[mesh]` and `[hair]` tables of `file`, in this order. The strings say
/// what was left out or assumed.
///
/// # Errors
/// If a file cannot be read or is not what its table says, or if a value is out of its range.
pub fn load_surfaces(file: &SceneFile) -> Result<(Surfaces, Vec<String>)> {
    let (mut surfaces, mut notes) = (Vec::new(), Vec::new());
    for table in file.mesh.iter() {
        surfaces.push(load_mesh(table, &mut notes)?);
    }
    for table in file.hair.iter() {
        surfaces.push(load_hair(table, &mut notes)?);
    }
    Ok((surfaces.into(), notes))
}

fn load_mesh(table: &MeshTable, notes: &mut Vec<String>) -> Result<Surface> {
    let path = named("mesh", table.path.as_ref())?;
    let SurfaceFile::Mesh(mesh) = read(path, notes)? else {
        return Err(Error::contents(path, "hair, which belongs in a [[hair]] table"));
    };
    let mesh = mesh.with_material(table.albedo.map(DVec3::from), table.opacity)?;
    let motion = Motion {
        what: "mesh",
        translate: table.translate,
        rotate_degrees: table.rotate_degrees,
        scale: table.scale,
    };
    let shape = Shape::Mesh(Arc::new(mesh));
    placed(shape, path, table.up.as_ref(), &motion, table.casts)
}

fn load_hair(table: &HairTable, notes: &mut Vec<String>) -> Result<Surface> {
    let path = named("hair", table.path.as_ref())?;
    let SurfaceFile::Strands(strands) = read(path, notes)? else {
        return Err(Error::contents(path, "a mesh, which belongs in a [[mesh]] table"));
    };
    let albedo = table.albedo.map(DVec3::from);
    let strands = strands.with_values(table.thickness, table.opacity, albedo)?;
    let motion = Motion {
        what: "hair",
        translate: table.translate,
        rotate_degrees: table.rotate_degrees,
        scale: table.scale,
    };
    let shape = Shape::Strands(Arc::new(strands));
    placed(shape, path, table.up.as_ref(), &motion, table.casts)
}

fn named<'a>(what: &str, path: Option<&'a PathBuf>) -> Result<&'a Path> {
    path.map(PathBuf::as_path).ok_or_else(|| Error::value(what, "give a path"))
}

fn read(path: &Path, notes: &mut Vec<String>) -> Result<SurfaceFile> {
    let (file, said) = read_surface(path, DEFAULT_MAX_BYTES)?;
    notes.extend(said);
    Ok(file)
}

/// A surface whose axis `up` points up in the world, moved.
fn placed(
    shape: Shape,
    path: &Path,
    up: Option<&String>,
    motion: &Motion<'_>,
    casts: Option<bool>,
) -> Result<Surface> {
    let up: Axis = match up {
        Some(name) => name.parse()?,
        None => surface_up(Format::of_file(path)?),
    };
    let turn = DMat4::from_mat3(up.world_from_file());
    let mut surface = Surface::new(shape, motion.matrix()? * turn)?;
    surface.casts = casts.unwrap_or(true);
    Ok(surface)
}
