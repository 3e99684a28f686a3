//! Bytes of a file, read in pieces and always checked against what is left. It knows nothing of
//! what the bytes mean.
//!
//! [`Bytes`] is a cursor over a slice; [`Reader`] holds a window of the file and lets a parser run
//! on it, enlarging the window and running the parser again when it was too short. So all parsers
//! work on slices, and the memory in use is the window and not the file.

use std::io::{Read, Seek, SeekFrom};
use std::sync::{Mutex, PoisonError};

use super::fault::{Fault, Parsed};
use crate::error::memory;

/// What a file may be read from.
pub(super) trait Stream: Read + Seek + Send {}
impl<T: Read + Seek + Send> Stream for T {}

/// An open file and its length; read by many [`Reader`]s, each at its own place.
pub(super) struct Source {
    stream: Mutex<Box<dyn Stream>>,
    length: u64,
}

impl Source {
    /// Takes the stream and measures it.
    pub(super) fn new(mut stream: Box<dyn Stream>) -> Parsed<Self> {
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
    /// Bytes of the window that have been used up.
    used: usize,
    /// Where the window starts in the file.
    window_start: u64,
    end: u64,
    /// Bytes to read at once.
    chunk: usize,
}

impl<'a> Reader<'a> {
    /// A reader of the bytes from `start` to `end` (cut at the end of the file), which reads
    /// `chunk` bytes at once where it can.
    pub(super) fn new(source: &'a Source, start: u64, end: u64, chunk: usize) -> Self {
        let end = end.min(source.length());
        let start = start.min(end);
        Self { source, window: Vec::new(), used: 0, window_start: start, end, chunk }
    }

    /// Where the next byte lies in the file.
    pub(super) fn position(&self) -> u64 {
        self.window_start + self.used as u64
    }

    /// Bytes left before the end.
    pub(super) fn left(&self) -> u64 {
        self.end - self.position()
    }

    /// Runs `parser` on the bytes ahead and steps over what it took. A parser that runs short is
    /// run again on a larger window, unless the bytes that it asks for are not there at all.
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

    /// The bytes ahead: at least `wanted` of them unless the end comes before.
    pub(super) fn look_ahead(&mut self, wanted: u64) -> Parsed<&[u8]> {
        let ahead = self.window.len() - self.used;
        if (ahead as u64) < wanted.min(self.left()) {
            self.window.drain(..self.used);
            self.window_start += self.used as u64;
            self.used = 0;
            let target = wanted.max(self.chunk as u64).min(self.end - self.window_start);
            // The target is bounded by the bytes that the file has.
            let more = (target as usize).saturating_sub(self.window.len());
            memory::reserve(&mut self.window, more, "a part of the file")?;
            self.window.resize(target as usize, 0);
            self.source.read_at(self.window_start + ahead as u64, &mut self.window[ahead..])?;
        }
        Ok(&self.window[self.used..])
    }

    /// Goes to a later place of the file.
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

    /// Steps over `count` bytes that [`Reader::look_ahead`] has shown.
    pub(super) fn step(&mut self, count: usize) {
        self.used = (self.used + count).min(self.window.len());
    }
}

/// A cursor over a slice that knows where the slice lies in the file.
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

    /// Bytes taken so far.
    pub(super) fn taken(&self) -> usize {
        self.at
    }

    /// Where the next byte lies in the file.
    pub(super) fn position(&self) -> u64 {
        self.start + self.at as u64
    }

    /// The bytes not taken yet.
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

    /// A `u32` length and as many bytes.
    pub(super) fn counted(&mut self) -> Parsed<&'a [u8]> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    /// A counted string; bytes that are not UTF-8 become the replacement character.
    pub(super) fn string(&mut self) -> Parsed<String> {
        Ok(String::from_utf8_lossy(self.counted()?).into_owned())
    }

    /// `N` values by the same parser.
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
