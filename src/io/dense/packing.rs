//! Voxels packed as they come, into pieces of memory that are asked for one by one. Knows no format.

use std::io::{self, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::grid::DenseGrid;
use super::write::{DenseTarget, Written};
use super::{DenseFile, Order};
use crate::error::memory;
use crate::error::{Error, Result};
use crate::io::number::{Endian, ValueType};

/// Writes all voxels.
pub(super) type Feed<'a> = dyn Fn(&mut dyn Write) -> Result<()> + 'a;

/// Bytes of a piece.
const PIECE: usize = 1 << 20;

/// What is written, in pieces.
#[derive(Default)]
struct Pieces(Vec<Vec<u8>>);

impl Write for Pieces {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.last().is_none_or(|last| last.len() == PIECE) {
            self.0.push(memory::room(PIECE, "packed voxels").map_err(io::Error::other)?);
        }
        let Some(last) = self.0.last_mut() else { return Ok(0) };
        let count = bytes.len().min(PIECE - last.len());
        last.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// All voxels as a gzip stream.
pub(super) fn gzipped(feed: &Feed) -> Result<Vec<Vec<u8>>> {
    let mut encoder = GzEncoder::new(Pieces::default(), Compression::default());
    feed(&mut encoder)?;
    encoder.finish().map(|pieces| pieces.0).map_err(refused)
}

/// All voxels as a zlib stream.
pub(super) fn zlibbed(feed: &Feed) -> Result<Vec<Vec<u8>>> {
    let mut encoder = ZlibEncoder::new(Pieces::default(), Compression::default());
    feed(&mut encoder)?;
    encoder.finish().map(|pieces| pieces.0).map_err(refused)
}

/// Why packing fails: for want of memory.
pub(super) fn refused(error: io::Error) -> Error {
    match error.downcast::<Error>() {
        Ok(error) => error,
        Err(error) => Error::value("compression", error.to_string()),
    }
}

impl DenseFile {
    /// The files that the voxels become at `path` if they stay as they are and are packed as they come, so that
    /// memory never holds more than what is written; `None` where they have to be changed or turned.
    ///
    /// # Errors
    /// As [`DenseTarget::encode`] and [`DenseFile::voxels`].
    pub fn packed_as(&self, target: DenseTarget, path: &Path) -> Result<Option<Written>> {
        let header = self.header();
        let plain = header.order == Order::XFastest
            && header.scale == [1.0, 0.0]
            && header.sparse.is_none()
            && header.value_type != ValueType::F16;
        if !plain || !self.payload.comes_in_parts() || target.compression().is_none() {
            return Ok(None);
        }
        self.check_memory(header.bytes())?;
        let size = header.value_type.size();
        let feed = |out: &mut dyn Write| {
            self.payload.read_parts(&self.path, header.bytes() as usize, PIECE, |mut part| {
                if header.endian == Endian::Big {
                    part.chunks_exact_mut(size).for_each(<[u8]>::reverse);
                }
                out.write_all(&part).map_err(refused)
            })
        };
        target.encode_from(DenseGrid::without_voxels(self), path, true, Some(&feed)).map(Some)
    }
}
