//! The compression of the Erlangen volume library ("DDS v3d" and "v3e"): differences from a
//! prediction, in runs whose numbers have as many bits as the run needs. Knows nothing of volumes.

use crate::error::memory;

/// The two versions of the stream, which differ in how far apart interleaved bytes may lie.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    D,
    E,
}

/// Interleaved bytes of v3e lie within blocks of this many items.
const BLOCK: usize = 1 << 24;

/// A reader of bits, the most significant bit of each byte first.
struct Bits<'a> {
    bytes: &'a [u8],
    /// Number of bits that were read.
    at: u64,
}

impl Bits<'_> {
    /// The next `count` bits, at most 16; `None` at the end.
    fn take(&mut self, count: u32) -> Option<u32> {
        // All bits of the bytes that memory can hold have a number.
        let first = (self.at / 8) as usize;
        if self.at + u64::from(count) > self.bytes.len() as u64 * 8 {
            return None;
        }
        // Any 16 bits lie within three bytes.
        let byte = |i: usize| u32::from(self.bytes.get(first + i).copied().unwrap_or(0));
        let window = byte(0) << 16 | byte(1) << 8 | byte(2);
        let shift = 24 - (self.at % 8) as u32 - count;
        self.at += u64::from(count);
        Some((window >> shift) & ((1 << count) - 1))
    }

    /// The next `count` bits, at most 16; missing bits at the end are zeros.
    fn take_padded(&mut self, count: u32) -> u32 {
        let left = (self.bytes.len() as u64 * 8).saturating_sub(self.at).min(count.into()) as u32;
        self.take(left).unwrap_or(0) << (count - left)
    }
}

/// Unpacks a stream, which marks its own end, to at most `limit` bytes.
pub(super) fn unpack(bytes: &[u8], version: Version, limit: usize) -> Result<Vec<u8>, String> {
    let mut bits = Bits { bytes, at: 0 };
    let ends = || "its compressed stream ends early".to_owned();
    let skip = bits.take(2).ok_or_else(ends)? as usize + 1;
    let strip = bits.take(16).ok_or_else(ends)? as usize + 1;
    let mut unpacked: Vec<u8> = Vec::new();
    loop {
        // The library's own writer omits final zeros that would begin a byte.
        let count = bits.take_padded(7) as usize;
        if count == 0 {
            break;
        }
        if unpacked.len() + count > limit {
            return Err(format!("its compressed stream holds more than {limit} bytes"));
        }
        let width = match bits.take(3).ok_or_else(ends)? {
            0 => 0,
            code => code + 1,
        };
        memory::grow(&mut unpacked, count, "its voxels").map_err(|error| error.to_string())?;
        let middle = (1 << width) / 2;
        for _ in 0..count {
            let stored = bits.take(width).ok_or_else(ends)?;
            let mut value = (stored as u8).wrapping_sub(middle as u8);
            let n = unpacked.len();
            if let Some(previous) = unpacked.last() {
                value = value.wrapping_add(*previous);
            }
            if strip > 1 && n > strip {
                value =
                    value.wrapping_add(unpacked[n - strip]).wrapping_sub(unpacked[n - strip - 1]);
            }
            unpacked.push(value);
        }
    }
    if skip > 1 {
        let block = if version == Version::E { skip * BLOCK } else { unpacked.len().max(1) };
        for block in unpacked.chunks_mut(block) {
            interleave(block, skip)?;
        }
    }
    Ok(unpacked)
}

/// Interleaves again the bytes that are stored in `skip` planes, one after another.
fn interleave(block: &mut [u8], skip: usize) -> Result<(), String> {
    let planes = memory::copied(block, "its voxels").map_err(|error| error.to_string())?;
    let mut stored = planes.into_iter();
    for plane in 0..skip {
        for (place, byte) in block.iter_mut().skip(plane).step_by(skip).zip(&mut stored) {
            *place = byte;
        }
    }
    Ok(())
}
