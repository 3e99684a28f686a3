//! NumPy arrays (`.npy`, versions 1 to 3): axes (z, y, x), in C or Fortran order, and one more axis
//! for vectors. A sidecar beside the file gives the voxels' position and the number of components.

use std::path::Path;

use super::grid::DenseGrid;
use super::input::Input;
use super::payload::Payload;
use super::{DenseHeader, Order};
use crate::error::{Error, Result, memory};
use crate::io::number::{Endian, ValueType};
use crate::io::options::refuse_stream;
use crate::io::sidecar::Sidecar;

/// What the header of an array says.
struct Head {
    value_type: ValueType,
    endian: Endian,
    /// Lengths of the axes.
    lengths: Vec<i64>,
    /// Whether the first axis is the fastest.
    is_fortran: bool,
    /// Where the values begin.
    start: u64,
}

fn head_read(input: &Input) -> Result<Head> {
    if !input.head.starts_with(b"\x93NUMPY") {
        return Err(input.bad("not a NumPy file (.npy)"));
    }
    let [major, _] = input.array::<2>(6)?;
    let (start, length) = match major {
        1 => (10, u64::from(u16::from_le_bytes(input.array(8)?))),
        2 | 3 => (12, u64::from(u32::from_le_bytes(input.array(8)?))),
        _ => {
            return Err(input.bad(format!("NumPy file version {major}; only 1 to 3 are supported")));
        }
    };
    let text =
        usize::try_from(length).ok().and_then(|length| input.head.get(start..start + length));
    let Some(text) = text else {
        let why = format!("its header of {length} bytes is longer than the file or than 1 MiB");
        return Err(input.bad(why));
    };
    let text = String::from_utf8_lossy(text);
    let item = |key: &str| {
        let behind =
            text.split_once(&format!("'{key}'")).and_then(|(_, rest)| rest.split_once(':'));
        behind.map(|(_, rest)| rest.trim_start()).ok_or_else(|| input.bad(format!("no '{key}'")))
    };

    let (value_type, endian) = number_type(input, item("descr")?)?;
    let shape = item("shape")?;
    let shape = shape.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(list, _)| list);
    let lengths: Option<Vec<i64>> = shape.and_then(|list| {
        let words = list.split(',').map(str::trim).filter(|word| !word.is_empty());
        // Python 2 writes long numbers with an L.
        words.take(64).map(|word| word.trim_end_matches('L').parse().ok()).collect()
    });
    let lengths = lengths.ok_or_else(|| input.bad("its shape is not a list of numbers"))?;
    let is_fortran = item("fortran_order")?.starts_with("True");
    Ok(Head { value_type, endian, lengths, is_fortran, start: start as u64 + length })
}

/// Reads an array of vectors of three numbers, of shape (n, 3), such as points. The whole file takes
/// at most `max_bytes`.
///
/// # Errors
/// If the file cannot be read, or is not such an array.
pub fn read_vectors(path: &Path, max_bytes: u64) -> Result<Vec<[f64; 3]>> {
    refuse_stream(path)?;
    let input = Input::open(path, max_bytes)?;
    let head = head_read(&input)?;
    let [count, 3] = head.lengths[..] else {
        let axes: Vec<String> = head.lengths.iter().map(i64::to_string).collect();
        return Err(input.bad(format!("an array of shape ({}), expected (n, 3)", axes.join(", "))));
    };
    let size = head.value_type.size() as i128;
    let due = i128::from(head.start) + 3 * size * i128::from(count);
    if count < 0 || due != i128::from(input.size) {
        let (found, due) = (input.size, due.max(0));
        return Err(input.bad(format!("it has {found} bytes, its header says {due}")));
    }
    let bytes = input.whole()?;
    let values = bytes.get(memory::count(head.start)..).unwrap_or_default();
    memory::check(values.len() as u64 * 8, "points")?;
    let numbers = head.value_type.decode(values, head.endian);
    let count = count as usize;
    let at = |i: usize, axis: usize| {
        let index = if head.is_fortran { axis * count + i } else { 3 * i + axis };
        numbers.get(index).copied().unwrap_or(f64::NAN)
    };
    memory::collected((0..count).map(|i| [0, 1, 2].map(|axis| at(i, axis))), "points")
}

/// An array of `shape`, whose last axis is the fastest, as the bytes of a file of 32-bit floats.
///
/// # Errors
/// If there is no memory for it.
pub fn encode_array(
    shape: &[usize],
    values: impl ExactSizeIterator<Item = f32>,
) -> Result<Vec<u8>> {
    let mut bytes = head_of("<f4", shape);
    memory::reserve(&mut bytes, 4 * values.len(), "a NumPy file")?;
    bytes.extend(values.flat_map(f32::to_le_bytes));
    Ok(bytes)
}

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let Head { value_type, endian, lengths, is_fortran, start } = head_read(input)?;
    let sidecar = Sidecar::beside(input.path)?;
    let said = sidecar.as_ref().and_then(|(_, sidecar)| sidecar.components);
    let Meaning { lengths: [z, y, x], components, note } = meaning(input, &lengths, said)?;
    let mut header = DenseHeader::new(input.dims([x, y, z])?, value_type);
    header.components = usize::try_from(components).unwrap_or(0);
    header.notes.extend(note);
    if sidecar.is_none() {
        header.notes.extend(Sidecar::unread_beside(input.path));
    }
    header.endian = endian;
    if is_fortran {
        if header.components != 1 {
            return Err(input.bad("an array of vectors in Fortran order, which is not supported"));
        }
        header.order = Order::ZFastest;
    }
    if let Some((beside, sidecar)) = sidecar {
        if !sidecar.fits(&header) {
            let why = format!("it describes different voxels than {}", input.path.display());
            return Err(Error::contents(beside, why));
        }
        let described = sidecar.describe(&mut header);
        described.map_err(|error| Error::contents(beside, error.to_string()))?;
    }
    Ok((header, Payload::bare(input.path, start)))
}

