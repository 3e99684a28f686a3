//! Loads everything that a `[volume]` table names: the densities, their transfer function, and
//! further grids of the same file.

use std::path::Path;
use std::sync::Arc;

use super::files;
use super::histogram::Histogram;
use super::load::{Facts, load_color, load_noted, load_volume};
use crate::error::{Error, Result};
use crate::scene::automatic::{Densities, Ingredients, window};
use crate::scene::file::VolumeTable;
use crate::scene::transfer::{self, Resolved, TransferFunction, TransferSource};
use crate::volume::{Levels, Volume};

/// Number of bins of the histogram from which a transfer function is chosen.
const BINS: usize = 256;
/// The range of Hounsfield units in a body; metal beyond it is clamped.
const HOUNSFIELD: [f32; 2] = [-1024.0, 3071.0];
/// A function over 0..1 does not refer to stored values if those spread over more than this.
const NORMALISED: f64 = 50.0;

/// Loads everything that `table` names. If the table gives no window, one may be chosen that hides
/// the surroundings of a scanned object: when `scan` says that values need no absolute meaning, or
/// when no density scale is given that refers to them. The strings in the result say what was
/// chosen.
///
/// # Errors
/// As [`load_volume`], and if a transfer function is invalid or a further grid cannot be read.
pub fn load_ingredients(table: &VolumeTable, scan: bool) -> Result<(Ingredients, Vec<String>)> {
    load_ingredients_like(table, scan, None)
}

/// Like [`load_ingredients`]. `like` was loaded for a table that differs in its transfer function
/// alone; its volume is taken as far as reading the file would give the same.
pub(super) fn load_ingredients_like(
    table: &VolumeTable,
    scan: bool,
    like: Option<&Ingredients>,
) -> Result<(Ingredients, Vec<String>)> {
    let mut facts = Facts::default();
    let choice = choice(table)?;
    let loaded = loaded(table, choice.as_ref(), like, &mut facts)?;
    let Loaded { mut volume, mut densities, mut function } = loaded;
    let mut notes = facts.notes;
    if volume.replaced() > 0 {
        let count = volume.replaced();
        notes.push(format!("{count} negative or non-finite voxels count as 0"));
    }
    if volume.largest() == 0.0 && densities.offset == 0.0 {
        notes.push(format!("'{}' is empty: no density is above 0", volume.name));
    }
    if let (Some([low, high]), true) = (table.window, densities.cut.is_some())
        && volume.largest() > 0.0
        && f64::from(volume.largest()) <= densities.held_value(0.0)
    {
        notes.push(format!("nothing is above the lower end of the window {low},{high}"));
    }
    let mut chosen = None;
    let automatic = scan || table.density_scale.is_none();
    if automatic
        && densities == Densities::default()
        && function.is_none()
        && table.preset.is_none()
        && let Some([low, high]) = window(&volume)
    {
        densities = Densities::of_window([low, high], 0.0);
        chosen = Some([low, high]);
        notes.push(format!("window {low},{high} (chosen; `volume.window` sets it)"));
    }
    if function.is_none() {
        function = match choice {
            None => None,
            Some(TransferSource::Function(Resolved { function, .. })) => {
                Some(function.rescaled(over(&volume, &densities))?)
            }
            Some(TransferSource::Automatic { range }) => {
                let range = range.unwrap_or_else(|| over(&volume, &densities));
                let counts = histogram(&volume, &densities, range).counts;
                let function = transfer::automatic(&counts, range);
                let count = function.points().len();
                notes.push(format!("transfer function of {count} points (chosen)"));
                Some(function)
            }
        };
    }
    let modulation = match &table.transfer {
        Some(table) => transfer::gradient(table)?
            .map(|steep| modulation(&volume, &densities, function.as_ref(), &steep)),
        None => None,
    };
    let transfer = match &function {
        Some(function) => Some(densities.held(function)?),
        None if densities.cut.is_none() => None,
        None if densities.cuts_nothing(&volume) => {
            // The window cuts nothing, so the volume can hold the densities themselves.
            volume = Arc::new(volume.mapped(|held| densities.density(held.into()) as f32));
            densities = Densities::default();
            None
        }
        None => Some(densities.held(&transfer::preset("grey")?)?),
    };
    let color = match &table.color {
        Some(_) if like.is_some_and(|like| like.color.is_some()) => {
            like.and_then(|like| like.color.clone())
        }
        Some(grid) => Some(load_color(table, grid)?.map(Arc::new)),
        None => None,
    };
    let glow = table.emission.as_ref().and_then(|emission| emission.grid.clone());
    let emission_field = match glow {
        Some(_) if like.is_some_and(|like| like.emission_field.is_some()) => {
            let known = like.and_then(|like| like.emission_field.clone());
            known.map(|field| clipped(field, table)).transpose()?
        }
        Some(grid) => {
            let table = VolumeTable { grid: Some(grid), window: None, ..table.clone() };
            Some(Arc::new(load_volume(&table)?))
        }
        None => None,
    };
    let mut own = Ingredients::of(volume);
    own.densities = densities;
    own.transfer = transfer.map(Arc::new);
    own.color = color;
    own.modulation = modulation.map(Arc::new);
    own.emission_field = emission_field;
    own.window = chosen;
    own.function = function;
    Ok((own, notes))
}

