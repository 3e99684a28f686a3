//! NRRD (`.nrrd`, and `.nhdr` with the voxels in a second file): raw, gzip or text, with spacings,
//! or with axes and an origin in the file's own world.

use std::path::Path;

use glam::DVec3;

use super::grid::DenseGrid;
use super::header_lines::{HeaderLines, Style};
use super::input::Input;
use super::payload::{Packing, Payload};
use super::write::{numbers, one_line, steps};
use super::{DenseHeader, Space, named_by, placed};
use crate::error::Result;
use crate::io::files;
use crate::io::number::{Endian, ValueType};

/// `field: value` and `key:=value` lines, from behind the first line, which is the magic number, up
/// to an empty line.
const STYLE: Style = Style {
    separators: &[":=", ":"],
    key_separator: Some(":="),
    skipped_lines: 1,
    last_key: None,
    any_case: true,
    form: "field: value",
};

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let fields = HeaderLines::read(input, &STYLE)?;
    let needed =
        |name: &str| fields.get(&[name]).ok_or_else(|| input.bad(format!("no field '{name}'")));
    let sizes: Option<Vec<i64>> =
        needed("sizes")?.split_ascii_whitespace().take(17).map(|word| word.parse().ok()).collect();
    let sizes = sizes.ok_or_else(|| input.bad("its sizes are not numbers"))?;
    let [axes] = input.numbers::<usize, 1>("dimension", needed("dimension")?)?;
    if sizes.len() != axes {
        return Err(input.bad(format!("{} sizes for {axes} axes", sizes.len())));
    }
    let Axes { components, first } = axes_of(input, &fields, &sizes)?;
    let lengths = [sizes[first], sizes[first + 1], sizes[first + 2]];
    let mut header = DenseHeader::new(input.dims(lengths)?, number_type(input, needed("type")?)?);
    header.components = usize::try_from(components).unwrap_or(0);
    header.endian = match fields.get(&["endian"]) {
        Some("big") => Endian::Big,
        Some("little") | None => Endian::Little,
        Some(other) => return Err(input.bad(format!("endian '{other}' is not one of little, big"))),
    };
    place(input, &fields, [axes, first], &mut header)?;
    header.name = fields.get(&["content"]).map(str::to_owned);
    header.metadata = fields.without(&HEEDED);
    let payload = payload(input, &fields, &mut header)?;
    Ok((header, payload))
}

/// Which axes are spatial.
struct Axes {
    /// Numbers per voxel.
    components: i64,
    /// Index of the first of three adjacent spatial axes.
    first: usize,
}

/// The meaning of the axes by `kinds` and `space directions`; without them, three axes are spatial.
fn axes_of(input: &Input, fields: &HeaderLines, sizes: &[i64]) -> Result<Axes> {
    let axes = sizes.len();
    let kinds: Vec<String> = fields
        .get(&["kinds"])
        .map(|list| list.split_ascii_whitespace().map(str::to_ascii_lowercase).collect())
        .unwrap_or_default();
    let directions = fields.get(&["space directions"]).map(direction_words).unwrap_or_default();
    let is_space = |axis: usize| match (directions.get(axis), kinds.get(axis)) {
        (Some(word), _) => Some(*word != "none"),
        (None, Some(kind)) if kind == "domain" || kind == "space" => Some(true),
        (None, Some(kind)) if kind != "???" && kind != "none" => Some(false),
        _ => None,
    };
    let is_frames =
        |axis: usize| kinds.get(axis).is_some_and(|kind| ["time", "list"].contains(&kind.as_str()));
    let not_space = |axis: usize| is_space(axis) == Some(false) || is_frames(axis);
    let frames = |axis: usize| {
        let why = format!("{} frames along axis {axis}; only one is supported", sizes[axis]);
        Err(input.bad(why))
    };
    match axes {
        3 => match (0..3).find(|&axis| not_space(axis)) {
            None => Ok(Axes { components: 1, first: 0 }),
            Some(axis) if sizes[axis] == 1 && axis == 2 => Ok(Axes { components: 1, first: 0 }),
            Some(axis) => {
                let kind = kinds.get(axis).map_or("none", String::as_str);
                let why = format!("axis {axis} is '{kind}', but a volume has three axes of space");
                Err(input.bad(why))
            }
        },
        4 if not_space(3) && (0..3).all(|axis| !not_space(axis)) => {
            if sizes[3] == 1 {
                return Ok(Axes { components: 1, first: 0 });
            }
            if is_frames(3) || kinds.get(3).is_none() {
                return frames(3);
            }
            Err(input.bad(format!(
                "its {} numbers per voxel are stored apart from each other",
                sizes[3]
            )))
        }
        4 if not_space(0) && (1..4).all(|axis| !not_space(axis)) => {
            if is_frames(0) && sizes[0] != 1 {
                return frames(0);
            }
            Ok(Axes { components: sizes[0], first: 1 })
        }
        _ => {
            let why = format!(
                "{axes} axes, expected three (and one before them for vectors, marked by 'kinds')"
            );
            Err(input.bad(why))
        }
    }
}

