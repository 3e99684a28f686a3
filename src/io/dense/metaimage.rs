//! MetaImage (`.mha`, and `.mhd` with the voxels in a second file): bare, deflated or as text.

use glam::DVec3;

use super::grid::DenseGrid;
use super::header_lines::{HeaderLines, Style};
use super::input::Input;
use super::payload::{Packing, Payload};
use super::space::anatomical_orientation;
use super::write::{numbers, one_line, steps};
use super::{DenseHeader, Space, named_by, placed};
use crate::error::{Error, Result};
use crate::io::files;
use crate::io::number::{Endian, ValueType};

/// `Key = value` lines; the last one says where the voxels are.
const STYLE: Style = Style {
    separators: &["="],
    key_separator: None,
    skipped_lines: 0,
    last_key: Some("ElementDataFile"),
    any_case: false,
    form: "key = value",
};

fn is_true(fields: &HeaderLines, names: &[&str]) -> bool {
    fields.get(names).is_some_and(|value| value.starts_with(['T', 't', '1']))
}

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let fields = HeaderLines::read(input, &STYLE)?;
    let needed = |name: &str| fields.get(&[name]).ok_or_else(|| input.bad(format!("no '{name}'")));
    let [axes] = input.numbers::<usize, 1>("NDims", needed("NDims")?)?;
    if axes != 3 {
        return Err(input.bad(format!("{axes} axes, expected three")));
    }
    let lengths = input.numbers::<i64, 3>("DimSize", needed("DimSize")?)?;
    let value_type = number_type(input, needed("ElementType")?)?;
    let mut header = DenseHeader::new(input.dims(lengths)?, value_type);
    if let Some(count) = fields.get(&["ElementNumberOfChannels"]) {
        [header.components] = input.numbers::<usize, 1>("ElementNumberOfChannels", count)?;
    }
    if is_true(&fields, &["ElementByteOrderMSB", "BinaryDataByteOrderMSB"]) {
        header.endian = Endian::Big;
    }
    header.world_from_index = transform(input, &fields)?;
    // Positions are in a patient's space, LPS, if the file gives the patient's orientation.
    let orientation = fields.get(&["AnatomicalOrientation"]);
    header.space = orientation.filter(|text| !text.starts_with('?')).map(|_| Space::Lps);
    header.name = fields.get(&["Name"]).map(str::to_owned);
    let known = ["NDims", "DimSize", "ElementType", "BinaryData", "BinaryDataByteOrderMSB"];
    header.metadata = fields.without(&known);
    let payload = payload(input, &fields, &mut header)?;
    Ok((header, payload))
}

fn number_type(input: &Input, text: &str) -> Result<ValueType> {
    // Arrays of channels use the same number types.
    let name = text.strip_suffix("_ARRAY").unwrap_or(text);
    Ok(match name {
        "MET_CHAR" => ValueType::I8,
        "MET_UCHAR" => ValueType::U8,
        "MET_SHORT" => ValueType::I16,
        "MET_USHORT" => ValueType::U16,
        "MET_INT" | "MET_LONG" => ValueType::I32,
        "MET_UINT" | "MET_ULONG" => ValueType::U32,
        "MET_LONG_LONG" => ValueType::I64,
        "MET_ULONG_LONG" => ValueType::U64,
        "MET_FLOAT" => ValueType::F32,
        "MET_DOUBLE" => ValueType::F64,
        _ => return Err(input.bad(format!("ElementType '{text}' is not supported"))),
    })
}

fn transform(input: &Input, fields: &HeaderLines) -> Result<glam::DMat4> {
    let vector = |names: &[&str], otherwise: DVec3| match fields.get(names) {
        Some(text) => input.numbers::<f64, 3>(names[0], text).map(DVec3::from),
        None => Ok(otherwise),
    };
    let spacing = vector(&["ElementSpacing", "ElementSize"], DVec3::ONE)?;
    let origin = vector(&["Offset", "Origin", "Position"], DVec3::ZERO)?;
    let mut steps = [DVec3::X, DVec3::Y, DVec3::Z];
    let names = ["TransformMatrix", "Rotation", "Orientation"];
    if let Some(text) = fields.get(&names) {
        // Three numbers in sequence are the direction of one axis.
        let numbers = input.numbers::<f64, 9>("TransformMatrix", text)?;
        for (step, direction) in steps.iter_mut().zip(numbers.as_chunks::<3>().0) {
            *step = DVec3::from(*direction);
        }
    }
    for (axis, step) in steps.iter_mut().enumerate() {
        *step *= spacing[axis];
    }
    Ok(placed(origin, steps))
}

