//! The encoding of an array of bytes in VTK's XML files: a header of lengths, blocks that may be
//! compressed, optionally base64. Knows nothing of XML or of volumes.

use std::io::Read;

use flate2::read::ZlibDecoder;

use crate::error::memory;
use crate::io::base64;
use crate::io::number::Endian;

/// The compression of the blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Packed {
    #[default]
    Bare,
    Zlib,
    Lz4,
}

impl Packed {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bare => "none",
            Self::Zlib => "zlib",
            Self::Lz4 => "lz4",
        }
    }
}

/// The encoding of lengths and blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Coding {
    pub(super) endian: Endian,
    /// Whether lengths have 64 bits instead of 32.
    pub(super) wide: bool,
    pub(super) packed: Packed,
}

impl Coding {
    /// Decodes the first `due` bytes of an array that starts where `data` starts.
    pub(super) fn raw(self, data: &[u8], due: usize) -> Result<Vec<u8>, String> {
        let mut rest = data;
        let count = self.length(&mut rest)?;
        if self.packed == Packed::Bare {
            let found = count.min(rest.len());
            return rest
                .get(..due)
                .filter(|_| found >= due)
                .ok_or_else(|| format!("{found} bytes, expected {due}"))
                .and_then(|bytes| refused(memory::copied(bytes, "voxels")));
        }
        let (block, last) = (self.length(&mut rest)?, self.length(&mut rest)?);
        let width = if self.wide { 8 } else { 4 };
        if count > rest.len() / width {
            return Err(format!("{count} blocks do not fit in {} bytes", rest.len()));
        }
        let mut sizes = refused(memory::room(count, "block lengths"))?;
        for _ in 0..count {
            sizes.push(self.length(&mut rest)?);
        }
        let mut unpacked = Vec::new();
        for (index, size) in sizes.into_iter().enumerate() {
            let length = if index + 1 == count && last > 0 { last } else { block };
            if length > due - unpacked.len() {
                return Err(format!("more than the {due} bytes expected"));
            }
            let (data, behind) = rest.split_at_checked(size).ok_or_else(|| {
                format!("block {index} has {size} bytes, but {} are left", rest.len())
            })?;
            rest = behind;
            self.unpack(data, length, &mut unpacked)
                .map_err(|why| format!("block {index} cannot be unpacked: {why}"))?;
        }
        if unpacked.len() < due {
            return Err(format!("{} bytes, expected {due}", unpacked.len()));
        }
        Ok(unpacked)
    }

    /// The same for an array in base64, which ends at the first `<`.
    pub(super) fn base64(self, text: &[u8], due: usize) -> Result<Vec<u8>, String> {
        let end = text.iter().position(|&byte| byte == b'<').unwrap_or(text.len());
        self.raw(&base64::decode(&text[..end])?, due)
    }

    fn length(self, rest: &mut &[u8]) -> Result<usize, String> {
        let ends = || "its lengths end early".to_owned();
        let number = if self.wide {
            let (bytes, behind) = rest.split_first_chunk::<8>().ok_or_else(ends)?;
            *rest = behind;
            if self.endian == Endian::Big {
                u64::from_be_bytes(*bytes)
            } else {
                u64::from_le_bytes(*bytes)
            }
        } else {
            let (bytes, behind) = rest.split_first_chunk::<4>().ok_or_else(ends)?;
            *rest = behind;
            u64::from(if self.endian == Endian::Big {
                u32::from_be_bytes(*bytes)
            } else {
                u32::from_le_bytes(*bytes)
            })
        };
        usize::try_from(number).map_err(|_| format!("a length of {number} is too large"))
    }

    /// Appends a block of `length` bytes.
    fn unpack(self, data: &[u8], length: usize, unpacked: &mut Vec<u8>) -> Result<(), String> {
        let before = unpacked.len();
        // Deflate packs by at most 1 to 1032, LZ4 by at most 1 to 255.
        let most = length.min(data.len().saturating_mul(1032));
        refused(memory::grow(unpacked, most, "voxels"))?;
        if self.packed == Packed::Zlib {
            let stream = ZlibDecoder::new(data).take(most as u64);
            { stream }.read_to_end(unpacked).map_err(|error| error.to_string())?;
        } else {
            if length / 256 > data.len() {
                return Err(format!("{length} bytes do not fit in {}", data.len()));
            }
            unpacked.resize(before + length, 0);
            let written = lz4_flex::block::decompress_into(data, &mut unpacked[before..])
                .map_err(|error| error.to_string())?;
            unpacked.truncate(before + written);
        }
        let found = unpacked.len() - before;
        if found == length { Ok(()) } else { Err(format!("{found} bytes, expected {length}")) }
    }
}

/// An error of memory as text.
fn refused<T>(result: crate::Result<T>) -> Result<T, String> {
    result.map_err(|error| error.to_string())
}