/// Meaning of an array's axes.
struct Meaning {
    /// Voxel counts along z, y, x.
    lengths: [i64; 3],
    components: i64,
    note: Option<String>,
}

/// The meaning of axes with these `lengths`; `said` is the number of components in a sidecar. A
/// fourth axis may be one of vectors behind the others, or one of batches or time in front of them.
/// Arrays whose lengths do not decide this are rejected.
fn meaning(input: &Input, lengths: &[i64], said: Option<usize>) -> Result<Meaning> {
    let [z, y, x, last] = match *lengths {
        [z, y, x] => return Ok(Meaning { lengths: [z, y, x], components: 1, note: None }),
        [a, b, c, d] => [a, b, c, d],
        // Any number of leading axes of length 1.
        [1, .., b, c, d] if lengths[..lengths.len() - 3].iter().all(|&n| n == 1) => [1, b, c, d],
        _ => {
            let why = format!("an array of {} axes, expected three (z, y, x)", lengths.len());
            return Err(input.bad(why));
        }
    };
    let vectors = Meaning { lengths: [z, y, x], components: last, note: None };
    let frame = Meaning { lengths: [y, x, last], components: 1, note: None };
    let option = |count: i64| format!("'components = {count}' in a sidecar changes that");
    match said {
        Some(count) if count as i64 == last => Ok(vectors),
        Some(1) if z == 1 => Ok(frame),
        Some(count) => {
            let why = format!("a last axis of {last}, but components = {count} in its sidecar");
            Err(input.bad(why))
        }
        None if last == 1 => Ok(vectors),
        None if z == 1 && last != 3 => {
            let note =
                format!("axes (1, {y}, {x}, {last}) are read as a batch of one; {}", option(last));
            Ok(Meaning { note: Some(note), ..frame })
        }
        None if last == 2 || last == 3 => {
            let note =
                format!("a last axis of {last} is read as vectors, of which the lengths are used");
            Ok(Meaning { note: Some(note), ..vectors })
        }
        None => {
            let why = format!(
                "axes ({z}, {y}, {x}, {last}) may be {z} frames or vectors of {last}; only one \
                 frame is supported, and vectors need 'components = {last}' in the sidecar {}",
                input.path.with_extension("toml").display()
            );
            Err(input.bad(why))
        }
    }
}

/// Parses `'<f4'`, `'|u1'` and similar.
fn number_type(input: &Input, text: &str) -> Result<(ValueType, Endian)> {
    if text.starts_with('[') {
        return Err(input.bad("an array of structures, which is not supported"));
    }
    let word = text.trim_start_matches(['\'', '"']).split(['\'', '"']).next().unwrap_or_default();
    let (order, kind) = word.split_at_checked(1).unwrap_or_default();
    let endian = if order == ">" { Endian::Big } else { Endian::Little };
    let value_type = match kind {
        "u1" | "b1" => ValueType::U8,
        "i1" => ValueType::I8,
        "u2" => ValueType::U16,
        "i2" => ValueType::I16,
        "u4" => ValueType::U32,
        "i4" => ValueType::I32,
        "u8" => ValueType::U64,
        "i8" => ValueType::I64,
        "f2" => ValueType::F16,
        "f4" => ValueType::F32,
        "f8" => ValueType::F64,
        _ => {
            let word: String = word.chars().take(24).collect();
            return Err(input.bad(format!("number type '{word}' is not supported")));
        }
    };
    if !["<", ">", "|", "="].contains(&order) {
        return Err(input.bad(format!("byte order '{order}' is not one of <, >, |")));
    }
    Ok((value_type, endian))
}

/// The header for the voxels of `grid`: shape (z, y, x), and one more axis for vectors.
pub(super) fn head(grid: &DenseGrid) -> Vec<u8> {
    let name = grid.value_type.name();
    let (kind, size) = (&name[..1], grid.value_type.size());
    let order = if size == 1 { '|' } else { '<' };
    let [x, y, z] = grid.dims;
    let shape = [z, y, x, grid.components];
    let axes = if grid.components > 1 { 4 } else { 3 };
    head_of(&format!("{order}{kind}{size}"), &shape[..axes])
}

/// The header of an array in C order, with a type such as `<f4` and a shape of several axes.
pub(in crate::io) fn head_of(value_type: &str, shape: &[usize]) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape = shape.join(", ");
    let mut text =
        format!("{{'descr': '{value_type}', 'fortran_order': False, 'shape': ({shape}), }}");
    // The values start at a multiple of 64.
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    bytes
}
