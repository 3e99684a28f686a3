//! Parses transfer functions from the text of a file: ParaView's color maps (JSON) or lists of
//! points. The first character tells which.

use std::path::Path;

use glam::DVec3;
use serde::Deserialize;

use super::{MAX_POINTS, TransferFunction, TransferPoint, fault, linear_from_srgb, too_many};
use crate::error::{Error, Result};

/// The longest text that is parsed; that of [`MAX_POINTS`] points is far shorter.
const MAX_BYTES: usize = 1 << 24;

/// Parses a transfer function from `text`, the content of the file `path`; nothing is read here.
///
/// ParaView: an array of maps, from which the first with `RGBPoints` is taken, or a single map.
/// `RGBPoints` is a flat list of x, red, green, blue. `Points`, which may be missing, is a flat
/// list of x, opacity, midpoint, sharpness. Colours are sRGB in 0..1. Between points everything is
/// linear, colours in linear RGB; `ColorSpace`, midpoint and sharpness are ignored. Without
/// `Points` opacity rises linearly from 0 to 1.
///
/// Lists: one point per line, `value red green blue opacity` or, for white, `value opacity`,
/// separated by spaces, tabs or commas; `#` begins a comment. Colours are sRGB in 0..1, or in
/// 0..255 if any is above 1.
///
/// # Errors
/// With `path` and the line or the point: if the text is in neither format, is longer than 16 MiB
/// or has more than [`MAX_POINTS`] points, or if [`TransferFunction::new`] rejects the points.
pub fn from_file(path: &Path, text: &str) -> Result<TransferFunction> {
    let read = if text.len() > MAX_BYTES {
        Err(format!("it has {} bytes, the limit is {MAX_BYTES}", text.len()))
    } else {
        let text = text.trim_start_matches('\u{feff}');
        if text.trim_start().starts_with(['[', '{']) { color_map(text) } else { list(text) }
    };
    read.map_err(|why| Error::contents(path, why))
}

/// The keys of a ParaView color map that are read.
#[derive(Deserialize)]
struct ColorMap {
    #[serde(rename = "RGBPoints")]
    colors: Option<Vec<f64>>,
    #[serde(rename = "Points")]
    opacities: Option<Vec<f64>>,
}

fn color_map(text: &str) -> Result<TransferFunction, String> {
    let maps: Vec<ColorMap> = if text.trim_start().starts_with('{') {
        vec![serde_json::from_str(text).map_err(|error| json_fault(&error))?]
    } else {
        serde_json::from_str(text).map_err(|error| json_fault(&error))?
    };
    let with_colors = |map: ColorMap| Some((map.colors?, map.opacities));
    let (colors, opacities) =
        maps.into_iter().find_map(with_colors).ok_or("no color map in it has 'RGBPoints'")?;
    let color = |[value, channels @ ..]: [f64; 4]| {
        let wrong = |what, c| format!("{what} is {c}, not in 0..1");
        outside(channels, 1.0).map_or(Ok(()), |(what, c)| Err(wrong(what, c)))?;
        Ok(TransferPoint { value, color: linear_from_srgb(channels), opacity: 0.0 })
    };
    let colors = in_fours("RGBPoints", &colors, color)?;
    let Some(opacities) = opacities else {
        return Ok(with_ramp(colors));
    };
    let opacity =
        |[value, opacity, ..]: [f64; 4]| Ok(TransferPoint { value, color: DVec3::ZERO, opacity });
    let opacities = in_fours("Points", &opacities, opacity)?;
    let points = merged(&colors, &opacities);
    if points.len() > MAX_POINTS {
        return Err(too_many(points.len()));
    }
    Ok(TransferFunction { points })
}

/// The line, and serde's message without its position, shortened.
fn json_fault(error: &serde_json::Error) -> String {
    let words = error.to_string();
    let words = words.split(" at line ").next().unwrap_or_default();
    format!("line {}: {}", error.line(), shown(words, 120))
}

/// The first channel that is not in 0..`most`, and its name.
fn outside(channels: [f64; 3], most: f64) -> Option<(&'static str, f64)> {
    ["red", "green", "blue"].into_iter().zip(channels).find(|(_, c)| !(0.0..=most).contains(c))
}