/// A volume, and the map between its numbers and densities.
struct Loaded {
    volume: Arc<Volume>,
    densities: Densities,
    /// The transfer function over densities, unless it depends on a later choice.
    function: Option<TransferFunction>,
}

impl Loaded {
    /// For densities that are the stored values, moved by an offset or not.
    fn stored(volume: Arc<Volume>, function: Option<TransferFunction>) -> Self {
        let densities = Densities::of_stored(&volume);
        Self { volume, densities, function }
    }
}

/// Loads the densities in such a way that the chosen function can be applied between voxels.
fn loaded(
    table: &VolumeTable,
    choice: Option<&TransferSource>,
    like: Option<&Ingredients>,
    facts: &mut Facts,
) -> Result<Loaded> {
    let mut load = |levels: Levels| {
        facts.notes.clear();
        match like.and_then(|like| like.volume.as_levels(levels)) {
            Some(same) => clipped(same, table),
            None => load_noted(table, levels, facts).map(Arc::new),
        }
    };
    let resolved = match choice {
        Some(TransferSource::Function(resolved)) => Some(resolved),
        _ => None,
    };
    if let Some(window) = table.window {
        let volume = load(Levels::Moved(window))?;
        let densities = Densities::of_window(window, volume.moved_by());
        // With a window, a function is over 0..1.
        let function = resolved.filter(|one| !one.normalised && !one.over_data);
        return Ok(Loaded {
            volume,
            densities,
            function: function.map(|one| one.function.clone()),
        });
    }
    match (choice, resolved) {
        (Some(TransferSource::Automatic { range: Some(range) }), _) => {
            let volume = load(Levels::Moved(range.map(|value| value as f32)))?;
            Ok(Loaded::stored(volume, None))
        }
        (_, Some(Resolved { function, over_data: true, .. })) => {
            let volume = load(Levels::Moved(HOUNSFIELD))?;
            let data = data_range(&volume);
            let volume = load(Levels::Moved(data))?;
            let function = function.rescaled(data.map(f64::from))?;
            Ok(Loaded::stored(volume, Some(function)))
        }
        (_, Some(Resolved { hounsfield: Some(function), .. })) => {
            // Not one that is known: the file says what its numbers are.
            facts.notes.clear();
            let volume = Arc::new(load_noted(table, Levels::Moved(HOUNSFIELD), facts)?);
            if is_hounsfield(&volume, facts.of_ct) {
                let note = "its values are taken as Hounsfield units (`volume.transfer.range` sets \
                            another range)";
                facts.notes.push(note.to_owned());
                return Ok(Loaded::stored(volume, Some(function.clone())));
            }
            let volume = load_noted(table, Levels::AsStored, &mut Facts::default())?;
            Ok(Loaded::stored(Arc::new(volume), None))
        }
        (_, Some(Resolved { function, normalised: false, .. })) => {
            let Some(range) = own_range(function) else {
                return Ok(Loaded::stored(load(Levels::AsStored)?, Some(function.clone())));
            };
            let volume = load(Levels::Moved(range))?;
            let data = data_range(&volume);
            let given = table.transfer.as_ref().is_some_and(|table| table.range.is_some());
            if given || meets(function.range(), data) {
                return Ok(Loaded::stored(volume, Some(function.clone())));
            }
            let volume = load(Levels::Moved(data))?;
            let ([low, high], [least, most]) = (function.range(), data);
            facts.notes.push(format!(
                "transfer function over {low}..{high} is spread over the data, {least}..{most} \
                 (`volume.transfer.range` {low},{high} keeps it)"
            ));
            let function = function.rescaled(data.map(f64::from))?;
            Ok(Loaded::stored(volume, Some(function)))
        }
        _ => Ok(Loaded::stored(load(Levels::AsStored)?, None)),
    }
}

