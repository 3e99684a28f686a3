//! Loads the surfaces that `[mesh]` and `[hair]` tables name, and places them in the world.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::dense::DEFAULT_MAX_BYTES;
use super::format::Format;
use super::load::Motion;
use super::surface::{SurfaceFile, read_surface, surface_up};
use crate::error::{Error, Result};
use crate::scene::file::SurfaceTable;
use crate::scene::{Gloss, SceneFile, Shape, Surface, Surfaces};
use crate::volume::Axis;

/// What a `[mesh]` or `[hair]` table names, before it is placed.
#[derive(Clone, Debug)]
pub struct LoadedShape {
    shape: Shape,
    /// The axis of the file that points up, unless the table says so.
    up: Axis,
}

/// Loads the surfaces of all `[mesh]` and `[hair]` tables of `file`, in this order. The strings say
/// what was left out or assumed.
///
/// # Errors
/// If a file cannot be read or is not what its table says, or if a value is out of its range.
pub fn load_surfaces(file: &SceneFile) -> Result<(Surfaces, Vec<String>)> {
    let mut notes = Vec::new();
    let loaded = file.surfaces().map(|(what, table)| {
        let (shape, said) = load_shape(what, table)?;
        notes.extend(said);
        place_shape(what, table, &shape)
    });
    let surfaces = loaded.collect::<Result<Vec<_>>>()?;
    Ok((surfaces.into(), notes))
}

/// Loads what the table `what` (`mesh` or `hair`) names, with its values of what it is made of. The
/// strings say what was left out or assumed.
///
/// # Errors
/// As [`load_surfaces`].
pub fn load_shape(what: &str, table: &SurfaceTable) -> Result<(LoadedShape, Vec<String>)> {
    let Some(path) = &table.path else { return Err(Error::value(what, "give a path")) };
    let (file, notes) = read_surface(path, DEFAULT_MAX_BYTES)?;
    let albedo = table.albedo.map(DVec3::from);
    let shape = match (file, what) {
        (SurfaceFile::Mesh(_), "mesh") if of_hair(table).is_some() => {
            let key = of_hair(table).unwrap_or_default();
            return Err(Error::value(format!("mesh.{key}"), "does not apply to meshes"));
        }
        (SurfaceFile::Mesh(mesh), "mesh") => {
            Shape::Mesh(Arc::new(mesh.with_material(albedo, table.opacity)?))
        }
        (SurfaceFile::Strands(strands), "hair") => {
            Shape::Strands(Arc::new(strands.with_values(table.thickness, table.opacity, albedo)?))
        }
        (SurfaceFile::Mesh(_), _) => {
            return Err(Error::contents(path, "a mesh, which belongs in a [[mesh]] table"));
        }
        (SurfaceFile::Strands(_), _) => {
            return Err(Error::contents(path, "hair, which belongs in a [[hair]] table"));
        }
    };
    Ok((LoadedShape { shape, up: surface_up(Format::of_file(path)?) }, notes))
}

/// Places what was loaded for the table `what` where that says.
///
/// # Errors
/// If a value of `table` is out of its range.
pub fn place_shape(what: &str, table: &SurfaceTable, loaded: &LoadedShape) -> Result<Surface> {
    let up = table.up.as_deref().map_or(Ok(loaded.up), str::parse)?;
    let SurfaceTable { translate, rotate_degrees, scale, .. } = *table;
    let motion = Motion { what, translate, rotate_degrees, scale };
    let turn = DMat4::from_mat3(up.world_from_file());
    let mut surface = Surface::new(loaded.shape.clone(), motion.matrix()? * turn)?;
    surface.casts = table.casts.unwrap_or(true);
    surface.receives = table.receives.unwrap_or(true);
    let Gloss { specular, shininess } = Gloss::default();
    let (specular, shininess) =
        (table.specular.unwrap_or(specular), table.shininess.unwrap_or(shininess));
    if !(0.0..=1.0).contains(&specular) {
        return Err(Error::value(format!("{what}.specular"), format!("{specular} is not in 0..1")));
    }
    if !(1.0..=1e5).contains(&shininess) {
        let why = format!("{shininess} is not in 1..100000");
        return Err(Error::value(format!("{what}.shininess"), why));
    }
    surface.gloss = Gloss { specular, shininess };
    Ok(surface)
}

/// A key of `table` that applies to hair alone.
fn of_hair(table: &SurfaceTable) -> Option<&'static str> {
    let keys = [
        ("thickness", table.thickness.is_some()),
        ("specular", table.specular.is_some()),
        ("shininess", table.shininess.is_some()),
    ];
    keys.into_iter().find(|(_, given)| *given).map(|(key, _)| key)
}
