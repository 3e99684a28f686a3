//! Where a file's voxels lie and how they are packed. Every size is known before memory is asked
//! for: what is unpacked grows with what is there, and never beyond what is due. Knows no format.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::read::{MultiGzDecoder, ZlibDecoder};

use crate::error::{Error, Result};
use crate::io::number::{ValueType, encode_text};

/// How the voxels of a file are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Bare,
    Gzip,
    Zlib,
    /// Numbers as text, to become little-endian numbers of this type.
    Text(ValueType),
}

/// The bytes of all voxels, in a file or already at hand.
#[derive(Debug)]
pub(super) enum Payload {
    /// Packed from byte `offset` of the file on to its end; unpacked, the voxels come behind `skip`
    /// bytes.
    Stored { path: PathBuf, offset: u64, packing: Packing, skip: u64 },
    /// Unpacked while the header was read.
    Unpacked(Vec<u8>),
}

impl Payload {
    /// The first `due` bytes; more may follow in the file, less is an error.
    pub(super) fn read(&self, file: &Path, due: usize) -> Result<Vec<u8>> {
        let (path, offset, packing, skip) = match self {
            Self::Unpacked(bytes) => {
                return bytes
                    .get(..due)
                    .map(<[u8]>::to_vec)
                    .ok_or_else(|| short(file, bytes.len(), due));
            }
            Self::Stored { path, offset, packing, skip } => (path, *offset, *packing, *skip),
        };
        let failed = |error| Error::file(path, error);
        // A header may name any file: opening a pipe waits, and a device never ends.
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if !metadata.is_file() {
            return Err(Error::contents(path, "the header's voxels are not in a file"));
        }
        let left = metadata.len().saturating_sub(offset);
        let mut stored = File::open(path).map_err(failed)?;
        stored.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let unpacked = match packing {
            Packing::Bare if left.saturating_sub(skip) < due as u64 => {
                return Err(short(path, left.saturating_sub(skip) as usize, due));
            }
            Packing::Bare => unpack(stored, skip, due, due),
            Packing::Gzip => unpack(MultiGzDecoder::new(stored), skip, due, 0),
            Packing::Zlib => unpack(ZlibDecoder::new(stored), skip, due, 0),
            Packing::Text(value_type) => {
                let mut text = Vec::new();
                stored.read_to_end(&mut text).map_err(failed)?;
                let text = text.get(skip as usize..).unwrap_or_default();
                encode_text(text, value_type, due / value_type.size())
                    .map_err(|why| Error::contents(path, why))
                    .map(Ok)?
            }
        };
        let unpacked = unpacked.map_err(|error| match packing {
            Packing::Bare => failed(error),
            _ => Error::contents(path, format!("voxels cannot be unpacked: {error}")),
        })?;
        if unpacked.len() < due { Err(short(path, unpacked.len(), due)) } else { Ok(unpacked) }
    }
}

/// At most `due` bytes behind the first `skip`; memory grows with what comes.
fn unpack(
    mut stream: impl Read,
    skip: u64,
    due: usize,
    capacity: usize,
) -> Result<Vec<u8>, std::io::Error> {
    std::io::copy(&mut stream.by_ref().take(skip), &mut std::io::sink())?;
    let mut bytes = Vec::with_capacity(capacity);
    stream.take(due as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn short(path: &Path, found: usize, due: usize) -> Error {
    Error::contents(path, format!("it ends early: {found} bytes of voxels, {due} are due"))
}
