//! VTK image data (`.vti`): an XML document around arrays of points or cells. The first array with
//! one component is the volume, unless the file marks another one as its scalars or a name is
//! given.

use std::borrow::Cow;

use glam::{DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::input::Input;
use super::payload::Payload;
use super::vti_data::{Coding, Packed};
use super::{DenseHeader, placed};
use crate::error::{Result, memory};
use crate::io::number::{Endian, ValueType, encode_text};

/// What the file says outside of its arrays.
#[derive(Default)]
struct Document<'a> {
    coding: Coding,
    endian: Endian,
    origin: Option<String>,
    spacing: Option<String>,
    direction: Option<String>,
    extents: Vec<String>,
    arrays: Vec<Array<'a>>,
    /// Encoding of the appended data, and the offset where it starts.
    appended: Option<(String, usize)>,
}

#[derive(Default)]
struct Array<'a> {
    name: String,
    value_type: String,
    components: String,
    format: String,
    offset: String,
    texts: Vec<Cow<'a, [u8]>>,
    of_cells: bool,
    /// Whether its section marks it as the scalars.
    marked: bool,
}

impl Array<'_> {
    /// Whether it has one number per voxel.
    fn is_scalar(&self) -> bool {
        matches!(self.components.as_str(), "" | "0" | "1")
    }

    /// Whether it is one of VTK's own arrays, which describe other arrays: which values are valid,
    /// where they come from.
    fn serves(&self) -> bool {
        const OWN: [&str; 4] = ["vtkValid", "vtkGhost", "vtkOriginal", "vtkInterpolated"];
        OWN.iter().any(|own| self.name.starts_with(own))
    }
}

pub(super) fn read(input: &Input, name: Option<&str>) -> Result<(DenseHeader, Payload)> {
    let whole = input.whole()?;
    let document = parse(input, &whole)?;
    let names = || {
        let names: Vec<&str> = document.arrays.iter().map(|array| array.name.as_str()).collect();
        if names.is_empty() { "no arrays".to_owned() } else { names.join(", ") }
    };
    let first =
        |wanted: &dyn Fn(&Array) -> bool| document.arrays.iter().find(|array| wanted(array));
    let array = match name {
        Some(name) => first(&|array| array.name == name)
            .ok_or_else(|| input.bad(format!("no array '{name}'; it has {}", names())))?,
        None => first(&|array| array.marked && !array.serves())
            .or_else(|| first(&|array| array.is_scalar() && !array.serves()))
            .or_else(|| first(&|array| !array.serves()))
            .or_else(|| first(&|_| true))
            .ok_or_else(|| input.bad("it has no array of points or cells"))?,
    };
    let mut header = describe(input, &document, array)?;
    let other = |other: &&Array| !std::ptr::eq(*other, array) && !other.serves();
    let others: Vec<&str> = document.arrays.iter().filter(other).map(|a| a.name.as_str()).collect();
    if name.is_none() && !array.marked && !others.is_empty() {
        let note =
            format!("array '{}' is read, not {} (`volume.grid`)", array.name, others.join(", "));
        header.notes.push(note);
    }
    let voxels = voxels(input, &whole, &document, array, &mut header)?;
    for other in document.arrays.iter().filter(|other| other.name != array.name) {
        header.metadata.push(("other array".to_owned(), other.name.clone()));
    }
    Ok((header, Payload::Unpacked(voxels)))
}

fn attribute(tag: &BytesStart, name: &str) -> Option<String> {
    let found = tag.try_get_attribute(name).ok().flatten();
    found.map(|attribute| String::from_utf8_lossy(&attribute.value).into_owned())
}

/// Parses the XML up to the appended data, which need not be XML.
fn parse<'a>(input: &Input, whole: &'a [u8]) -> Result<Document<'a>> {
    let mut document = Document::default();
    let mut reader = Reader::from_reader(whole);
    // The section of arrays that is open: whether it is one of cells, and the name of its scalars.
    let mut section: Option<(bool, Option<String>)> = None;
    let mut in_array = false;
    loop {
        let event = reader.read_event().map_err(|error| {
            input.bad(format!("XML: {error} (byte {})", reader.error_position()))
        })?;
        let empty = matches!(event, Event::Empty(_));
        match event {
            Event::Eof => return Ok(document),
            Event::Start(tag) | Event::Empty(tag) => match tag.name().as_ref() {
                b"VTKFile" => file_tag(input, &tag, &mut document)?,
                b"ImageData" => {
                    document.origin = attribute(&tag, "Origin");
                    document.spacing = attribute(&tag, "Spacing");
                    document.direction = attribute(&tag, "Direction");
                }
                b"Piece" => document.extents.push(attribute(&tag, "Extent").unwrap_or_default()),
                b"PointData" | b"CellData" if !empty => {
                    section =
                        Some((tag.name().as_ref() == b"CellData", attribute(&tag, "Scalars")));
                }
                b"DataArray" => {
                    if let Some((of_cells, scalars)) = &section {
                        let text = |name| attribute(&tag, name).unwrap_or_default();
                        let array = Array {
                            name: text("Name"),
                            value_type: text("type"),
                            components: text("NumberOfComponents"),
                            format: text("format"),
                            offset: text("offset"),
                            texts: Vec::new(),
                            of_cells: *of_cells,
                            marked: attribute(&tag, "Name") == *scalars && scalars.is_some(),
                        };
                        document.arrays.push(array);
                        in_array = !empty;
                    }
                }
                b"AppendedData" => {
                    let encoding = attribute(&tag, "encoding").unwrap_or_default();
                    document.appended = Some((encoding, reader.buffer_position() as usize));
                    return Ok(document);
                }
                _ => {}
            },
            Event::End(tag) => match tag.name().as_ref() {
                b"PointData" | b"CellData" => section = None,
                b"DataArray" => in_array = false,
                _ => {}
            },
            Event::Text(text) if in_array => {
                if let Some(array) = document.arrays.last_mut() {
                    array.texts.push(text.into_inner());
                }
            }
            _ => {}
        }
    }
}