/// A function from a flat list with four numbers per point; `what` names the list in errors.
fn in_fours(
    what: &str,
    numbers: &[f64],
    point: impl Fn([f64; 4]) -> Result<TransferPoint, String>,
) -> Result<TransferFunction, String> {
    let (fours, rest) = numbers.as_chunks();
    if !rest.is_empty() {
        return Err(format!("'{what}' has {} numbers, not a multiple of 4", numbers.len()));
    }
    let place = |at: usize, why: String| format!("point {} of '{what}': {why}", at + 1);
    if fours.len() > MAX_POINTS {
        return Err(format!("'{what}': {}", too_many(fours.len())));
    }
    let points = fours.iter().enumerate();
    let points = points.map(|(at, &four)| point(four).map_err(|why| place(at, why)));
    let points = points.collect::<Result<Vec<_>, _>>()?;
    match fault(&points) {
        None => Ok(TransferFunction { points }),
        Some((None, why)) => Err(format!("'{what}': {why}")),
        Some((Some(at), why)) => Err(place(at, why)),
    }
}

/// Replaces opacity by a ramp from 0 to 1 over the range; by 1 if the range is a single value.
fn with_ramp(mut colors: TransferFunction) -> TransferFunction {
    let [low, high] = colors.range();
    for point in &mut colors.points {
        point.opacity = if low < high { (point.value - low) / (high - low) } else { 1.0 };
    }
    colors
}

/// The colours of one function and the opacities of another, at the values of both.
fn merged(colors: &TransferFunction, opacities: &TransferFunction) -> Vec<TransferPoint> {
    let both = colors.points.iter().chain(&opacities.points);
    let mut values: Vec<f64> = both.map(|point| point.value).collect();
    values.sort_by(f64::total_cmp);
    // Equal as numbers, so -0 equals 0.
    values.dedup_by(|a, b| a == b);
    let mut points = Vec::with_capacity(values.len());
    for value in values {
        let before = (colors.before(value).0, opacities.before(value).1);
        let at = (colors.at(value).0, opacities.at(value).1);
        for (color, opacity) in [Some(before), (at != before).then_some(at)].into_iter().flatten() {
            points.push(TransferPoint { value, color, opacity });
        }
    }
    points
}

fn list(text: &str) -> Result<TransferFunction, String> {
    let mut points: Vec<TransferPoint> = Vec::new();
    let mut lines: Vec<usize> = Vec::new();
    let mut numbers_a_line = 0;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        let words = line.split(|c: char| c.is_whitespace() || c == ',');
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).take(6).collect();
        if words.is_empty() {
            continue;
        }
        let place = |why: String| format!("line {number}: {why}");
        let mut row = [0.0; 5];
        for (place_in_row, word) in row.iter_mut().zip(&words) {
            let read = word.parse().ok().filter(|value: &f64| value.is_finite());
            let why = || place(format!("'{}' is not a finite number", shown(word, 24)));
            *place_in_row = read.ok_or_else(why)?;
        }
        let point = match (words.len(), row) {
            (2, [value, opacity, ..]) => TransferPoint { value, color: DVec3::ONE, opacity },
            (5, [value, r, g, b, opacity]) => {
                TransferPoint { value, color: DVec3::new(r, g, b), opacity }
            }
            (count, _) => {
                let count = if count > 5 { "more than 5".to_owned() } else { count.to_string() };
                return Err(place(format!("{count} numbers, expected 2 or 5 for a point")));
            }
        };
        if numbers_a_line != 0 && words.len() != numbers_a_line {
            let count = words.len();
            return Err(place(format!("{count} numbers, but earlier lines have {numbers_a_line}")));
        }
        numbers_a_line = words.len();
        if points.len() == MAX_POINTS {
            return Err(place(format!("more than {MAX_POINTS} points")));
        }
        points.push(point);
        lines.push(number);
    }
    let bytes = points.iter().any(|point| point.color.max_element() > 1.0);
    let most = if bytes { 255.0 } else { 1.0 };
    for (point, line) in points.iter_mut().zip(&lines) {
        let channels = point.color.to_array();
        if let Some((what, c)) = outside(channels, most) {
            return Err(format!("line {line}: {what} is {c}, not in 0..{most}"));
        }
        point.color = linear_from_srgb(channels.map(|c| c / most));
    }
    match fault(&points) {
        None => Ok(TransferFunction { points }),
        Some((None, why)) => Err(why),
        Some((Some(at), why)) => Err(format!("line {}: {why}", lines[at])),
    }
}