/// One word per axis: `none`, or a vector in brackets.
fn direction_words(list: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = list.trim_start();
    while !rest.is_empty() && words.len() < 17 {
        let end = if rest.starts_with('(') {
            rest.find(')').map(|at| at + 1)
        } else {
            rest.find([' ', '\t', '('])
        };
        let (word, behind) = rest.split_at(end.unwrap_or(rest.len()));
        words.push(word);
        rest = behind.trim_start();
    }
    words
}

fn number_type(input: &Input, text: &str) -> Result<ValueType> {
    Ok(match text {
        "signed char" | "int8" | "int8_t" => ValueType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => ValueType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            ValueType::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            ValueType::U16
        }
        "int" | "signed int" | "int32" | "int32_t" => ValueType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => ValueType::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => ValueType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            ValueType::U64
        }
        "float" => ValueType::F32,
        "double" => ValueType::F64,
        _ => return Err(input.bad(format!("number type '{text}' is not supported"))),
    })
}

/// Sets the transform: from `space directions` and `space origin` in `space`, or else from
/// `spacings`, `axis mins` and `axis maxs`, which have no space. Of the file's axes, three from
/// `first` on are spatial.
fn place(
    input: &Input,
    fields: &HeaderLines,
    [axes, first]: [usize; 2],
    header: &mut DenseHeader,
) -> Result<()> {
    let mut steps = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut origin = DVec3::ZERO;
    if let Some(list) = fields.get(&["space directions"]) {
        let words = direction_words(list);
        if words.len() != axes {
            return Err(input.bad(format!("{} space directions for {axes} axes", words.len())));
        }
        for (step, word) in steps.iter_mut().zip(&words[first..]) {
            *step = vector(input, "space directions", word)?;
        }
    } else {
        for (axis, step) in steps.iter_mut().enumerate() {
            let (spacing, at) = along(input, fields, [axes, first + axis], header.dims[axis])?;
            *step *= spacing;
            origin[axis] = at;
        }
        if fields.get(&["axis mins"]).is_some() && fields.get(&["centerings", "centers"]).is_none()
        {
            let note = "axis mins without centerings are taken as the borders of voxels, as in \
                        teem (`volume.spacing`)";
            header.notes.push(note.to_owned());
        }
    }
    if let Some(text) = fields.get(&["space origin"]) {
        origin = vector(input, "space origin", text)?;
    }
    header.world_from_index = placed(origin, steps);
    if let Some(text) = fields.get(&["space"]) {
        let Some((space, ours_from_its)) = Space::named(text) else {
            return Err(input.bad(format!("space '{text}' is not one of {}", Space::names())));
        };
        header.space = Some(space);
        header.world_from_index = ours_from_its * header.world_from_index;
    }
    Ok(())
}

