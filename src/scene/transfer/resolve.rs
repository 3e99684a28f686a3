//! Resolves the `[volume.transfer]` table of a scene file to a transfer function.

use std::path::Path;

use glam::DVec3;

use super::{TransferFunction, TransferPoint, from_file, holds, over_hounsfield, preset};
use crate::error::{Error, Result};
use crate::scene::file::{RangeWord, TransferRange, TransferTable};

/// The result of resolving a table.
#[derive(Clone, Debug, PartialEq)]
pub enum TransferSource {
    /// A function that is known.
    Function(Resolved),
    /// `name = "auto"`: a function that [`super::automatic`] is to choose from the volume's
    /// histogram.
    Automatic {
        /// The range of densities for the histogram; `None` for the volume's own range.
        range: Option<[f64; 2]>,
    },
}

/// A function and the unit of its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolved {
    /// Colour and opacity over value.
    pub function: TransferFunction,
    /// Whether values are 0..1 and must be moved to the volume's range
    /// ([`TransferFunction::rescaled`]). That is so for a preset without a given range.
    pub normalised: bool,
    /// Whether values are to be moved to the range of all values that the volume holds (`range =
    /// "data"`).
    pub over_data: bool,
    /// The same preset over Hounsfield units, for volumes that hold those, if no range was given.
    pub hounsfield: Option<TransferFunction>,
}

/// Resolves `table` to a function. `text` is the content of the file that it names, if any; nothing
/// is read here.
///
/// # Errors
/// If not exactly one of `name`, `file` and `points` is given, the range does not rise or is not
/// finite in f32, there is no such preset, or the file or the points are invalid.
pub fn resolve(table: &TransferTable, text: Option<&str>) -> Result<TransferSource> {
    let (range, over_data) = match table.range {
        Some(TransferRange::Values(range)) => (Some(range), false),
        Some(TransferRange::Word(RangeWord::Data)) => (None, true),
        None => (None, false),
    };
    if let Some([low, high]) =
        range.filter(|&[low, high]| !(holds(low) && holds(high) && low < high))
    {
        let why = format!("{low}..{high} is not a range: it must increase and be finite in f32");
        return Err(Error::value("volume.transfer.range", why));
    }
    let (mut normalised, mut hounsfield) = (false, None);
    let function = match (&table.name, &table.file, &table.points) {
        (Some(name), None, None) if name == "auto" => {
            return Ok(TransferSource::Automatic { range });
        }
        (Some(name), None, None) => {
            normalised = range.is_none() && !over_data;
            hounsfield = over_hounsfield(name).filter(|_| normalised);
            preset(name)?
        }
        (None, Some(file), None) => of_text(file, text)?,
        (None, None, Some(points)) => {
            let point = |&[value, r, g, b, opacity]: &[f64; 5]| TransferPoint {
                value,
                color: DVec3::new(r, g, b),
                opacity,
            };
            let points = points.iter().map(point).collect();
            TransferFunction::named("volume.transfer.points", points)?
        }
        (name, file, points) => {
            let given = [name.is_some(), file.is_some(), points.is_some()];
            let given = ["name", "file", "points"].into_iter().zip(given);
            let given: Vec<_> = given.filter_map(|(key, given)| given.then_some(key)).collect();
            let given = if given.is_empty() { "nothing".to_owned() } else { given.join(" and ") };
            let why = format!("give one of name, file and points; this has {given}");
            return Err(Error::value("volume.transfer", why));
        }
    };
    let function = range.map_or(Ok(function.clone()), |range| function.rescaled(range))?;
    Ok(TransferSource::Function(Resolved { function, normalised, over_data, hounsfield }))
}

fn of_text(file: &Path, text: Option<&str>) -> Result<TransferFunction> {
    let missing =
        || Error::value("volume.transfer.file", format!("{} was not read", file.display()));
    from_file(file, text.ok_or_else(missing)?)
}

