//! VolPack's density files (`.den`): bytes, x fastest, behind a header of 16-bit numbers.

use super::DenseHeader;
use super::input::Input;
use super::payload::Payload;
use crate::error::Result;
use crate::io::number::ValueType;

/// Where the voxels start, and where their counts along x, y, z stand.
const VOXELS: u64 = 62;
const LENGTHS: [usize; 3] = [50, 52, 54];

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let mut lengths = [0; 3];
    for (length, at) in lengths.iter_mut().zip(LENGTHS) {
        *length = i64::from(i16::from_le_bytes(input.array(at)?));
    }
    let dims = input.dims(lengths)?;
    let stated = i64::from(i32::from_le_bytes(input.array(58)?));
    let [x, y, z] = lengths;
    if stated != x * y * z {
        return Err(input.bad(format!("{stated} bytes of voxels, but dims {x},{y},{z}")));
    }
    Ok((DenseHeader::new(dims, ValueType::U8), Payload::bare(input.path, VOXELS)))
}
