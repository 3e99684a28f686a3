//! Loads the volume that a `[volume]` table names, from a preset or a file, and places it in the
//! world.

use std::path::{Path, PathBuf};

use glam::{DMat4, DQuat, DVec3};

use super::dense::{DenseFile, Space};
use super::fog;
use super::format::Format;
use super::options::ReadOptions;
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::scene::descriptor;
use crate::scene::file::VolumeTable;
use crate::volume::presets::Preset;
use crate::volume::{Axis, Levels, Volume, world_from_index_in_bounds};

/// Loads the volume in the file `path`: in the format that its first bytes tell, the grid that
/// looks most like densities, at the file's own place in the world. Stored values become densities;
/// negative and non-finite ones count as 0.
///
/// [`load_volume`] does the same with everything that a scene file can say about a volume, such as
/// the dims of a raw file or a window. [`load_ingredients`](super::load_ingredients) also chooses a
/// window for a scan in noisy surroundings, as the program does.
///
/// ```
/// use deepshadow::{Scene, io};
///
/// let volume = io::open("tests/fixtures/vdb/bumps.vdb")?;
/// let scene = Scene::automatic(volume)?;
/// # assert_eq!(scene.lights.len(), 1);
/// # Ok::<(), deepshadow::Error>(())
/// ```
///
/// # Errors
/// If there is no such file, if no format is recognised in it, or if it holds nothing that a volume
/// can represent.
pub fn open(path: impl AsRef<Path>) -> Result<Volume> {
    let path = Some(path.as_ref().to_owned());
    load_volume(&VolumeTable { path, ..VolumeTable::default() })
}

/// Loads the volume that `table` names and places it as `table` says.
///
/// # Errors
/// If there is no such preset or file, if the file is not of the expected format, or if a value of
/// `table` is invalid.
pub fn load_volume(table: &VolumeTable) -> Result<Volume> {
    load_noted(table, table.window.into(), &mut Facts::default())
}

/// What a file tells besides its voxels.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// Assumptions that were made where the file is ambiguous, as text.
    pub notes: Vec<String>,
    /// Whether the file says that it comes from a CT scanner; `None` if it does not say.
    pub of_ct: Option<bool>,
}

/// Like [`load_volume`], but with densities by `levels` in place of the table's window, and with
/// what else the file tells.
pub(super) fn load_noted(table: &VolumeTable, levels: Levels, facts: &mut Facts) -> Result<Volume> {
    let up = table.up.as_deref().map(str::parse::<Axis>).transpose()?;
    let volume = match (&table.preset, &table.path) {
        (Some(_), Some(_)) => return Err(Error::value("volume", "give path or preset, not both")),
        (None, None) => return Err(Error::value("volume", "give path or preset")),
        (Some(preset), None) => {
            let keys = ["dims", "type", "endian", "spacing", "grid", "from", "class"];
            ReadOptions::of(table)?.refuse("a preset", &keys)?;
            let preset: Preset = preset.parse()?;
            let usual = || preset_axis(preset);
            let volume = preset.volume(up.map_or_else(usual, Ok)?)?;
            if levels == Levels::AsStored { volume } else { volume.levelled(levels)? }
        }
        (None, Some(path)) => load_file(path, &ReadOptions::of(table)?, up, levels, facts)?,
    };
    let volume = match table.bounds {
        Some(_) if sparse(&volume) => {
            let why = "applies only to dense volumes; a sparse grid keeps its own transform";
            Err(Error::value("volume.bounds", why))
        }
        Some([min, max]) => {
            let bounds = Aabb { min: min.into(), max: max.into() };
            let placement =
                world_from_index_in_bounds(volume.dims(), &bounds, up.unwrap_or_default())?;
            volume.placed(placement)
        }
        None => Ok(volume),
    };
    let volume = moved(volume?, table)?;
    match table.clip {
        Some(clip) => volume.clipped(clip),
        None => Ok(volume),
    }
}

/// The index axis of a preset that points up.
fn preset_axis(preset: Preset) -> Result<Axis> {
    let file = descriptor(preset)?;
    let up = file.volume.iter().find_map(|table| table.up.as_deref());
    Ok(up.map(str::parse).transpose()?.unwrap_or_default())
}

/// All files from which the volume of `table` is read: its own, others that hold or describe its
/// voxels, and a transfer function's.
///
/// # Errors
/// If the volume's header cannot be read.
pub fn source_files(table: &VolumeTable) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    if let Some(path) = &table.path {
        let options = ReadOptions::of(table)?;
        match options.format_of(path)? {
            format @ (Format::Npy
            | Format::Nrrd
            | Format::MetaImage
            | Format::Nifti
            | Format::Raw) => {
                options.check(path, format)?;
                files.extend_from_slice(DenseFile::open(path, format, &options)?.files());
            }
            _ => files.push(path.clone()),
        }
    }
    files.extend(table.transfer.as_ref().and_then(|transfer| transfer.file.clone()));
    Ok(files)
}

/// The axis of a file's world that points to a patient's head, if the volume of `table` is a file
/// whose world is a patient's; then x points to the patient's left and y to the back. `None` for
/// all others.
///
/// # Errors
/// If the volume's header cannot be read.
pub fn superior_axis(table: &VolumeTable) -> Result<Option<Axis>> {
    let Some(path) = &table.path else { return Ok(None) };
    let options = ReadOptions::of(table)?;
    let format = options.format_of(path)?;
    if !matches!(format, Format::Nrrd | Format::MetaImage | Format::Nifti) {
        return Ok(None);
    }
    options.check(path, format)?;
    let space = DenseFile::open(path, format, &options)?.header().space;
    Ok((space == Some(Space::Lps)).then_some(Axis::Z))
}