/// For axis `axis` of `axes`, the distance between its `count` samples, and the position of the
/// first one.
fn along(
    input: &Input,
    fields: &HeaderLines,
    [axes, axis]: [usize; 2],
    count: usize,
) -> Result<(f64, f64)> {
    let number = |names: &[&str]| -> Result<Option<f64>> {
        let Some(list) = fields.get(names) else { return Ok(None) };
        let words: Vec<&str> = list.split_ascii_whitespace().collect();
        if words.len() != axes {
            return Err(input.bad(format!("{} {} for {axes} axes", words.len(), names[0])));
        }
        let [number] = input.numbers::<f64, 1>(names[0], words[axis])?;
        // Unknown numbers are written as NaN.
        Ok(Some(number).filter(|number| !number.is_nan()))
    };
    let centerings = fields.get(&["centerings", "centers"]).unwrap_or_default();
    // Without a centering, teem takes cells.
    let of_nodes = centerings.split_ascii_whitespace().nth(axis) == Some("node");
    let [low, high] = [number(&["axis mins", "axismins"])?, number(&["axis maxs", "axismaxs"])?];
    let lengths = if of_nodes { count as f64 - 1.0 } else { count as f64 };
    let between = low.zip(high).map(|(low, high)| (high - low) / lengths.max(1.0));
    let spacing = number(&["spacings"])?.or(between).unwrap_or(1.0);
    let first = low.map_or(0.0, |low| if of_nodes { low } else { low + 0.5 * spacing });
    Ok((spacing, first))
}

/// Parses `(x,y,z)`; further components, which a space with time has, are ignored.
fn vector(input: &Input, field: &str, text: &str) -> Result<DVec3> {
    let inner = text.trim().trim_start_matches('(').trim_end_matches(')');
    let words: Vec<&str> = inner.split(',').collect();
    let three = if words.len() == 4 { words[..3].join(",") } else { inner.to_owned() };
    input.numbers::<f64, 3>(field, &three).map(DVec3::from)
}

fn payload(input: &Input, fields: &HeaderLines, header: &mut DenseHeader) -> Result<Payload> {
    let encoding = fields.get(&["encoding"]).unwrap_or("raw").to_ascii_lowercase();
    let packing = match encoding.as_str() {
        "raw" => Packing::Bare,
        "gz" | "gzip" => {
            header.compression = "gzip";
            Packing::Gzip
        }
        "txt" | "text" | "ascii" => {
            header.compression = "text";
            header.endian = Endian::Little;
            Packing::Text(header.value_type)
        }
        other => return Err(input.bad(format!("encoding '{other}' is not supported"))),
    };
    let (path, start, size) = match fields.get(&["data file", "datafile"]) {
        None => (input.path.to_owned(), fields.end() as u64, input.size),
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(input.bad("its voxels are in several files, which is not supported"));
        }
        Some(name) => {
            let path = named_by(input.path, name);
            let size = files::metadata(&path).map_err(|e| crate::Error::file(&path, e))?.len();
            (path, 0, size)
        }
    };
    let number = |names: &[&str]| -> Result<i64> {
        let text = fields.get(names).unwrap_or("0");
        input.numbers::<i64, 1>(names[0], text).map(|[n]| n)
    };
    let lines = number(&["line skip", "lineskip"])?;
    let skip = number(&["byte skip", "byteskip"])?;
    let lines =
        usize::try_from(lines).map_err(|_| input.bad(format!("line skip {lines} is below 0")))?;
    let start = if lines == 0 { start } else { behind_lines(input, &path, start, lines)? };
    // -1 means that the voxels are the last bytes of the file.
    let (offset, skip) = match u64::try_from(skip) {
        Ok(skip) if packing == Packing::Bare => (start.saturating_add(skip), 0),
        Ok(skip) => (start, skip),
        Err(_) if skip == -1 && packing == Packing::Bare => {
            (last_bytes(input, size, start, header)?, 0)
        }
        Err(_) if skip == -1 => {
            let why =
                format!("byte skip -1 with encoding {encoding} is not supported; unpack it first");
            return Err(input.bad(why));
        }
        Err(_) => return Err(input.bad(format!("byte skip {skip} is below 0"))),
    };
    Ok(Payload::Stored { path, offset, packing, skip })
}

