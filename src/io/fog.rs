//! OpenVDB grids as volumes to render: which grid, where its medium is, level sets as fog.

use std::path::Path;

use glam::{DMat4, DVec3, IVec3};

use super::vdb::{Grid, GridHeader, IndexBox, Transform, ValueType, VdbFile};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::volume::{Volume, Voxels};

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
    let chosen = Chosen::open(path, grid_name)?;
    let Chosen { name, world_from_index, level_set, grid, bounds } = chosen;
    let voxel = world_from_index.transform_vector3(DVec3::X).length() as f32;
    let fog = |distance: f32| (0.5 - distance / voxel).clamp(0.0, 1.0);
    let voxels =
        grid.voxels(bounds, max_bytes, |value| if level_set { fog(value) } else { value })?;
    drop(grid);
    placed(&name, voxels, bounds.min, &world_from_index, window)
}

/// The three components of a grid of vectors, as [`load`] places volumes; at most `max_bytes` of voxels
/// together.
///
/// # Errors
/// As [`load`], and if its values are no vectors.
pub fn load_vectors(path: &Path, grid_name: &str, max_bytes: u64) -> Result<[Volume; 3]> {
    let chosen = Chosen::open(path, Some(grid_name))?;
    if chosen.grid.components() != 3 {
        let why = format!("grid '{grid_name}' has one number a voxel, not three");
        return Err(Error::contents(path, why));
    }
    let one = |component: usize| {
        let dense = chosen.grid.densify_component(chosen.bounds, max_bytes / 3, component)?;
        let (voxels, origin) = (Voxels::Dense(dense.values), dense.origin);
        placed(&chosen.name, voxels, origin, &chosen.world_from_index, None)
    };
    Ok([one(0)?, one(1)?, one(2)?])
}

/// A grid of a file and what is needed to render it.
struct Chosen {
    name: String,
    world_from_index: DMat4,
    level_set: bool,
    grid: Grid,
    /// One voxel beyond what is active.
    bounds: IndexBox,
}

impl Chosen {
    fn open(path: &Path, grid_name: Option<&str>) -> Result<Self> {
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
        let name = if header.name.is_empty() { "unnamed" } else { &header.name };
        Ok(Self {
            name: name.to_owned(),
            world_from_index,
            level_set: header.class() == "level set",
            grid,
            bounds: active.padded(1),
        })
    }
}

/// Values as a volume whose medium ends at the outermost voxels' centres.
fn placed(
    name: &str,
    voxels: Voxels,
    origin: IVec3,
    world_from_index: &DMat4,
    window: Option<[f32; 2]>,
) -> Result<Volume> {
    let last = DVec3::from_array(voxels.dims().map(|n| n as f64)) - 1.0;
    let placed = *world_from_index * DMat4::from_translation(origin.as_dvec3());
    let volume = Volume::with_window(name, voxels, placed, window)?;
    Ok(volume.with_domain(Aabb { min: DVec3::ZERO, max: last }))
}
