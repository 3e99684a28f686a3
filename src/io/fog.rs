//! OpenVDB grids as volumes to render: which grid, where its medium is, level sets as fog.

use std::path::Path;

use glam::{DMat4, DVec3};

use super::vdb::{Grid, GridHeader, Transform, ValueType, VdbFile};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::volume::Volume;

/// The grid that is meant of a file: `name` (`density`, `density[1]`, empty for an unnamed
/// one) or, without one, `density`, else the first grid of numbers, else the first that loads.
///
/// # Errors
/// If there is no such grid.
pub fn chosen(file: &VdbFile, name: Option<&str>) -> Result<usize> {
    let names = || {
        let names: Vec<&str> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
        if names.is_empty() {
            "it has no grids".to_owned()
        } else {
            format!("it has {}", names.join(", "))
        }
    };
    if let Some(name) = name {
        let found = file.find(name);
        return found
            .ok_or_else(|| Error::contents(file.path(), format!("no grid '{name}'; {}", names())));
    }
    let loads = |grid: &GridHeader| grid.refused.is_none();
    let is_number = |grid: &GridHeader| {
        use ValueType::{Double, Float, Half, Int32, Int64};
        matches!(grid.value_type, Float | Double | Half | Int32 | Int64)
    };
    let first = |wanted: &dyn Fn(&GridHeader) -> bool| file.grids().iter().position(wanted);
    file.find("density")
        .filter(|&index| loads(&file.grids()[index]))
        .or_else(|| first(&|grid| loads(grid) && is_number(grid)))
        .or_else(|| first(&loads))
        .ok_or_else(|| {
            Error::contents(file.path(), format!("no grid that can be read; {}", names()))
        })
}

/// The volume of a grid, at most `max_bytes` of voxels. Its medium reaches one voxel beyond the
/// active bounding box, where it interpolates against the background. A level set becomes fog:
/// density 1 inside, 0 outside, a linear edge of one voxel across the surface. Values of `window`
/// are mapped to 0..1.
///
/// # Errors
/// If the file cannot be read, has no such grid, or takes more memory.
pub fn load(
    path: &Path,
    grid_name: Option<&str>,
    max_bytes: u64,
    window: Option<[f32; 2]>,
) -> Result<Volume> {
    let file = VdbFile::open(path)?;
    let index = chosen(&file, grid_name)?;
    let header = &file.grids()[index];
    let refused = |why: &str| Error::contents(path, format!("grid '{}': {why}", header.name));
    let world_from_index = match &header.transform {
        Transform::Affine(matrix) => *matrix,
        Transform::Refused(why) => return Err(refused(why)),
    };
    let grid: Grid = file.load(index)?;
    let active = grid.active_bounds().ok_or_else(|| refused("it has no active voxels"))?;
    let mut dense = grid.densify(active.padded(1), max_bytes)?;
    drop(grid);
    if header.class() == "level set" {
        let voxel = world_from_index.transform_vector3(DVec3::X).length() as f32;
        dense.values.mapv_inplace(|distance| (0.5 - distance / voxel).clamp(0.0, 1.0));
    }
    let [x, y, z] = {
        let (z, y, x) = dense.values.dim();
        [x, y, z].map(|n| n as f64 - 1.0)
    };
    let placed = world_from_index * DMat4::from_translation(dense.origin.as_dvec3());
    let name = if header.name.is_empty() { "unnamed" } else { &header.name };
    let volume = Volume::with_window(name, dense.values, placed, window)?;
    Ok(volume.with_domain(Aabb { min: DVec3::ZERO, max: DVec3::new(x, y, z) }))
}