/// The offset of voxels that are the last bytes of a file of `size` bytes; at least `start`.
fn last_bytes(input: &Input, size: u64, start: u64, header: &DenseHeader) -> Result<u64> {
    let due = header.bytes();
    let offset = u128::from(size).checked_sub(due).filter(|&at| at >= u128::from(start));
    offset.map(|at| at as u64).ok_or_else(|| {
        let left = size.saturating_sub(start);
        input.bad(format!("it ends early: {left} bytes of voxels, expected {due}"))
    })
}

/// The offset at which line number `lines` behind byte `start` of the file begins.
fn behind_lines(input: &Input, path: &Path, start: u64, lines: usize) -> Result<u64> {
    let ends = || input.bad(format!("line skip {lines}: there are fewer lines"));
    // A header may name any file, but opening a pipe would block, and a device never ends.
    let metadata = files::metadata(path).map_err(|e| crate::Error::file(path, e))?;
    if !metadata.is_file() {
        return Err(input.bad("the header's voxels are not in a file"));
    }
    let voxels = Input::open(path, input.max_bytes)?;
    let from = usize::try_from(start).map_err(|_| ends())?;
    let text = voxels.head.get(from..).ok_or_else(ends)?;
    let mut breaks = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
    breaks.nth(lines - 1).map(|(at, _)| start + at as u64 + 1).ok_or_else(ends)
}

/// Fields that are interpreted, or that no longer apply to the converted voxels.
const HEEDED: [&str; 18] = [
    "sizes",
    "dimension",
    "type",
    "endian",
    "encoding",
    "space directions",
    "space",
    "space dimension",
    "space origin",
    "spacings",
    "axis mins",
    "axismins",
    "axis maxs",
    "axismaxs",
    "centerings",
    "centers",
    "kinds",
    "content",
];

/// The header for the voxels of `grid`, which lie in the file `data_file` or directly behind it.
pub(super) fn head(grid: &DenseGrid, packed: bool, data_file: Option<&str>) -> String {
    let number_type = match grid.value_type {
        ValueType::F16 | ValueType::F32 => "float",
        ValueType::F64 => "double",
        ValueType::U8 => "uint8",
        ValueType::I8 => "int8",
        ValueType::U16 => "uint16",
        ValueType::I16 => "int16",
        ValueType::U32 => "uint32",
        ValueType::I32 => "int32",
        ValueType::U64 => "uint64",
        ValueType::I64 => "int64",
    };
    let [x, y, z] = grid.dims;
    let vectors = grid.components > 1;
    let before = |word: &str| if vectors { format!("{word} ") } else { String::new() };
    let in_brackets = |v: DVec3| format!("({})", numbers(v.to_array(), ","));
    let (steps, origin) = steps(grid);
    let [dx, dy, dz] = steps.map(in_brackets);
    let mut lines = vec![
        "NRRD0004".to_owned(),
        format!("type: {number_type}"),
        format!("dimension: {}", 3 + usize::from(vectors)),
        match grid.space {
            Some(space) => format!("space: {}", space.name()),
            None => "space dimension: 3".to_owned(),
        },
        format!("sizes: {}{x} {y} {z}", before(&grid.components.to_string())),
        format!("space directions: {}{dx} {dy} {dz}", before("none")),
        format!("kinds: {}domain domain domain", before("vector")),
        "endian: little".to_owned(),
        format!("encoding: {}", if packed { "gzip" } else { "raw" }),
        format!("space origin: {}", in_brackets(origin)),
    ];
    if !grid.name.is_empty() {
        lines.push(format!("content: {}", one_line(&grid.name)));
    }
    for (key, value) in &grid.metadata {
        // A colon ends a field's name, and a number sign begins a comment.
        let key = one_line(key).replace([':', '='], "_");
        let key = key.trim_start_matches('#');
        lines.push(format!("{key}:={}", one_line(value)));
    }
    if let Some(name) = data_file {
        lines.push(format!("data file: {name}"));
    }
    lines.join("\n") + "\n\n"
}
