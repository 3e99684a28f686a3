//! From what a user wrote of a volume to the volume: presets and files, their place in the world.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::{DMat4, DVec3};

use super::fog;
use super::raw::{self, Endian, RawLayout, Sidecar, ValueType};
use super::vdb::VdbFile;
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::scene::file::VolumeTable;
use crate::volume::presets::Preset;
use crate::volume::{Axis, Volume, world_from_index_in_bounds};

/// Bytes that a sparse volume may take as a dense one, unless the user says otherwise.
const DEFAULT_MAX_BYTES: u64 = 4 << 30;

/// Loads the volume that `table` names and puts it where `table` says.
///
/// # Errors
/// If there is no such preset or file, if the file is not what it is said to be, or if a value of
/// `table` cannot be used.
pub fn load_volume(table: &VolumeTable) -> Result<Volume> {
    let up = table.up.as_deref().map(str::parse::<Axis>).transpose()?;
    let volume = match (&table.preset, &table.path) {
        (Some(_), Some(_)) => return Err(Error::value("volume", "give path or preset, not both")),
        (None, None) => return Err(Error::value("volume", "give path or preset")),
        (Some(preset), None) => preset.parse::<Preset>()?.volume(up.unwrap_or_default())?,
        (None, Some(path)) => load_file(path, table, up)?,
    };
    let volume = match table.bounds {
        Some(_) if sparse(&volume) => {
            let why = "only for dense volumes; a sparse grid keeps its own transform";
            return Err(Error::value("volume.bounds", why));
        }
        Some([min, max]) => {
            let bounds = Aabb { min: min.into(), max: max.into() };
            let placement =
                world_from_index_in_bounds(volume.dims(), &bounds, up.unwrap_or_default())?;
            volume.placed(placement)?
        }
        None => volume,
    };
    match table.window {
        Some(window) => volume.windowed(window),
        None => Ok(volume),
    }
}

/// Whether the medium ends where the voxels' outermost centres are, as sparse grids' does.
fn sparse(volume: &Volume) -> bool {
    volume.domain().min == DVec3::ZERO
}

/// Opens a file by what it begins with; what begins with nothing known is raw voxels.
fn load_file(path: &Path, table: &VolumeTable, up: Option<Axis>) -> Result<Volume> {
    // Dims on the command line say that it is raw, whatever it happens to begin with.
    if table.dims.is_some() {
        return load_raw(path, table, up);
    }
    let failed = |error| Error::file(path, error);
    let mut start = Vec::new();
    File::open(path).map_err(failed)?.take(16).read_to_end(&mut start).map_err(failed)?;
    if VdbFile::recognizes(&start) {
        let max_bytes = table.max_bytes.unwrap_or(DEFAULT_MAX_BYTES);
        let volume = fog::load(path, table.grid.as_deref(), max_bytes)?;
        let turn = DMat4::from_mat3(up.unwrap_or_default().world_from_file());
        let placement = turn * *volume.world_from_index();
        return volume.placed(placement);
    }
    match SIGNATURES.iter().find(|(signature, _)| start.starts_with(signature)) {
        Some((_, name)) => {
            Err(Error::contents(path, format!("{name}, which this version does not read")))
        }
        None => load_raw(path, table, up),
    }
}

fn load_raw(path: &Path, table: &VolumeTable, up: Option<Axis>) -> Result<Volume> {
    let sidecar = Sidecar::beside(path)?;
    let sidecar_path = sidecar.as_ref().map_or(path, |(path, _)| path).to_owned();
    let sidecar = sidecar.map(|(_, sidecar)| sidecar).unwrap_or_default();
    let in_sidecar = |error: Error| Error::contents(&sidecar_path, error.to_string());

    let dims = table.dims.or(sidecar.dims);
    let dims = dims.ok_or_else(|| raw::undescribed(path, "--dims and --type"))?;
    let value_type = match (&table.value_type, &sidecar.value_type) {
        (Some(given), _) => given.parse::<ValueType>()?,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => return Err(raw::undescribed(path, "--type")),
    };
    let endian = match (&table.endian, &sidecar.endian) {
        (Some(given), _) => given.parse::<Endian>()?,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => Endian::default(),
    };
    let up = match (up, &sidecar.up) {
        (Some(up), _) => up,
        (None, Some(given)) => given.parse().map_err(in_sidecar)?,
        (None, None) => Axis::default(),
    };
    let values = raw::read(path, &RawLayout { dims, value_type, endian })?;
    let file_from_index = match table.spacing {
        Some(spacing) => spacing_matrix("spacing", spacing)?,
        None => {
            if let Some(spacing) = sidecar.spacing {
                spacing_matrix("spacing", spacing).map_err(in_sidecar)?;
            }
            sidecar.world_from_index().unwrap_or(DMat4::IDENTITY)
        }
    };
    let world_from_file = DMat4::from_mat3(up.world_from_file());
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    Volume::new(name, values, world_from_file * file_from_index)
}

fn spacing_matrix(what: &str, spacing: [f64; 3]) -> Result<DMat4> {
    let spacing = DVec3::from(spacing);
    if spacing.is_finite() && spacing.min_element() > 0.0 {
        Ok(DMat4::from_scale(spacing))
    } else {
        Err(Error::value(what, format!("{spacing} is not above 0 on every axis")))
    }
}

/// Volume formats that begin with a signature, so that none of them is taken for raw voxels.
const SIGNATURES: [(&[u8], &str); 7] = [
    (b"NRRD", "an NRRD file"),
    (b"\x93NUMPY", "a NumPy file"),
    (b"NanoVDB", "a NanoVDB file"),
    (b"PVM", "a PVM file"),
    (b"DDS v3", "a DDS-compressed PVM file"),
    (b"<?xml", "an XML file"),
    (b"\x1f\x8b", "a gzip file"),
];