/// The first characters of a text from a file, made fit for one line.
fn shown(words: &str, most: usize) -> String {
    let short: String = words.chars().take(most).collect();
    let dots = if short.len() < words.len() { "..." } else { "" };
    format!("{}{dots}", short.replace(char::is_control, "?"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const PARAVIEW: &str = r#"[
  {"Name": "Indexed", "IndexedColors": [0, 0, 0], "Points": null},
  {"ColorSpace": "Diverging", "Creator": "ParaView", "DefaultMap": true, "Name": "Preset",
   "NanColor": [1, 1, 0],
   "RGBPoints": [-10, 0.0, 0.5, 1.0, 0, 1, 1, 1, 10.0, 1.0, 0.0, 0.0],
   "Points": [-10, 0.0, 0.5, 0.0, 5, 0.75, 0.5, 0, 5, 0.25, 0.5, 0, 20.0, 1, 0.5, 0]},
  {"Name": "Second", "RGBPoints": [0, 0, 0, 0]}
]"#;

    fn read(text: &str) -> Result<TransferFunction> {
        from_file(Path::new("maps/a.json"), text)
    }

    #[test]
    fn a_paraview_map_has_the_values_of_both_lists() {
        let function = read(PARAVIEW).unwrap();
        let values: Vec<f64> = function.points().iter().map(|point| point.value).collect();
        assert_eq!(values, [-10.0, 0.0, 5.0, 5.0, 10.0, 20.0]);
        let half = linear_from_srgb([0.5; 3]).x;
        assert!((half - 0.214_041).abs() < 1e-6, "{half}");
        assert_eq!(function.at(-10.0), (DVec3::new(0.0, half, 1.0), 0.0));
        assert_eq!(function.at(0.0), (DVec3::ONE, 0.5));
        assert_eq!(function.at(5.0), (DVec3::new(1.0, 0.5, 0.5), 0.25));
        assert!((function.at(5.0 - 1e-12).1 - 0.75).abs() < 1e-9);
        assert_eq!(function.at(10.0), (DVec3::X, 0.5));
        assert_eq!(function.at(20.0), (DVec3::X, 1.0));
        assert_eq!(fault(function.points()), None);
    }

    #[test]
    fn a_paraview_map_without_opacity_gets_a_ramp() {
        let text = "\u{feff} {\"RGBPoints\": [1, 0, 0, 0, 2, 0, 0, 0, 5, 1, 1, 1]}";
        let opacities = |text| {
            let function = read(text).unwrap();
            function.points().iter().map(|point| point.opacity).collect::<Vec<_>>()
        };
        assert_eq!(opacities(text), [0.0, 0.25, 1.0]);
        assert_eq!(opacities("[{\"RGBPoints\": [1, 0, 0, 0]}]"), [1.0]);
    }

    #[test]
    fn lists_of_points_are_read() {
        let half = linear_from_srgb([0.5; 3]).x;
        let function = read("# CT\n-1000, 0 0.5 1, 0 # air\n\n\t3e3\t1 1 0 .5\r\n").unwrap();
        assert_eq!(function.range(), [-1000.0, 3000.0]);
        assert_eq!(function.at(-1000.0), (DVec3::new(0.0, half, 1.0), 0.0));
        assert_eq!(function.at(3000.0), (DVec3::new(1.0, 1.0, 0.0), 0.5));
        assert_eq!(read("0 0 127.5 255 0\n1 1 1 1 1").unwrap().at(0.0).0.y, half);
        assert_eq!(read("0 0\n1 1").unwrap(), TransferFunction::grey([0.0, 1.0]));
    }

    #[test]
    fn mistakes_are_named_with_file_and_place() {
        let many = "0 1\n".repeat(MAX_POINTS + 1);
        let deep = "[".repeat(100_000);
        let ignored = format!("{{\"x\": {deep}");
        let flat = format!("[{{\"RGBPoints\":[0{}]}}]", ",0".repeat(4 * MAX_POINTS + 3));
        let long = " ".repeat(MAX_BYTES + 1);
        let cases = [
            ("", "no points"),
            ("# nothing", "no points"),
            (&many, "line 65537: more than 65536 points"),
            (&long, "the limit is 16777216"),
            ("0 1\n1 2 3", "line 2: 3 numbers, expected 2 or 5"),
            ("0 1 2 3 4 5 6 7", "line 1: more than 5 numbers"),
            ("0 1\n1 0 0 0 1", "line 2: 5 numbers, but earlier lines have 2"),
            ("0 nan", "line 1: 'nan' is not a finite number"),
            ("0 1\n\n1 x\u{1b}y", "line 3: 'x?y' is not a finite number"),
            ("0 1e999", "line 1: '1e999' is not a finite number"),
            ("0 1.5", "line 1: opacity is 1.5"),
            ("#\n1 0\n0 0", "line 3: value falls from 1 to 0"),
            ("0 0 0 300 1", "line 1: blue is 300, not in 0..255"),
            ("0 0 -1 0 1", "line 1: green is -1, not in 0..1"),
            ("\u{0}\u{1}PNG", "line 1: '??PNG' is not a finite number"),
            (&deep, "line 1: invalid type: sequence"),
            (&ignored, "line 1: EOF"),
            (&flat, "'RGBPoints': it has 65537 points"),
            ("[", "line 1: EOF"),
            ("[]", "no color map in it has 'RGBPoints'"),
            ("{\"Points\": [0, 1, 0.5, 0]}", "has 'RGBPoints'"),
            ("[{\n\"RGBPoints\": 7}]", "line 2: invalid type"),
            ("[{\"RGBPoints\": []}]", "'RGBPoints': it has no points"),
            ("[{\"RGBPoints\": [0, 0, 0]}]", "'RGBPoints' has 3 numbers, not a multiple of 4"),
            ("[{\"RGBPoints\": [0, 0, 2, 0]}]", "point 1 of 'RGBPoints': green is 2"),
            ("[{\"RGBPoints\": [1, 0, 0, 0, 0, 0, 0, 0]}]", "point 2 of 'RGBPoints': value falls"),
            ("[{\"RGBPoints\": [NaN, 0, 0, 0]}]", "line 1: expected value"),
            ("[{\"RGBPoints\": [1e999, 0, 0, 0]}]", "line 1: number out of range"),
            ("[{\"RGBPoints\": [1e99, 0, 0, 0]}]", "point 1 of 'RGBPoints': value is 1e99"),
            (
                "[{\"RGBPoints\": [0, 0, 0, 0], \"Points\": [0, -1, 0, 0]}]",
                "point 1 of 'Points': opacity is -1",
            ),
        ];
        for (text, named) in cases {
            let error = read(text).unwrap_err().to_string();
            assert!(
                error.starts_with("maps/a.json: ") && error.contains(named),
                "{named}: {error}"
            );
            assert!(!error.contains(char::is_control) && error.len() < 300, "{named}: {error}");
        }
    }

    #[test]
    fn mutated_files_give_a_valid_function_or_an_error() {
        const LIST: &str =
            "# list\n-1000 0 0.5 1 0\n0 1 1 0 .5\n0, 1, 1, 0, .7\n3000\t1\t1\t1\t1\n";
        const INSERTED: &[u8] = b"\x00\n\r []{},:\"#-+.eE019nN\xc3\xff\\u";
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        let mut below = |count: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % count as u64) as usize
        };
        let mut good = 0;
        for round in 0..6000 {
            let mut bytes = [PARAVIEW, LIST][round % 2].as_bytes().to_vec();
            for _ in 0..=below(4) {
                let at = below(bytes.len().max(1)).min(bytes.len());
                match below(5) {
                    0 => bytes.truncate(at),
                    1 => bytes.insert(at, INSERTED[below(INSERTED.len())]),
                    2 if at < bytes.len() => bytes[at] ^= 1 << below(8),
                    3 => drop(bytes.splice(at.., bytes[at / 2..].to_vec()).count()),
                    _ => drop(bytes.drain(at..(at + below(9)).min(bytes.len())).count()),
                }
            }
            match read(&String::from_utf8_lossy(&bytes)) {
                Ok(function) => {
                    assert_eq!(fault(function.points()), None);
                    assert!((0.0..=1.0).contains(&function.at(1.0).1));
                    good += 1;
                }
                Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
            }
        }
        assert!((100..5000).contains(&good), "{good} of 6000 were still read");
    }
}
