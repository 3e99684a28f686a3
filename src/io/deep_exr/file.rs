//! Opened deep files: headers first, lines on request. Every size is checked against the bytes that
//! exist, so that a broken or hostile file causes an error, and neither a panic nor more memory
//! than its size justifies.

use std::io::{Cursor as Memory, Read, SeekFrom};
use std::path::{Path, PathBuf};

use super::cursor::Cursor;
use super::header::DeepHeader;
use super::parse::{self, Start};
use super::row::{DeepImage, DeepRow, Samples};
use super::statistics::{DeepStatistics, Tally};
use super::{DEEP_FLAG, MAGIC};
use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::io::files::{self, File};

/// The largest number of bytes for headers.
const LONGEST_HEAD: u64 = 1 << 20;

/// A deep file whose headers have been read. Of several parts, the first with deep scanlines is
/// used.
pub struct DeepFile {
    path: PathBuf,
    stream: File,
    length: u64,
    max_bytes: u64,
    start: Start,
    size: [u32; 2],
    /// Offset of each line.
    offsets: Vec<u64>,
}

impl DeepFile {
    /// Whether a file that starts with these bytes (eight or more) is OpenEXR with deep data;
    /// `None` if it is not OpenEXR.
    pub fn recognizes(start: &[u8]) -> Option<bool> {
        let mut cursor = Cursor::new(start.strip_prefix(&MAGIC)?);
        cursor.i32().ok().map(|version| version as u32 & DEEP_FLAG != 0)
    }

    /// Opens a file and reads its headers. Lines and images that are read from it take at most
    /// `max_bytes` of memory.
    ///
    /// # Errors
    /// `File` if the system refuses; `Contents` if this is not a deep OpenEXR file of scanlines, or
    /// if its headers are broken.
    pub fn open(path: impl AsRef<Path>, max_bytes: u64) -> Result<Self> {
        let path = path.as_ref();
        let file = files::open(path).map_err(|error| Error::file(path, error))?;
        Self::from_stream(path, file, max_bytes)
    }

    /// Reads headers from bytes in memory; `path` stands for them in errors.
    ///
    /// # Errors
    /// As [`DeepFile::open`].
    pub fn from_bytes(path: impl AsRef<Path>, bytes: Vec<u8>, max_bytes: u64) -> Result<Self> {
        Self::from_stream(path.as_ref(), Box::new(Memory::new(bytes)), max_bytes)
    }

    fn from_stream(path: &Path, mut stream: File, max_bytes: u64) -> Result<Self> {
        let failed = |error| Error::file(path, error);
        let bad = |why: String| Error::contents(path, why);
        let length = stream.seek(SeekFrom::End(0)).map_err(failed)?;
        stream.rewind().map_err(failed)?;
        let mut head = Vec::new();
        stream.by_ref().take(LONGEST_HEAD).read_to_end(&mut head).map_err(failed)?;
        let start = parse::read_start(&head).map_err(bad)?;
        let size = start.header.size()?;
        let table_bytes = 8 * u64::from(size[1]);
        let left = length.saturating_sub(start.table_at);
        if left < table_bytes {
            let lines = size[1];
            return Err(bad(format!(
                "it ends early: {left} bytes cannot hold the offsets of {lines} lines"
            )));
        }
        let mut table = memory::filled(memory::count(table_bytes), 0, "line offsets")?;
        stream.seek(SeekFrom::Start(start.table_at)).map_err(failed)?;
        stream.read_exact(&mut table).map_err(failed)?;
        let offsets = table.as_chunks().0.iter().map(|&bytes| u64::from_le_bytes(bytes)).collect();
        Ok(Self { path: path.to_owned(), stream, length, max_bytes, start, size, offsets })
    }

