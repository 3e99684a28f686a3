//! MetaImage (`.mha`, and `.mhd` with the voxels in a second file): bare, deflated or as text.

use glam::DVec3;

use super::input::Input;
use super::payload::{Packing, Payload};
use super::{DenseHeader, placed};
use crate::error::{Error, Result};
use crate::io::number::{Endian, ValueType};

/// The fields of a header up to `ElementDataFile`, its last one, and where the header ends.
struct Fields {
    fields: Vec<(String, String)>,
    end: usize,
}

impl Fields {
    fn parse(input: &Input) -> Result<Self> {
        let mut fields = Vec::new();
        let mut end = 0;
        for (number, line) in input.head.split_inclusive(|&byte| byte == b'\n').enumerate() {
            end += line.len();
            let line = String::from_utf8_lossy(line);
            if line.trim().is_empty() {
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                return Err(input.bad(format!("line {} is no 'key = value'", number + 1)));
            };
            fields.push((key.trim().to_owned(), value.trim().to_owned()));
            if key.trim() == "ElementDataFile" {
                return Ok(Self { fields, end });
            }
        }
        Err(input.bad("no 'ElementDataFile' ends its header"))
    }

    fn get(&self, names: &[&str]) -> Option<&str> {
        let found = self.fields.iter().find(|(key, _)| names.contains(&key.as_str()));
        found.map(|(_, value)| value.as_str())
    }

    fn is_true(&self, names: &[&str]) -> bool {
        self.get(names).is_some_and(|value| value.starts_with(['T', 't', '1']))
    }
}

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let fields = Fields::parse(input)?;
    let needed = |name: &str| fields.get(&[name]).ok_or_else(|| input.bad(format!("no '{name}'")));
    let [axes] = input.numbers::<usize, 1>("NDims", needed("NDims")?)?;
    if axes != 3 {
        return Err(input.bad(format!("{axes} axes, a volume has three")));
    }
    let lengths = input.numbers::<i64, 3>("DimSize", needed("DimSize")?)?;
    let value_type = number_type(input, needed("ElementType")?)?;
    let mut header = DenseHeader::new(input.dims(lengths)?, value_type);
    if let Some(count) = fields.get(&["ElementNumberOfChannels"]) {
        [header.components] = input.numbers::<usize, 1>("ElementNumberOfChannels", count)?;
    }
    if fields.is_true(&["ElementByteOrderMSB", "BinaryDataByteOrderMSB"]) {
        header.endian = Endian::Big;
    }
    header.world_from_index = transform(input, &fields)?;
    header.name = fields.get(&["Name"]).map(str::to_owned);
    let known = ["NDims", "DimSize", "ElementType", "BinaryData", "BinaryDataByteOrderMSB"];
    let mut metadata = fields.fields.clone();
    metadata.retain(|(key, _)| !known.contains(&key.as_str()));
    header.metadata = metadata;
    let payload = payload(input, &fields, &mut header)?;
    Ok((header, payload))
}

fn number_type(input: &Input, text: &str) -> Result<ValueType> {
    // An array of channels has the same numbers.
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
        _ => return Err(input.bad(format!("ElementType '{text}' is not read"))),
    })
}

fn transform(input: &Input, fields: &Fields) -> Result<glam::DMat4> {
    let vector = |names: &[&str], otherwise: DVec3| match fields.get(names) {
        Some(text) => input.numbers::<f64, 3>(names[0], text).map(DVec3::from),
        None => Ok(otherwise),
    };
    let spacing = vector(&["ElementSpacing", "ElementSize"], DVec3::ONE)?;
    let origin = vector(&["Offset", "Origin", "Position"], DVec3::ZERO)?;
    let mut steps = [DVec3::X, DVec3::Y, DVec3::Z];
    let names = ["TransformMatrix", "Rotation", "Orientation"];
    if let Some(text) = fields.get(&names) {
        // Three numbers after each other are the direction of one axis.
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

fn payload(input: &Input, fields: &Fields, header: &mut DenseHeader) -> Result<Payload> {
    let packing = if fields.is_true(&["CompressedData"]) {
        header.compression = "zlib";
        Packing::Zlib
    } else if fields.get(&["BinaryData"]).is_some() && !fields.is_true(&["BinaryData"]) {
        header.compression = "text";
        header.endian = Endian::Little;
        Packing::Text(header.value_type)
    } else {
        Packing::Bare
    };
    let name = fields.get(&["ElementDataFile"]).unwrap_or_default();
    let (path, start, size) = if name.eq_ignore_ascii_case("LOCAL") {
        (input.path.to_owned(), fields.end as u64, input.size)
    } else if name.starts_with("LIST") || name.contains('%') {
        return Err(input.bad("its voxels lie in several files, which is not read"));
    } else {
        let path = input.path.with_file_name("").join(name);
        let size = std::fs::metadata(&path).map_err(|error| Error::file(&path, error))?.len();
        (path, 0, size)
    };
    // -1 says that the voxels are the last bytes of the file.
    let offset = match fields.get(&["HeaderSize"]) {
        None => start,
        Some(text) => match input.numbers::<i64, 1>("HeaderSize", text)? {
            [-1] => u128::from(size).saturating_sub(header.bytes()) as u64,
            [skip] => start.saturating_add(skip.max(0) as u64),
        },
    };
    Ok(Payload::Stored { path, offset, packing, skip: 0 })
}