fn payload(input: &Input, fields: &HeaderLines, header: &mut DenseHeader) -> Result<Payload> {
    let packing = if is_true(fields, &["CompressedData"]) {
        header.compression = "zlib";
        Packing::Zlib
    } else if fields.get(&["BinaryData"]).is_some() && !is_true(fields, &["BinaryData"]) {
        header.compression = "text";
        header.endian = Endian::Little;
        Packing::Text(header.value_type)
    } else {
        Packing::Bare
    };
    let name = fields.get(&["ElementDataFile"]).unwrap_or_default();
    let (path, start, size) = if name.eq_ignore_ascii_case("LOCAL") {
        (input.path.to_owned(), fields.end() as u64, input.size)
    } else if name.starts_with("LIST") || name.contains('%') {
        return Err(input.bad("its voxels are in several files, which is not supported"));
    } else {
        let path = named_by(input.path, name);
        let size = files::metadata(&path).map_err(|error| Error::file(&path, error))?.len();
        (path, 0, size)
    };
    // -1 means that the voxels are the last bytes of the file.
    let offset = match fields.get(&["HeaderSize"]) {
        None => start,
        Some(text) => match input.numbers::<i64, 1>("HeaderSize", text)? {
            [-1] => {
                let due = header.bytes();
                let at = u128::from(size).checked_sub(due).filter(|&at| at >= u128::from(start));
                at.map(|at| at as u64).ok_or_else(|| {
                    let left = size.saturating_sub(start);
                    input.bad(format!("it ends early: {left} bytes of voxels, expected {due}"))
                })?
            }
            [skip] => start.saturating_add(skip.max(0) as u64),
        },
    };
    Ok(Payload::Stored { path, offset, packing, skip: 0 })
}

/// The header for the voxels of `grid`. They are deflated to `packed` bytes or not, and lie in the
/// file `data_file` or directly behind the header.
pub(super) fn head(grid: &DenseGrid, packed: Option<usize>, data_file: Option<&str>) -> String {
    let number_type = match grid.value_type {
        ValueType::F16 | ValueType::F32 => "MET_FLOAT",
        ValueType::F64 => "MET_DOUBLE",
        ValueType::U8 => "MET_UCHAR",
        ValueType::I8 => "MET_CHAR",
        ValueType::U16 => "MET_USHORT",
        ValueType::I16 => "MET_SHORT",
        ValueType::U32 => "MET_UINT",
        ValueType::I32 => "MET_INT",
        ValueType::U64 => "MET_ULONG_LONG",
        ValueType::I64 => "MET_LONG_LONG",
    };
    let [x, y, z] = grid.dims;
    let (steps, origin) = steps(grid);
    let directions = steps.iter().flat_map(|step| (*step / step.length()).to_array());
    let mut lines = vec![
        "ObjectType = Image".to_owned(),
        "NDims = 3".to_owned(),
        "BinaryData = True".to_owned(),
        "BinaryDataByteOrderMSB = False".to_owned(),
        format!("CompressedData = {}", if packed.is_some() { "True" } else { "False" }),
    ];
    lines.extend(packed.map(|size| format!("CompressedDataSize = {size}")));
    if !grid.name.is_empty() {
        lines.push(format!("Name = {}", one_line(&grid.name)));
    }
    lines.extend([
        format!("TransformMatrix = {}", numbers(directions, " ")),
        format!("Offset = {}", numbers(origin.to_array(), " ")),
        "CenterOfRotation = 0 0 0".to_owned(),
    ]);
    if grid.space == Some(Space::Lps) {
        lines.push(format!("AnatomicalOrientation = {}", anatomical_orientation(steps)));
    }
    lines.extend([
        format!("ElementSpacing = {}", numbers(steps.map(DVec3::length), " ")),
        format!("DimSize = {x} {y} {z}"),
    ]);
    if grid.components > 1 {
        lines.push(format!("ElementNumberOfChannels = {}", grid.components));
    }
    lines.push(format!("ElementType = {number_type}"));
    lines.push(format!("ElementDataFile = {}", data_file.unwrap_or("LOCAL")));
    lines.join("\n") + "\n"
}