/// A volume with the part that `table` keeps.
fn clipped(volume: Arc<Volume>, table: &VolumeTable) -> Result<Arc<Volume>> {
    let kept = volume.clipped(table.clip.unwrap_or([[0.0; 3], [1.0; 3]]))?;
    Ok(if kept.domain() == volume.domain() { volume } else { Arc::new(kept) })
}

/// The function that `table` specifies, after reading its file.
fn choice(table: &VolumeTable) -> Result<Option<TransferSource>> {
    let Some(table) = &table.transfer else { return Ok(None) };
    let text = table.file.as_deref().map(read).transpose()?;
    transfer::resolve(table, text.as_deref()).map(Some)
}

fn read(path: &Path) -> Result<String> {
    files::read_to_string(path).map_err(|error| Error::file(path, error))
}

/// The range of stored values that a function covers; `None` if it is a single value.
fn own_range(function: &TransferFunction) -> Option<[f32; 2]> {
    let [low, high] = function.range().map(|value| value as f32);
    (low < high).then_some([low, high])
}

/// The range of a volume's stored values without a few outliers; never empty.
fn data_range(volume: &Volume) -> [f32; 2] {
    let [low, high] = volume.stored_range().unwrap_or_default();
    if low < high { [low, high] } else { [low.min(0.0), low.max(0.0).max(low.min(0.0) + 1.0)] }
}

/// Whether a function refers to stored values in the range `data`: whether the ranges overlap, and
/// the function is not one over 0..1 for values that spread widely.
fn meets([low, high]: [f64; 2], data: [f32; 2]) -> bool {
    let [least, most] = data.map(f64::from);
    let normalised = low == 0.0 && high == 1.0 && most - least > NORMALISED;
    low <= most && least <= high && !normalised
}

/// Whether stored values are Hounsfield units. Either the file says so (`of_ct`), or the values
/// have air at -1000, padding below that, and soft tissue around 0.
fn is_hounsfield(volume: &Volume, of_ct: Option<bool>) -> bool {
    let by = volume.moved_by();
    let least = volume.smallest() - by;
    match of_ct {
        Some(of_ct) => of_ct && least <= -200.0,
        None => {
            let share = |low: f32, high: f32| volume.share_between(low + by, high + by);
            let padding = if least < -1100.0 { share(least, 0.999 * least) } else { 0.0 };
            let fits = least <= -900.0 && padding + share(-1100.0, 4100.0) > 0.995;
            fits && share(-150.0, 150.0) > 0.01 && padding + share(-1100.0, -800.0) > 0.01
        }
    }
}

/// The range from 0 to the largest density without a few outliers.
fn over(volume: &Volume, densities: &Densities) -> [f64; 2] {
    let largest = densities.density(volume.typical_largest().into());
    [0.0, if largest > 0.0 { largest } else { 1.0 }]
}

/// The histogram of a volume's densities within a range.
fn histogram(volume: &Volume, densities: &Densities, range: [f64; 2]) -> Histogram {
    let mut histogram = Histogram::new(range, BINS);
    let [low, high] = range;
    let mut held = 0;
    let mut add = |value: f64, count: u64| {
        let density = densities.density(value);
        if (low..=high).contains(&density) {
            histogram.add(density as f32, count);
        }
    };
    volume.voxels().for_each_held(|part, value| {
        let count = part.voxels() as u64;
        held += count;
        add(value.into(), count);
    });
    let empty = volume.dims().iter().fold(1_u64, |all, &n| all.saturating_mul(n as u64)) - held;
    add(0.0, empty);
    histogram
}

/// A factor on extinction: the function `steep` of the length of the gradient of densities, which
/// are first clamped to the range in which the transfer function distinguishes them.
fn modulation(
    volume: &Volume,
    densities: &Densities,
    function: Option<&TransferFunction>,
    steep: &TransferFunction,
) -> Volume {
    let told_apart = densities.cut.or_else(|| function.map(TransferFunction::range));
    let gradient = match told_apart {
        Some(range) if range[0] < range[1] => {
            let [low, high] = range.map(|density| densities.held_value(density) as f32);
            volume.mapped(|held| held.clamp(low, high) - low).gradient_magnitude()
        }
        _ => volume.gradient_magnitude(),
    };
    gradient.mapped(|steepness| steep.at(steepness.into()).1 as f32)
}