fn file_tag(input: &Input, tag: &BytesStart, document: &mut Document) -> Result<()> {
    let kind = attribute(tag, "type").unwrap_or_default();
    if kind != "ImageData" {
        return Err(input.bad(format!("VTK data of type '{kind}'; only ImageData is supported")));
    }
    document.endian = match attribute(tag, "byte_order").as_deref() {
        Some("BigEndian") => Endian::Big,
        _ => Endian::Little,
    };
    let wide = attribute(tag, "header_type").as_deref() == Some("UInt64");
    let packed = match attribute(tag, "compressor").as_deref() {
        None | Some("") => Packed::Bare,
        Some("vtkZLibDataCompressor") => Packed::Zlib,
        Some("vtkLZ4DataCompressor") => Packed::Lz4,
        Some(other) => return Err(input.bad(format!("compressor '{other}' is not supported"))),
    };
    document.coding = Coding { endian: document.endian, wide, packed };
    Ok(())
}

fn describe(input: &Input, document: &Document, array: &Array) -> Result<DenseHeader> {
    let [extent] = document.extents.as_slice() else {
        return Err(input.bad(format!("{} pieces; only one is supported", document.extents.len())));
    };
    let [x0, x1, y0, y1, z0, z1] = input.numbers::<i64, 6>("Extent", extent)?;
    let low = [x0, y0, z0];
    // Cells lie between points, so there is one less.
    let between = i64::from(array.of_cells);
    let mut lengths = [0; 3];
    for (length, (high, low)) in lengths.iter_mut().zip([x1, y1, z1].into_iter().zip(low)) {
        let points = high.checked_sub(low).and_then(|n| n.checked_add(1)).unwrap_or(0);
        *length = if points == 1 { 1 } else { points - between };
    }
    let value_type = match array.value_type.as_str() {
        "Int8" => ValueType::I8,
        "UInt8" => ValueType::U8,
        "Int16" => ValueType::I16,
        "UInt16" => ValueType::U16,
        "Int32" => ValueType::I32,
        "UInt32" => ValueType::U32,
        "Int64" => ValueType::I64,
        "UInt64" => ValueType::U64,
        "Float32" => ValueType::F32,
        "Float64" => ValueType::F64,
        other => return Err(input.bad(format!("number type '{other}' is not supported"))),
    };
    let mut header = DenseHeader::new(input.dims(lengths)?, value_type);
    header.components = match array.components.as_str() {
        "" | "0" => 1,
        text => input.numbers::<usize, 1>("NumberOfComponents", text)?[0],
    };
    header.endian = document.endian;
    header.name = Some(array.name.clone());
    let vector = |key: &str, text: &Option<String>, otherwise: DVec3| match text {
        Some(text) => input.numbers::<f64, 3>(key, text).map(DVec3::from),
        None => Ok(otherwise),
    };
    let origin = vector("Origin", &document.origin, DVec3::ZERO)?;
    let spacing = vector("Spacing", &document.spacing, DVec3::ONE)?;
    let turn = match &document.direction {
        // The rows of a matrix whose columns are the axes.
        Some(text) => DMat3::from_cols_array(&input.numbers("Direction", text)?).transpose(),
        None => DMat3::IDENTITY,
    };
    let steps = [0, 1, 2].map(|axis| turn.col(axis) * spacing[axis]);
    let first = DVec3::from(low.map(|n| n as f64)) + 0.5 * between as f64;
    let corner = origin + steps[0] * first.x + steps[1] * first.y + steps[2] * first.z;
    header.world_from_index = placed(corner, steps);
    Ok(header)
}

/// The array's numbers, unpacked.
fn voxels(
    input: &Input,
    whole: &[u8],
    document: &Document,
    array: &Array,
    header: &mut DenseHeader,
) -> Result<Vec<u8>> {
    let bytes = header.bytes();
    if bytes > u128::from(input.max_bytes) {
        return Err(input.too_large("its voxels", bytes));
    }
    let due = memory::count(bytes);
    header.compression = document.coding.packed.name();
    let named = |why: String| input.bad(format!("array '{}': {why}", array.name));
    match array.format.as_str() {
        "ascii" => {
            (header.compression, header.endian) = ("text", Endian::Little);
            let count = due / header.value_type.size();
            let numbers = encode_text(&array.texts.concat(), header.value_type, count);
            let numbers = numbers.map_err(named)?;
            if numbers.len() < due {
                let found = numbers.len() / header.value_type.size();
                return Err(named(format!("{found} numbers, expected {count}")));
            }
            Ok(numbers)
        }
        "binary" => document.coding.base64(&array.texts.concat(), due).map_err(named),
        "appended" => {
            let [offset] = input.numbers::<usize, 1>("offset", &array.offset)?;
            let Some((encoding, start)) = &document.appended else {
                return Err(named("no appended data".to_owned()));
            };
            let data = &whole[*start..];
            let mark = data.iter().position(|&byte| byte == b'_');
            let data = mark.and_then(|mark| data.get(mark.checked_add(offset)?.checked_add(1)?..));
            let data = data.ok_or_else(|| {
                named(format!("it would start at byte {offset}, beyond the end of the data"))
            })?;
            match encoding.as_str() {
                "raw" => document.coding.raw(data, due).map_err(named),
                "base64" => document.coding.base64(data, due).map_err(named),
                other => Err(named(format!("encoding '{other}' is not supported"))),
            }
        }
        other => Err(named(format!("format '{other}' is not one of ascii, binary, appended"))),
    }
}
