//! Compressions of deep files, which pack one block of bytes at a time. Sizes are known before
//! packing and unpacking, so nothing grows beyond them. Knows nothing of pixels.

use std::io::Write;

use flate2::write::ZlibEncoder;
use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::{DecompressorOxide, decompress, inflate_flags};

use crate::error::memory;

/// How the blocks of a deep file are packed. A block that does not shrink is stored unpacked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Unpacked.
    None,
    /// Run-length encoding.
    Rle,
    /// Deflate, one line at a time.
    #[default]
    Zips,
}

/// The largest number of bytes that one packed byte can stand for: deflate's 258 bytes for two
/// bits, and some more.
const DEFLATE_RATIO: u64 = 1040;
/// The same for run-length encoding: 128 bytes for two.
const RLE_RATIO: u64 = 64;

impl Compression {
    /// The name in the format's documentation.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "rle",
            Self::Zips => "zips",
        }
    }

    /// The code in a file.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Rle => 1,
            Self::Zips => 2,
        }
    }

    /// The compression for a code; the error names compressions that deep files cannot have.
    pub(super) fn from_code(code: u8) -> Result<Self, String> {
        match code {
            0 => Ok(Self::None),
            1 => Ok(Self::Rle),
            2 => Ok(Self::Zips),
            _ => Err(format!("compression {code}; deep files have 0 (none), 1 (rle) or 2 (zips)")),
        }
    }

    /// Packs a block; returns it unchanged if packing does not shrink it.
    pub(super) fn pack(self, block: Vec<u8>) -> std::io::Result<Vec<u8>> {
        if self == Self::None || block.is_empty() {
            return Ok(block);
        }
        let differences = to_differences(&block);
        let packed = match self {
            Self::Zips => {
                let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                encoder.write_all(&differences)?;
                encoder.finish()?
            }
            _ => pack_runs(&differences),
        };
        Ok(if packed.len() < block.len() { packed } else { block })
    }

    /// Unpacks a block of `due` bytes.
    pub(super) fn unpack(self, packed: &[u8], due: u64) -> Result<Vec<u8>, String> {
        if packed.len() as u64 == due {
            return Ok(packed.to_vec());
        }
        let most = packed.len() as u64 * self.ratio();
        let size = match usize::try_from(due) {
            Ok(size) if due <= most => size,
            _ => {
                let name = self.name();
                let stored = packed.len();
                return Err(format!("{stored} bytes packed with {name} cannot hold {due} bytes"));
            }
        };
        let mut differences =
            memory::filled(size, 0, "deep samples").map_err(|error| error.to_string())?;
        match self {
            Self::None => return Err(format!("{} bytes stored, expected {due}", packed.len())),
            Self::Rle => unpack_runs(packed, &mut differences)?,
            Self::Zips => inflate(packed, &mut differences)?,
        }
        Ok(from_differences(differences))
    }

    fn ratio(self) -> u64 {
        match self {
            Self::None => 1,
            Self::Rle => RLE_RATIO,
            Self::Zips => DEFLATE_RATIO,
        }
    }
}

/// Bytes at even positions first, then those at odd ones; then each minus the one before, plus 128.
fn to_differences(block: &[u8]) -> Vec<u8> {
    let ordered = block.iter().step_by(2).chain(block.iter().skip(1).step_by(2));
    let mut before = 128_u8;
    ordered
        .map(|&byte| {
            let difference = byte.wrapping_sub(before).wrapping_add(128);
            before = byte;
            difference
        })
        .collect()
}

/// The inverse of [`to_differences`].
fn from_differences(mut bytes: Vec<u8>) -> Vec<u8> {
    let mut before = 128_u8;
    for byte in &mut bytes {
        before = before.wrapping_add(*byte).wrapping_sub(128);
        *byte = before;
    }
    let (even, odd) = bytes.split_at(bytes.len().div_ceil(2));
    let mut block = Vec::with_capacity(bytes.len());
    for (at, &byte) in even.iter().enumerate() {
        block.push(byte);
        block.extend(odd.get(at));
    }
    block
}

/// Fills all of `block`. The output cannot grow, which stops a decompression bomb.
fn inflate(packed: &[u8], block: &mut [u8]) -> Result<(), String> {
    let flags = inflate_flags::TINFL_FLAG_PARSE_ZLIB_HEADER
        | inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
    let mut state = Box::<DecompressorOxide>::default();
    let (status, _, written) = decompress(&mut state, packed, block, 0, flags);
    if status != TINFLStatus::Done || written != block.len() {
        return Err(format!("zips: {status:?} after {written} of {} bytes", block.len()));
    }
    Ok(())
}

/// Run-length encoding. A count c from 0 to 127 and a byte: the byte c + 1 times. A count of -c: c
/// literal bytes.
fn pack_runs(bytes: &[u8]) -> Vec<u8> {
    const LONGEST: usize = 128;
    const SHORTEST: usize = 3;
    let run = |at: usize| {
        let same = bytes[at..].iter().take(LONGEST).take_while(|&&byte| byte == bytes[at]);
        same.count()
    };
    let mut packed = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = run(at);
        if length >= SHORTEST {
            packed.extend([(length - 1) as u8, bytes[at]]);
            at += length;
            continue;
        }
        let start = at;
        while at < bytes.len() && at - start < LONGEST - 1 && run(at) < SHORTEST {
            at += 1;
        }
        packed.push((start as i64 - at as i64) as u8);
        packed.extend(&bytes[start..at]);
    }
    packed
}

/// Fills all of `block` from the output of [`pack_runs`].
fn unpack_runs(packed: &[u8], block: &mut [u8]) -> Result<(), String> {
    let short = || "rle: it ends inside a run".to_owned();
    let due = block.len();
    let (mut rest, mut at) = (packed, 0);
    while let Some((&count, behind)) = rest.split_first() {
        let length = if count < 128 { usize::from(count) + 1 } else { 256 - usize::from(count) };
        let room = block.get_mut(at..at + length).ok_or("rle: more bytes than expected")?;
        if count < 128 {
            let (&byte, behind) = behind.split_first().ok_or_else(short)?;
            room.fill(byte);
            rest = behind;
        } else {
            let (literal, behind) = behind.split_at_checked(length).ok_or_else(short)?;
            room.copy_from_slice(literal);
            rest = behind;
        }
        at += length;
    }
    if at < due { Err(format!("rle: {at} of {due} bytes")) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::Compression;

    #[test]
    fn what_is_packed_comes_back() {
        let blocks: [Vec<u8>; 5] = [
            Vec::new(),
            vec![7],
            vec![0; 1001],
            (0..999_u32).map(|n| ((n * n) >> 3) as u8).collect(),
            (0..2000_u32).map(|n| if n % 400 < 300 { 5 } else { n as u8 }).collect(),
        ];
        for compression in [Compression::None, Compression::Rle, Compression::Zips] {
            for block in &blocks {
                let packed = compression.pack(block.clone()).unwrap_or_default();
                assert!(packed.len() <= block.len());
                let unpacked = compression.unpack(&packed, block.len() as u64);
                assert_eq!(unpacked.as_ref(), Ok(block), "{}", compression.name());
            }
        }
    }

    #[test]
    fn more_than_the_packed_bytes_can_hold_is_refused() {
        for compression in [Compression::None, Compression::Rle, Compression::Zips] {
            for due in [1 << 14, 1 << 40, u64::MAX] {
                assert!(compression.unpack(&[1, 2, 3], due).is_err());
            }
        }
    }
}
