//! Where a file's voxels lie and how they are packed. Every size is known before memory is
//! allocated: unpacked data grows with what the file really holds, and never beyond the expected
//! size. Knows no format.

use std::io::{Read, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::Crc;
use flate2::read::{MultiGzDecoder, ZlibDecoder};

use crate::error::memory;
use crate::error::{Error, Result};
use crate::io::files;
use crate::io::number::{ValueType, encode_text};

/// Number of bytes of a file that are processed at a time, if it need not be in memory as a whole.
pub(super) const PART: usize = 1 << 22;

/// How the voxels of a file are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Bare,
    Gzip,
    Zlib,
    /// Numbers as text, which become little-endian numbers of this type.
    Text(ValueType),
}

/// The bytes of all voxels, in a file or already in memory.
#[derive(Debug)]
pub(super) enum Payload {
    /// Packed from byte `offset` to the end of the file. In the unpacked bytes, the voxels come
    /// behind the first `skip` bytes.
    Stored { path: PathBuf, offset: u64, packing: Packing, skip: u64 },
    /// Unpacked while the header was read.
    Unpacked(Vec<u8>),
    /// Another payload, whose bytes must have this CRC-32.
    Checked(Box<Self>, u32),
}

impl Payload {
    /// Reads the first `due` bytes. More may follow in the file; fewer are an error.
    pub(super) fn read(&self, file: &Path, due: usize) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let stored = match self {
            Self::Checked(payload, _) => payload,
            own => own,
        };
        let part = match stored {
            // The stream may be shorter than expected, so its size is not reserved in advance.
            Self::Stored { packing: Packing::Gzip | Packing::Zlib, .. } => PART,
            _ => due,
        };
        self.read_parts(file, due, part, &mut |part| {
            if part.len() == due {
                bytes = part;
                return Ok(());
            }
            if bytes.is_empty() {
                memory::reserve(&mut bytes, due, "voxels")?;
            }
            bytes.extend(part);
            Ok(())
        })?;
        Ok(bytes)
    }

    /// Whether [`Payload::read_parts`] never holds more than one part in memory.
    pub(super) fn comes_in_parts(&self) -> bool {
        use Packing::{Bare, Gzip, Zlib};
        match self {
            Self::Checked(payload, _) => payload.comes_in_parts(),
            Self::Stored { packing, .. } => matches!(packing, Bare | Gzip | Zlib),
            Self::Unpacked(_) => false,
        }
    }

    /// The file that contains the bytes, unless they are in memory.
    pub(super) fn path(&self) -> Option<&Path> {
        match self {
            Self::Stored { path, .. } => Some(path),
            Self::Unpacked(_) => None,
            Self::Checked(payload, _) => payload.path(),
        }
    }

    /// Passes the first `due` bytes to `take` in order, `part` bytes at a time and the rest last.
    /// More may follow in the file; fewer are an error.
    pub(super) fn read_parts(
        &self,
        file: &Path,
        due: usize,
        part: usize,
        take: &mut dyn FnMut(Vec<u8>) -> Result<()>,
    ) -> Result<()> {
        let mut take_all = |path: &Path, bytes: &[u8]| {
            let bytes = bytes.get(..due).ok_or_else(|| short(path, bytes.len(), due))?;
            let mut chunks = bytes.chunks(part.max(1));
            chunks.try_for_each(|chunk| take(memory::copied(chunk, "voxels")?))
        };
        let (path, offset, packing, skip) = match self {
            Self::Checked(payload, crc32) => {
                let mut found = Crc::new();
                payload.read_parts(file, due, part, &mut |part| {
                    found.update(&part);
                    take(part)
                })?;
                return check(file, found.sum(), *crc32);
            }
            Self::Unpacked(bytes) => return take_all(file, bytes),
            Self::Stored { path, offset, packing, skip } => (path, *offset, *packing, *skip),
        };
        let failed = |error| Error::file(path, error);
        // A header may name any file, but opening a pipe would block, and a device never ends.
        let metadata = files::metadata(path).map_err(failed)?;
        if !metadata.is_file() {
            return Err(Error::contents(path, "the header's voxels are not in a file"));
        }
        let left = metadata.len().saturating_sub(offset).saturating_sub(skip);
        let mut stored = files::open(path).map_err(failed)?;
        stored.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let parts = [due, part];
        let found = match packing {
            Packing::Bare if left < due as u64 => return Err(short(path, left as usize, due)),
            Packing::Bare => unpack(stored, skip, parts, take)?.map_err(failed)?,
            Packing::Gzip => {
                unpack(MultiGzDecoder::new(stored), skip, parts, take)?.map_err(broken(path))?
            }
            Packing::Zlib => {
                unpack(ZlibDecoder::new(stored), skip, parts, take)?.map_err(broken(path))?
            }
            Packing::Text(value_type) => {
                // A number takes at least a digit and a blank; the whole file is an upper bound.
                let most = memory::count(metadata.len() - offset.min(metadata.len()));
                let mut text = memory::room(most, "voxels as text")?;
                stored.take(most as u64).read_to_end(&mut text).map_err(failed)?;
                let text = text.get(memory::count(skip)..).unwrap_or_default();
                let bytes = encode_text(text, value_type, due / value_type.size())
                    .map_err(|why| Error::contents(path, why))?;
                return take_all(path, &bytes);
            }
        };
        if found < due { Err(short(path, found, due)) } else { Ok(()) }
    }
}

fn check(path: &Path, found: u32, due: u32) -> Result<()> {
    if found == due {
        return Ok(());
    }
    let why = format!(
        "its voxels have the CRC-32 {found:08x}, but its sidecar says {due:08x}: they do not \
         belong together"
    );
    Err(Error::contents(path, why))
}

fn broken(path: &Path) -> impl Fn(std::io::Error) -> Error {
    move |error| Error::contents(path, format!("voxels cannot be unpacked: {error}"))
}

/// Passes at most `due` bytes behind the first `skip` to `take`, `part` at a time; memory grows
/// with what arrives. Returns how many there were, or what is wrong with the stream.
///
/// # Errors
/// If there is not enough memory, and those of `take`.
fn unpack(
    mut stream: impl Read,
    skip: u64,
    [due, part]: [usize; 2],
    mut take: impl FnMut(Vec<u8>) -> Result<()>,
) -> Result<Result<usize, std::io::Error>> {
    if let Err(error) = std::io::copy(&mut stream.by_ref().take(skip), &mut std::io::sink()) {
        return Ok(Err(error));
    }
    let mut found = 0;
    while found < due {
        let wanted = (due - found).min(part.max(1));
        let mut bytes = memory::room(wanted, "voxels")?;
        if let Err(error) = stream.by_ref().take(wanted as u64).read_to_end(&mut bytes) {
            return Ok(Err(error));
        }
        if bytes.is_empty() {
            break;
        }
        found += bytes.len();
        let ended = bytes.len() < wanted;
        take(bytes)?;
        if ended {
            break;
        }
    }
    Ok(Ok(found))
}

fn short(path: &Path, found: usize, due: usize) -> Error {
    Error::contents(path, format!("it ends early: {found} bytes of voxels, expected {due}"))
}
