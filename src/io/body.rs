//! From what a user wrote of a volume to all that a medium is made of: the densities, their transfer
//! function, and further grids of the same file.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::histogram::Histogram;
use super::load::{load_color, load_volume};
use crate::error::{Error, Result};
use crate::scene::automatic::{Ingredients, window};
use crate::scene::file::VolumeTable;
use crate::scene::transfer::{self, Choice, Resolved, TransferFunction};
use crate::volume::Volume;

/// Bins of the histogram that a transfer function is chosen from.
const BINS: usize = 256;

/// Loads everything that `table` names. Where it leaves the window open and `scan` says that values need
/// no absolute meaning, one is chosen that hides what surrounds a scanned object. With them: what was
/// done, in words.
///
/// # Errors
/// As [`load_volume`], if a transfer function is wrong, or if a further grid cannot be read.
pub fn load_ingredients(table: &VolumeTable, scan: bool) -> Result<(Ingredients, Vec<String>)> {
    let mut notes = Vec::new();
    let choice = choice(table)?;
    // A function of stored values: they become densities of 0..1 over its range, whatever their sign.
    let own = match &choice {
        Some(Choice::Function(Resolved { function, normalised: false })) => own_window(function),
        _ => None,
    };
    let window_given = table.window.or(own);
    let asked = VolumeTable { window: window_given, ..table.clone() };
    let mut volume = load_volume(&asked)?;
    if volume.replaced() > 0 {
        let count = volume.replaced();
        notes.push(format!("{count} negative or non-finite voxels count as 0"));
    }
    if volume.largest() == 0.0 {
        notes.push(format!("'{}' is empty: no density is above 0", volume.name));
    }
    if scan
        && window_given.is_none()
        && table.preset.is_none()
        && let Some([low, high]) = window(&volume)
    {
        volume = volume.windowed([low, high])?;
        notes.push(format!("window {low},{high} (chosen; --window sets it)"));
    }
    let function = match choice {
        None => None,
        Some(Choice::Function(Resolved { function, normalised })) => {
            let range = if normalised { over(&volume) } else { [0.0, 1.0] };
            let stays = !normalised && (own.is_none() || table.window.is_some());
            Some(if stays { function } else { function.rescaled(range)? })
        }
        Some(Choice::Automatic { range }) => {
            let range = range.unwrap_or_else(|| over(&volume));
            let function = transfer::automatic(&histogram(&volume, range).counts, range);
            notes.push(format!("transfer function of {} points (chosen)", function.points().len()));
            Some(function)
        }
    };
    let modulation = match &table.transfer {
        Some(table) => transfer::gradient(table)?.map(|function| modulation(&volume, &function)),
        None => None,
    };
    let color = match &table.color {
        Some(grid) => Some(load_color(table, grid)?.map(Arc::new)),
        None => None,
    };
    let glow = table.emission.as_ref().and_then(|emission| emission.grid.clone());
    let emission_field = match glow {
        Some(grid) => {
            let table = VolumeTable { grid: Some(grid), window: None, ..table.clone() };
            Some(Arc::new(load_volume(&table)?))
        }
        None => None,
    };
    let ingredients = Ingredients {
        volume: Arc::new(volume),
        transfer: function.map(Arc::new),
        color,
        modulation: modulation.map(Arc::new),
        emission_field,
    };
    Ok((ingredients, notes))
}

/// The function that `table` asks for, its file read.
fn choice(table: &VolumeTable) -> Result<Option<Choice>> {
    let Some(table) = &table.transfer else { return Ok(None) };
    let text = table.file.as_deref().map(read).transpose()?;
    transfer::resolve(table, text.as_deref()).map(Some)
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).map_err(|error| Error::file(path, error))
}

/// The stored values that a function speaks of; `None` if that is one value only.
fn own_window(function: &TransferFunction) -> Option<[f32; 2]> {
    let [low, high] = function.range().map(|value| value as f32);
    (low < high).then_some([low, high])
}

/// The densities that a volume has.
fn over(volume: &Volume) -> [f64; 2] {
    let largest = f64::from(volume.largest());
    [0.0, if largest > 0.0 { largest } else { 1.0 }]
}

/// The densities of a volume that lie in a range, counted.
fn histogram(volume: &Volume, range: [f64; 2]) -> Histogram {
    let mut histogram = Histogram::new(range, BINS);
    let [low, high] = range;
    let mut held = 0;
    volume.voxels().for_each_held(|part, value| {
        let count = part.voxels() as u64;
        held += count;
        if (low..=high).contains(&f64::from(value)) {
            histogram.add(value, count);
        }
    });
    let empty = volume.dims().iter().fold(1_u64, |all, &n| all.saturating_mul(n as u64)) - held;
    if (low..=high).contains(&0.0) {
        histogram.add(0.0, empty);
    }
    histogram
}

/// A factor on extinction from a function of how steep densities are.
fn modulation(volume: &Volume, function: &TransferFunction) -> Volume {
    volume.gradient_magnitude().mapped(|steepness| function.at(steepness.into()).1 as f32)
}