/// A motion that a table of a scene file describes: a scaling about the world's origin, rotations
/// about the world's x, y and z axes in this order, then a translation.
pub(super) struct Motion<'a> {
    /// The table's name.
    pub what: &'a str,
    pub translate: Option<[f64; 3]>,
    pub rotate_degrees: Option<[f64; 3]>,
    pub scale: Option<f64>,
}

impl Motion<'_> {
    /// Its matrix, for column vectors.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub(super) fn matrix(&self) -> Result<DMat4> {
        let what = self.what;
        let scale = self.scale.unwrap_or(1.0);
        if !(scale > 0.0 && scale < 1e12) {
            let why = format!("{scale} is not between 0 and 1e12");
            return Err(Error::value(format!("{what}.scale"), why));
        }
        let finite = |key: &str, given: Option<[f64; 3]>| {
            let v = DVec3::from_array(given.unwrap_or_default());
            let why = || Error::value(format!("{what}.{key}"), format!("{v} is not finite"));
            if v.is_finite() { Ok(v) } else { Err(why()) }
        };
        let angles = finite("rotate_degrees", self.rotate_degrees)?;
        let turns = angles.to_array().map(f64::to_radians);
        let turn = DQuat::from_rotation_z(turns[2])
            * DQuat::from_rotation_y(turns[1])
            * DQuat::from_rotation_x(turns[0]);
        let to = finite("translate", self.translate)?;
        Ok(DMat4::from_scale_rotation_translation(DVec3::splat(scale), turn, to))
    }
}

/// Moves a volume as `table` says.
fn moved(volume: Volume, table: &VolumeTable) -> Result<Volume> {
    let VolumeTable { translate, rotate_degrees, scale, .. } = *table;
    if translate.is_none() && rotate_degrees.is_none() && scale.is_none() {
        return Ok(volume);
    }
    let motion = Motion { what: "volume", translate, rotate_degrees, scale };
    let placement = motion.matrix()? * *volume.world_from_index();
    volume.placed(placement)
}

/// The red, green and blue components of a grid of vectors in the file of `table`, placed like its
/// densities.
///
/// # Errors
/// As [`load_volume`], and if the file is not OpenVDB or the grid's values are not vectors.
pub fn load_color(table: &VolumeTable, grid: &str) -> Result<[Volume; 3]> {
    let Some(path) = &table.path else {
        return Err(Error::value("volume.color", "does not apply to a preset"));
    };
    let options = ReadOptions::of(table)?;
    if options.format_of(path)? != Format::OpenVdb {
        return Err(Error::value("volume.color", "needs an OpenVDB file with a grid of vectors"));
    }
    let [red, green, blue] = fog::load_vectors(path, grid, options.max_bytes)?;
    let up = table.up.as_deref().map(str::parse::<Axis>).transpose()?.unwrap_or_default();
    let turned = |volume: Volume| {
        let placement = DMat4::from_mat3(up.world_from_file()) * *volume.world_from_index();
        moved(volume.placed(placement)?, table)
    };
    Ok([turned(red)?, turned(green)?, turned(blue)?])
}

/// Whether the medium ends at the outermost voxels' centres, as that of sparse grids does.
fn sparse(volume: &Volume) -> bool {
    volume.domain().min == DVec3::ZERO
}

/// Opens a file in the format that its first bytes tell, or in that of `options`.
fn load_file(
    path: &Path,
    options: &ReadOptions,
    up: Option<Axis>,
    levels: Levels,
    facts: &mut Facts,
) -> Result<Volume> {
    let format = options.format_of(path)?;
    options.check(path, format)?;
    if format != Format::OpenVdb {
        let file = DenseFile::open(path, format, options)?;
        facts.notes.extend_from_slice(&file.header().notes);
        facts.of_ct = of_ct(&file.header().metadata);
        return file.volume_noted(up, levels, &mut facts.notes);
    }
    let ReadOptions { class, max_bytes, .. } = *options;
    let wanted = fog::Wanted { grid: options.grid.as_deref(), class, max_bytes, levels };
    let volume = fog::load(path, &wanted, &mut facts.notes)?;
    let turn = DMat4::from_mat3(up.unwrap_or_default().world_from_file());
    let placement = turn * *volume.world_from_index();
    volume.placed(placement)
}

/// Whether a file's metadata says that it comes from a CT scanner; `None` if it names no scanner.
fn of_ct(metadata: &[(String, String)]) -> Option<bool> {
    let is = |key: &str, word: &str| key.to_ascii_lowercase().contains(word);
    // DICOM's modality tag, as converters write it.
    let modality = metadata.iter().find(|(key, _)| is(key, "modality") || is(key, "0008_0060"));
    let units = metadata.iter().find(|(key, _)| is(key, "units"));
    let of_units = units.filter(|(_, value)| is(value, "hounsfield") || value.trim() == "HU");
    match (modality.map(|(_, value)| value.trim()), of_units) {
        (Some("CT" | "MET_MOD_CT"), _) | (_, Some(_)) => Some(true),
        (Some("MET_MOD_UNKNOWN" | "MET_MOD_OTHER" | "") | None, _) => None,
        (Some(_), _) => Some(false),
    }
}
