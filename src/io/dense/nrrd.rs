//! NRRD (`.nrrd`, and `.nhdr` with the voxels in a second file): raw, gzip or text, with spacings
//! or with axes and an origin in a world of the file's own.

use glam::DVec3;

use super::grid::DenseGrid;
use super::header_lines::{HeaderLines, Style};
use super::input::Input;
use super::payload::{Packing, Payload};
use super::write::{numbers, one_line, steps};
use super::{DenseHeader, named_by, placed};
use crate::error::Result;
use crate::io::number::{Endian, ValueType};

/// `field: value` and `key:=value` behind the first line, which is the mark, up to an empty one.
const STYLE: Style = Style {
    separators: &[":=", ":"],
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
    let sizes = sizes.ok_or_else(|| input.bad("its sizes are no numbers"))?;
    let [axes] = input.numbers::<usize, 1>("dimension", needed("dimension")?)?;
    if sizes.len() != axes {
        return Err(input.bad(format!("{} sizes for {axes} axes", sizes.len())));
    }
    // A fourth axis in front holds the components of a vector or a colour.
    let (components, lengths) = match *sizes.as_slice() {
        [x, y, z] => (1, [x, y, z]),
        [c, x, y, z] if first_axis_is_no_space(&fields) => (c, [x, y, z]),
        _ => {
            let why = format!("{axes} axes, a volume has three (and one before them for vectors)");
            return Err(input.bad(why));
        }
    };
    let mut header = DenseHeader::new(input.dims(lengths)?, number_type(input, needed("type")?)?);
    header.components = usize::try_from(components).unwrap_or(0);
    header.endian = match fields.get(&["endian"]) {
        Some("big") => Endian::Big,
        Some("little") | None => Endian::Little,
        Some(other) => return Err(input.bad(format!("endian '{other}' is none of little, big"))),
    };
    header.world_from_index = transform(input, &fields, axes)?;
    header.name = fields.get(&["content"]).map(str::to_owned);
    let known = ["sizes", "dimension", "type", "endian", "encoding", "space directions"];
    let mut metadata = fields.all().to_vec();
    metadata.retain(|(key, _)| !known.contains(&key.as_str()));
    header.metadata = metadata;
    let payload = payload(input, &fields, &mut header)?;
    Ok((header, payload))
}

fn first_axis_is_no_space(fields: &HeaderLines) -> bool {
    let first =
        |name: &[&str]| fields.get(name).and_then(|list| list.split_ascii_whitespace().next());
    match (first(&["kinds"]), first(&["space directions"])) {
        (Some(kind), _) => !["domain", "space", "time", "list"].contains(&kind),
        (None, Some(direction)) => direction == "none",
        (None, None) => false,
    }
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
        _ => return Err(input.bad(format!("number type '{text}' is not read"))),
    })
}

/// The steps and the origin: `space directions` and `space origin`, or else `spacings`.
fn transform(input: &Input, fields: &HeaderLines, axes: usize) -> Result<glam::DMat4> {
    let mut steps = [DVec3::X, DVec3::Y, DVec3::Z];
    if let Some(list) = fields.get(&["space directions"]) {
        let vectors: Vec<&str> = list.split_inclusive(')').map(str::trim).collect();
        let spatial = vectors.iter().filter_map(|text| Some((text, text.find('(')?)));
        let spatial: Vec<&str> = spatial.map(|(text, open)| &text[open..]).collect();
        if spatial.len() != 3 {
            return Err(input.bad(format!("{} space directions, a volume has 3", spatial.len())));
        }
        for (step, text) in steps.iter_mut().zip(spatial) {
            *step = vector(input, "space directions", text)?;
        }
    } else if let Some(list) = fields.get(&["spacings"]) {
        let words: Vec<&str> = list.split_ascii_whitespace().collect();
        if words.len() != axes {
            return Err(input.bad(format!("{} spacings for {axes} axes", words.len())));
        }
        for (step, word) in steps.iter_mut().zip(&words[axes - 3..]) {
            let [spacing] = input.numbers::<f64, 1>("spacings", word)?;
            // Unknown spacings are written as NaN.
            *step *= if spacing.is_nan() { 1.0 } else { spacing };
        }
    }
    let origin = fields.get(&["space origin"]);
    let origin = origin.map(|text| vector(input, "space origin", text)).transpose()?;
    Ok(placed(origin.unwrap_or_default(), steps))
}

/// `(x,y,z)`
fn vector(input: &Input, field: &str, text: &str) -> Result<DVec3> {
    let inner = text.trim().trim_start_matches('(').trim_end_matches(')');
    input.numbers::<f64, 3>(field, inner).map(DVec3::from)
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
        other => return Err(input.bad(format!("encoding '{other}' is not read"))),
    };
    let (path, start, size) = match fields.get(&["data file", "datafile"]) {
        None => (input.path.to_owned(), fields.end() as u64, input.size),
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(input.bad("its voxels lie in several files, which is not read"));
        }
        Some(name) => {
            let path = named_by(input.path, name);
            let size = std::fs::metadata(&path).map_err(|e| crate::Error::file(&path, e))?.len();
            (path, 0, size)
        }
    };
    let number = |names: &[&str]| -> Result<i64> {
        let text = fields.get(names).unwrap_or("0");
        input.numbers::<i64, 1>(names[0], text).map(|[n]| n)
    };
    let lines = number(&["line skip", "lineskip"])?;
    let skip = number(&["byte skip", "byteskip"])?;
    if lines != 0 {
        return Err(input.bad(format!("line skip {lines}, which is not read")));
    }
    // -1 says that the voxels are the last bytes of the file.
    let (offset, skip) = match u64::try_from(skip) {
        Ok(skip) if packing == Packing::Bare => (start.saturating_add(skip), 0),
        Ok(skip) => (start, skip),
        Err(_) if skip == -1 && packing == Packing::Bare => {
            (u128::from(size).saturating_sub(header.bytes()) as u64, 0)
        }
        Err(_) => return Err(input.bad(format!("byte skip {skip}"))),
    };
    Ok(Payload::Stored { path, offset, packing, skip })
}

/// Fields that a reader heeds.
const FIELDS: [&str; 18] = [
    "type",
    "dimension",
    "sizes",
    "kinds",
    "endian",
    "encoding",
    "content",
    "spacings",
    "space",
    "space dimension",
    "space directions",
    "space origin",
    "data file",
    "datafile",
    "byte skip",
    "byteskip",
    "line skip",
    "lineskip",
];

/// The header for the voxels of `grid`, in the file `data_file` or right behind it.
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
        "space dimension: 3".to_owned(),
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
        // A colon ends a field's name, and a sharp begins a comment.
        let key = one_line(key).replace([':', '='], "_");
        let key = key.trim_start_matches('#');
        // A key that is also a field of the format stays a key.
        let mark = if FIELDS.iter().any(|name| key.eq_ignore_ascii_case(name)) { "_" } else { "" };
        lines.push(format!("{key}{mark}:={}", one_line(value)));
    }
    if let Some(name) = data_file {
        lines.push(format!("data file: {name}"));
    }
    lines.join("\n") + "\n\n"
}
