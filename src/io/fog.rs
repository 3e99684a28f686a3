//! Renders OpenVDB grids as volumes: which grid of a file, where its medium is, level sets as fog.

use std::path::Path;

use glam::{DMat4, DVec3, IVec3};
use ndarray::Array3;

use super::number::{is_beyond_f32, too_large};
use super::vdb::{AnyValue, Grid, GridHeader, IndexBox, Transform, ValueType, VdbFile};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::volume::{Levels, Volume, Voxels};

/// What a grid's numbers mean, where the user overrides the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Distances to a surface, negative inside.
    LevelSet,
    /// Densities.
    Fog,
}

impl Class {
    /// OpenVDB's name of the class.
    pub fn name(self) -> &'static str {
        match self {
            Self::LevelSet => "level set",
            Self::Fog => "fog volume",
        }
    }
}

impl std::str::FromStr for Class {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "level-set" => Ok(Self::LevelSet),
            "fog" => Ok(Self::Fog),
            _ => Err(Error::value("class", format!("'{text}' is not one of level-set, fog"))),
        }
    }
}

/// The note on numbers that look like distances but are treated as densities.
pub(super) const DISTANCES: &str = "looks like signed distances but is drawn as densities, inside out (`volume.class = level-set`)";

/// The density of a level set: 1 inside, 0 outside, a linear edge of one voxel across the surface.
pub(super) fn fog(distance: f32, voxel: f32) -> f32 {
    (0.5 - distance / voxel).clamp(0.0, 1.0)
}

/// The index of the wanted grid: `name` (`density`, `density[1]`, empty for an unnamed one) or,
/// without a name, `density`, else the first grid of numbers, else the first that loads.
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

/// Which grid of a file is wanted, and how its values become densities.
pub(super) struct Wanted<'a> {
    /// The grid's name; `None` for the one that [`chosen`] takes.
    pub grid: Option<&'a str>,
    /// What its numbers mean, if it differs from what the file says.
    pub class: Option<Class>,
    /// The largest number of bytes for its voxels.
    pub max_bytes: u64,
    /// How stored numbers become densities.
    pub levels: Levels,
}

/// The volume of a grid. Its medium extends one voxel beyond the active bounding box, where it is
/// interpolated to the background. A level set becomes fog: density 1 inside, 0 outside, with a
/// linear edge of one voxel across the surface. An empty grid becomes one voxel without medium.
///
/// # Errors
/// If the file cannot be read, has no such grid, or its voxels take more memory than allowed.
pub(super) fn load(path: &Path, wanted: &Wanted<'_>, notes: &mut Vec<String>) -> Result<Volume> {
    let chosen = Chosen::open(path, wanted.grid)?;
    let Chosen { name, world_from_index, level_set, grid, bounds, others } = chosen;
    let Some(bounds) = bounds else {
        if !others.is_empty() {
            let others = others.join(", ");
            notes.push(format!(
                "grid '{name}' is empty; the file also has {others} (`volume.grid`)"
            ));
        }
        let nothing = Voxels::Dense(Array3::zeros((1, 1, 1)));
        return placed(&name, nothing, IVec3::ZERO, &world_from_index, wanted.levels);
    };
    if let AnyValue::Double(_) | AnyValue::Vec3d(_) = grid.background()
        && let Some(all) = grid.statistics().iter().find(|all| is_beyond_f32(all.max))
    {
        return Err(Error::contents(path, too_large(all.max)));
    }
    let level_set = wanted.class.map_or(level_set, |class| class == Class::LevelSet);
    let voxel = world_from_index.transform_vector3(DVec3::X).length() as f32;
    let number = |value| if level_set { fog(value, voxel) } else { value };
    let voxels = grid.voxels(bounds, wanted.max_bytes, number)?;
    let around = match grid.background() {
        AnyValue::Float(value) => value,
        AnyValue::Double(value) => value as f32,
        AnyValue::Half(value) => f64::from(value) as f32,
        _ => 0.0,
    };
    drop(grid);
    if !level_set && wanted.class.is_none() && around > 0.0 {
        let [least, most] = voxels.range();
        // In a narrow band, distances end at the background value on both sides.
        if least < 0.0 && least >= -1.5 * around && most <= 1.001 * around {
            notes.push(format!("grid '{name}' {DISTANCES}"));
        }
    }
    placed(&name, voxels, bounds.min, &world_from_index, wanted.levels)
}

/// Loads the three components of a grid of vectors as volumes that are placed as by `load`.
/// Together their voxels take at most `max_bytes`.
///
/// # Errors
/// As `load`, and if the grid has no active voxels or its values are not vectors.
pub fn load_vectors(path: &Path, grid_name: &str, max_bytes: u64) -> Result<[Volume; 3]> {
    let chosen = Chosen::open(path, Some(grid_name))?;
    if chosen.grid.components() != 3 {
        let why = format!("grid '{grid_name}' has one number per voxel, not three");
        return Err(Error::contents(path, why));
    }
    let nothing = || {
        let why = format!("grid '{grid_name}' has no active voxels");
        Error::contents(path, why)
    };
    let bounds = chosen.bounds.ok_or_else(nothing)?;
    let one = |component: usize| {
        let dense = chosen.grid.densify_component(bounds, max_bytes / 3, component)?;
        let (voxels, origin) = (Voxels::Dense(dense.values), dense.origin);
        placed(&chosen.name, voxels, origin, &chosen.world_from_index, Levels::AsStored)
    };
    Ok([one(0)?, one(1)?, one(2)?])
}

/// A chosen grid, with what is needed to render it.
struct Chosen {
    name: String,
    world_from_index: DMat4,
    level_set: bool,
    grid: Grid,
    /// The box of active voxels, enlarged by one voxel on every side; `None` if there are none.
    bounds: Option<IndexBox>,
    /// The file's other grids that are not empty and can be rendered.
    others: Vec<String>,
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
        let bounds = grid.active_bounds().map(|active| active.padded(1));
        let mut others = Vec::new();
        if bounds.is_none() && grid_name.is_none() {
            for (other, header) in file.grids().iter().enumerate() {
                let holds_something = header.refused.is_none()
                    && other != index
                    && file.load(other).is_ok_and(|grid| grid.active_bounds().is_some());
                if holds_something {
                    others.push(format!("'{}'", header.name));
                }
            }
        }
        let name = if header.name.is_empty() { "unnamed" } else { &header.name };
        Ok(Self {
            name: name.to_owned(),
            world_from_index,
            level_set: header.class() == "level set",
            grid,
            bounds,
            others,
        })
    }
}

/// Makes a volume of voxels, whose medium ends at the outermost voxels' centres.
fn placed(
    name: &str,
    voxels: Voxels,
    origin: IVec3,
    world_from_index: &DMat4,
    levels: Levels,
) -> Result<Volume> {
    let last = DVec3::from_array(voxels.dims().map(|n| n as f64)) - 1.0;
    let placed = *world_from_index * DMat4::from_translation(origin.as_dvec3());
    let volume = Volume::with_levels(name, voxels, placed, levels)?;
    if last.min_element() < 1.0 {
        // A single empty voxel has no extent between its centres.
        return Ok(volume);
    }
    Ok(volume.with_domain(Aabb { min: DVec3::ZERO, max: last }))
}