/// The table's `gradient` as a white function over the length of the density's gradient, relative
/// to the steepest one. Its opacity, 0..1, is a factor on the volume's. `None` if the table has no
/// such key.
///
/// # Errors
/// With the number of the point, counted from 1, where [`TransferFunction::new`] rejects values or
/// opacities, and for lengths below 0.
pub fn gradient(table: &TransferTable) -> Result<Option<TransferFunction>> {
    const WHAT: &str = "volume.transfer.gradient";
    let Some(pairs) = &table.gradient else {
        return Ok(None);
    };
    if let Some(at) = pairs.iter().position(|pair| pair[0] < 0.0) {
        let why = format!("point {}: length {} is below 0", at + 1, pairs[at][0]);
        return Err(Error::value(WHAT, why));
    }
    let point = |&[value, opacity]: &[f64; 2]| TransferPoint { value, color: DVec3::ONE, opacity };
    TransferFunction::named(WHAT, pairs.iter().map(point).collect()).map(Some)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]

    use super::*;
    use crate::scene::SceneFile;

    fn table(text: &str) -> TransferTable {
        let text = format!("[volume.transfer]\n{text}");
        let file = SceneFile::parse(&text, Path::new("scenes/a.toml")).unwrap();
        file.volume[0].transfer.clone().unwrap()
    }

    fn function(text: &str, file: Option<&str>) -> Resolved {
        match resolve(&table(text), file).unwrap() {
            TransferSource::Function(resolved) => resolved,
            TransferSource::Automatic { .. } => panic!("{text}: automatic"),
        }
    }

    #[test]
    fn a_table_names_a_preset_a_file_or_points() {
        let preset = function("name = 'viridis'", None);
        assert_eq!((preset.normalised, preset.function.range()), (true, [0.0, 1.0]));
        let preset = function("name = 'viridis'\nrange = [-5.0, 20]", None);
        assert_eq!((preset.normalised, preset.function.range()), (false, [-5.0, 20.0]));
        let points = function("points = [[7, 1, 0, 0.25, 0.5], [9, 1, 1, 1, 1]]", None);
        assert_eq!((points.normalised, points.function.range()), (false, [7.0, 9.0]));
        assert_eq!(points.function.at(7.0), (DVec3::new(1.0, 0.0, 0.25), 0.5));
        let file = function("file = 'map.txt'", Some("3 0\n4 1"));
        assert_eq!((file.normalised, file.function.range()), (false, [3.0, 4.0]));
        assert_eq!(table("file = 'map.txt'").file.unwrap(), Path::new("scenes/map.txt"));
        let choice = resolve(&table("name = 'auto'\nrange = [0, 2]"), None).unwrap();
        assert_eq!(choice, TransferSource::Automatic { range: Some([0.0, 2.0]) });
    }

    #[test]
    fn mistakes_are_named_with_their_key() {
        for (text, named) in [
            ("", "volume.transfer: give one of name, file and points; this has nothing"),
            ("name = 'grey'\nfile = 'a'", "this has name and file"),
            ("name = 'gray'", "no preset 'gray'"),
            ("name = 'auto'\nrange = [1, 1]", "volume.transfer.range: 1..1"),
            ("name = 'grey'\nrange = [0, inf]", "volume.transfer.range: 0..inf"),
            ("points = []", "volume.transfer.points: it has no points"),
            ("points = [[0, 0, 0, 0, 2]]", "volume.transfer.points: point 1: opacity is 2"),
            ("file = 'a.txt'", "a.txt was not read"),
        ] {
            let error = resolve(&table(text), None).unwrap_err().to_string();
            assert!(error.contains(named) && !error.contains('\n'), "{text}: {error}");
        }
        let error = resolve(&table("file = 'a.txt'"), Some("0")).unwrap_err().to_string();
        assert_eq!(error, "scenes/a.txt: line 1: 1 numbers, expected 2 or 5 for a point");
    }

    #[test]
    fn gradients_are_checked() {
        assert_eq!(gradient(&table("name = 'grey'")).unwrap(), None);
        let function = gradient(&table("gradient = [[0, 0], [2, 1]]")).unwrap().unwrap();
        let pairs: Vec<_> = function.points().iter().map(|p| [p.value, p.opacity]).collect();
        assert_eq!(pairs, [[0.0, 0.0], [2.0, 1.0]]);
        for (text, named) in [
            ("gradient = [[-1, 0]]", "point 1: length -1"),
            ("gradient = [[0, 0], [1, 2]]", "point 2: opacity is 2"),
            ("gradient = []", "no points"),
        ] {
            let error = gradient(&table(text)).unwrap_err().to_string();
            assert!(error.starts_with("volume.transfer.gradient: "), "{error}");
            assert!(error.contains(named), "{error}");
        }
    }
}
