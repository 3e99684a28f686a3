//! Reads the bytes of a file in pieces, always checked against what is left. Knows nothing of the
//! bytes' meaning.
//!
//! [`Bytes`] is a cursor over a slice. [`Reader`] holds a window of the file and runs a parser on
//! it; if the window was too short, it enlarges the window and runs the parser again. So all
//! parsers work on slices, and only the window is in memory, not the file.

use std::io::SeekFrom;
use std::sync::{Mutex, PoisonError};

use super::fault::{Fault, Parsed};
use crate::error::memory;
use crate::io::files::File;

/// An open file and its length, shared by several [`Reader`]s at different positions.
pub(super) struct Source {
    stream: Mutex<File>,
    length: u64,
}

impl Source {
    /// Takes the stream and determines its length.
    pub(super) fn new(mut stream: File) -> Parsed<Self> {
        let length = stream.seek(SeekFrom::End(0))?;
        Ok(Self { stream: Mutex::new(stream), length })
    }

    /// Length in bytes.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, position: u64, into: &mut [u8]) -> Parsed<()> {
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        stream.seek(SeekFrom::Start(position))?;
        Ok(stream.read_exact(into)?)
    }
}

/// A window over the bytes `position..end` of a [`Source`].
pub(super) struct Reader<'a> {
    source: &'a Source,
    window: Vec<u8>,
    /// Number of bytes of the window that have been consumed.
    used: usize,
    /// Offset of the window in the file.
    window_start: u64,
    end: u64,
    /// Number of bytes to read at a time.
    chunk: usize,
}

impl<'a> Reader<'a> {
    /// A reader of the bytes from `start` to `end` (limited to the end of the file), which reads
    /// `chunk` bytes at a time where possible.
    pub(super) fn new(source: &'a Source, start: u64, end: u64, chunk: usize) -> Self {
        let end = end.min(source.length());
        let start = start.min(end);
        Self { source, window: Vec::new(), used: 0, window_start: start, end, chunk }
    }

    /// Offset of the next byte in the file.
    pub(super) fn position(&self) -> u64 {
        self.window_start + self.used as u64
    }

    /// Bytes left before the end.
    pub(super) fn left(&self) -> u64 {
        self.end - self.position()
    }

    /// Runs `parser` on the next bytes and consumes those that it took. If the window was too
    /// short, the parser runs again on a larger one, unless the file has no further bytes.
    pub(super) fn parse<T>(
        &mut self,
        mut parser: impl FnMut(&mut Bytes) -> Parsed<T>,
    ) -> Parsed<T> {
        loop {
            let mut bytes = Bytes::new(&self.window[self.used..], self.position());
            match parser(&mut bytes) {
                Ok(parsed) => {
                    self.used += bytes.taken();
                    return Ok(parsed);
                }
                Err(Fault::Short { at, needed }) => {
                    let ahead = self.window.len() - self.used;
                    if needed > self.end.saturating_sub(at) || ahead as u64 == self.left() {
                        return Err(Fault::Short { at, needed });
                    }
                    let wanted = (at + needed - self.position()).max(2 * ahead as u64);
                    self.look_ahead(wanted)?;
                }
                Err(other) => return Err(other),
            }
        }
    }

    /// The next number.
    pub(super) fn u32(&mut self) -> Parsed<u32> {
        self.parse(|bytes| bytes.array().map(u32::from_le_bytes))
    }

    /// The next bytes: at least `wanted` of them, or all if fewer are left.
    pub(super) fn look_ahead(&mut self, wanted: u64) -> Parsed<&[u8]> {
        let ahead = self.window.len() - self.used;
        if (ahead as u64) < wanted.min(self.left()) {
            self.window.drain(..self.used);
            self.window_start += self.used as u64;
            self.used = 0;
            let target =
                memory::count(wanted.max(self.chunk as u64).min(self.end - self.window_start));
            // The target is limited by the size of the file.
            let more = target.saturating_sub(self.window.len());
            memory::reserve(&mut self.window, more, "a part of the file")?;
            self.window.resize(target, 0);
            self.source.read_at(self.window_start + ahead as u64, &mut self.window[ahead..])?;
        }
        Ok(&self.window[self.used..])
    }

    /// Moves forward to a later offset of the file.
    pub(super) fn jump(&mut self, position: u64) {
        let position = position.clamp(self.position(), self.end);
        match usize::try_from(position - self.window_start) {
            Ok(used) if used <= self.window.len() => self.used = used,
            _ => {
                self.window.clear();
                (self.used, self.window_start) = (0, position);
            }
        }
    }

    /// Consumes `count` bytes, which [`Reader::look_ahead`] has returned.
    pub(super) fn step(&mut self, count: usize) {
        self.used = (self.used + count).min(self.window.len());
    }
}

/// A cursor over a slice that knows the slice's offset in the file.
#[derive(Clone)]
pub(super) struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
    start: u64,
}

impl<'a> Bytes<'a> {
    /// A cursor at the start of `data`, which lies at byte `start` of the file.
    pub(super) fn new(data: &'a [u8], start: u64) -> Self {
        Self { data, at: 0, start }
    }

    /// Number of bytes consumed so far.
    pub(super) fn taken(&self) -> usize {
        self.at
    }

    /// Offset of the next byte in the file.
    pub(super) fn position(&self) -> u64 {
        self.start + self.at as u64
    }

    /// The bytes that are not consumed yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.data[self.at..]
    }

    /// The next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> Parsed<&'a [u8]> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.data.len());
        let Some(end) = end else {
            return Err(Fault::Short { at: self.position(), needed: count as u64 });
        };
        let taken = &self.data[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn u8(&mut self) -> Parsed<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Parsed<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn i32(&mut self) -> Parsed<i32> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(super) fn i64(&mut self) -> Parsed<i64> {
        Ok(i64::from_le_bytes(self.array()?))
    }

    pub(super) fn f32(&mut self) -> Parsed<f32> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    pub(super) fn f64(&mut self) -> Parsed<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// Bytes that are preceded by their `u32` length.
    pub(super) fn counted(&mut self) -> Parsed<&'a [u8]> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    /// A string that is preceded by its length; bytes that are not UTF-8 become the replacement
    /// character.
    pub(super) fn string(&mut self) -> Parsed<String> {
        Ok(String::from_utf8_lossy(self.counted()?).into_owned())
    }

    /// `N` values, each read by `parser`.
    pub(super) fn each<T: Copy + Default, const N: usize>(
        &mut self,
        parse: impl Fn(&mut Self) -> Parsed<T>,
    ) -> Parsed<[T; N]> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = parse(self)?;
        }
        Ok(values)
    }
}