    /// The image's header.
    pub fn header(&self) -> &DeepHeader {
        &self.start.header
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Bytes of the file.
    pub fn file_bytes(&self) -> u64 {
        self.length
    }

    /// Name and type of each part that is not read.
    pub fn other_parts(&self) -> &[String] {
        &self.start.other_parts
    }

    /// Calls `visit` for each line, from top to bottom, without keeping any.
    ///
    /// # Errors
    /// `Contents` if a line is broken or missing, `Limit` if it takes more memory than allowed, and
    /// errors of `visit`.
    pub fn for_each_row(&mut self, mut visit: impl FnMut(DeepRow) -> Result<()>) -> Result<()> {
        // Lines that share bytes in the file could unpack to far more than its size justifies.
        let mut unread = self.length;
        for y in 0..self.size[1] {
            visit(self.read_row(y, &mut unread)?)?;
        }
        Ok(())
    }

    /// Reads the whole image.
    ///
    /// # Errors
    /// As [`DeepFile::for_each_row`]; `Limit` also if all lines take more memory than allowed.
    pub fn read(&mut self) -> Result<DeepImage> {
        let sample_bytes = self.header().sample_bytes() as u64;
        let (max_bytes, path) = (self.max_bytes, self.path.clone());
        let (mut rows, mut taken) = (Vec::new(), 0);
        self.for_each_row(|row| {
            taken += 4 * row.width() as u64 + sample_bytes * row.sample_count() as u64;
            check_limit(&path, taken, max_bytes)?;
            rows.push(row);
            Ok(())
        })?;
        Ok(DeepImage { header: self.header().clone(), rows })
    }

    /// The numbers of samples, their depths and their opacity, without keeping lines.
    ///
    /// # Errors
    /// As [`DeepFile::for_each_row`].
    pub fn statistics(&mut self) -> Result<DeepStatistics> {
        let mut tally = Tally::new(self.header());
        self.for_each_row(|row| {
            tally.add(&row);
            Ok(())
        })?;
        Ok(tally.finish())
    }

    fn read_row(&mut self, y: u32, unread: &mut u64) -> Result<DeepRow> {
        let line = self.start.header.data_window.min[1].wrapping_add_unsigned(y);
        let bad = |why: String| Error::contents(&self.path, format!("line {line}: {why}"));
        let failed = |error| Error::file(&self.path, error);
        let stream = &mut self.stream;
        let mut piece = |at: u64, count: u64| -> Result<Vec<u8>> {
            let left = self.length.saturating_sub(at).min(*unread);
            if count > left {
                return Err(bad(format!("it ends early: expected {count} bytes at byte {at}")));
            }
            *unread -= count;
            // The count was checked against the bytes of the file.
            let mut bytes = memory::filled(memory::count(count), 0, "a line of samples")?;
            stream.seek(SeekFrom::Start(at)).map_err(failed)?;
            stream.read_exact(&mut bytes).map_err(failed)?;
            Ok(bytes)
        };

        let at = self.offsets[y as usize];
        if at == 0 {
            return Err(bad("it is missing".to_owned()));
        }
        let head_bytes = if self.start.part.is_some() { 32 } else { 28 };
        let head = piece(at, head_bytes)?;
        let [found, packed_counts, packed_samples, due] =
            read_chunk_head(&head, self.start.part).map_err(bad)?;
        if found != line as u64 {
            return Err(bad(format!("line {} is in its place", found as i32)));
        }
        let counts_due = 4 * u64::from(self.size[0]);
        check_limit(&self.path, counts_due.saturating_add(due), self.max_bytes)?;
        let header = &self.start.header;
        let compression = header.compression;
        let counts = piece(at + head_bytes, packed_counts)?;
        let counts = compression.unpack(&counts, counts_due).map_err(bad)?;
        let ends = counts.as_chunks().0.iter().map(|&bytes| u32::from_le_bytes(bytes)).collect();
        let mut row = DeepRow { ends, channels: Vec::new() };
        let last = row.ends.last().copied().unwrap_or(0);
        if !row.ends.is_sorted() || last > i32::MAX as u32 {
            return Err(bad("its cumulative sample counts decrease or are too large".to_owned()));
        }
        let expected = u64::from(last) * header.sample_bytes() as u64;
        if due != expected {
            return Err(bad(format!("{due} bytes for {last} samples, expected {expected}")));
        }
        // The line's offset was checked against the file's length, so this cannot overflow.
        let samples = piece(at + head_bytes + packed_counts, packed_samples)?;
        let samples = compression.unpack(&samples, due).map_err(bad)?;
        let mut samples = Cursor::new(&samples);
        for channel in &header.channels {
            let bytes = samples.take(last as usize * channel.pixel_type.size()).map_err(bad)?;
            row.channels.push(Samples::read(channel.pixel_type, bytes));
        }
        Ok(row)
    }
}

/// The number of a line and three sizes: of the packed sample counts, of the packed samples and of
/// the unpacked samples.
fn read_chunk_head(head: &[u8], part: Option<i32>) -> Result<[u64; 4], String> {
    let mut cursor = Cursor::new(head);
    if let Some(part) = part {
        let found = cursor.i32()?;
        if found != part {
            return Err(format!("it belongs to part {found}, not to part {part}"));
        }
    }
    Ok([cursor.i32()? as u64, cursor.u64()?, cursor.u64()?, cursor.u64()?])
}

fn check_limit(path: &Path, needed: u64, max_bytes: u64) -> Result<()> {
    if needed > max_bytes.min(isize::MAX as u64) {
        let what = format!("{}: deep samples", path.display());
        let (needed, limit) = (format!("{needed} bytes"), format!("{max_bytes} bytes"));
        return Err(ErrorKind::Limit { what, needed, limit }.into());
    }
    Ok(())
}
