//! `.hair`, the format of Cem Yuksel's hair models: a header of 128 bytes, and arrays of which it
//! says which are there. May be compressed by gzip as a whole.

use std::io::Read;

use flate2::read::MultiGzDecoder;
use glam::Vec3;

use super::input::{Clamp, Input, f32_of, u32_of, vectors};
use super::name_of;
use crate::error::memory;
use crate::error::{Error, Result};
use crate::io::files;
use crate::surface::{Strands, Varying};

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"HAIR";

/// Bytes of the header.
pub(super) const HEADER: usize = 128;

/// The most bytes that one byte of a gzip file can hold.
const DEFLATE_RATIO: u64 = 1032;

/// Bits of the header's flags, in the order of the arrays. The last four are per point.
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLOR: u32 = 16;

/// Arrays and the bytes of each item.
const ARRAYS: [(u32, u64); 5] =
    [(SEGMENTS, 2), (POINTS, 12), (THICKNESS, 4), (TRANSPARENCY, 4), (COLOR, 12)];

/// The flags of a file that has the segments and points of its strands, and some of the other
/// arrays.
pub(super) fn flags(thickness: bool, transparency: bool, color: bool) -> u32 {
    let optional = [(thickness, THICKNESS), (transparency, TRANSPARENCY), (color, COLOR)];
    let held = optional.into_iter().filter(|(held, _)| *held).map(|(_, flag)| flag);
    SEGMENTS | POINTS | held.sum::<u32>()
}

/// The header. Numbers for all points count where there is no array of them.
struct Header {
    strands: u64,
    points: u64,
    flags: u32,
    segments: u32,
    /// Diameter.
    thickness: f32,
    transparency: f32,
    color: Vec3,
}

impl Header {
    fn of(bytes: &[u8; HEADER]) -> Self {
        let [strands, points, flags, segments] = [4, 8, 12, 16].map(|at| u32_of(&bytes[at..]));
        let [thickness, transparency, r, g, b] =
            [20, 24, 28, 32, 36].map(|at| f32_of(&bytes[at..]));
        Self {
            strands: strands.into(),
            points: points.into(),
            flags,
            segments,
            thickness,
            transparency,
            color: Vec3::new(r, g, b),
        }
    }

    fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// Bytes of the array of `flag`, 0 if it is not there.
    fn array_bytes(&self, flag: u32) -> u64 {
        let count = if flag == SEGMENTS { self.strands } else { self.points };
        let size = ARRAYS.iter().find(|(known, _)| *known == flag).map_or(0, |(_, size)| *size);
        if self.has(flag) { count * size } else { 0 }
    }

    /// Bytes of the whole file.
    fn file_bytes(&self) -> u64 {
        HEADER as u64 + ARRAYS.iter().map(|(flag, _)| self.array_bytes(*flag)).sum::<u64>()
    }
}

pub(super) fn read(input: &mut Input) -> Result<Strands> {
    let (header, bytes) = unpacked(input)?;
    let mut rest = &bytes[..];
    let [segments, points, thickness, transparency, color] = ARRAYS.map(|(flag, _)| {
        let (array, behind) = rest.split_at(header.array_bytes(flag) as usize);
        rest = behind;
        array
    });
    let segment_counts = segments.chunks_exact(2).map(|b| u32::from(b[0]) | u32::from(b[1]) << 8);
    let counts = if header.has(SEGMENTS) {
        memory::collected(segment_counts.map(|count| count + 1), "strands")?
    } else {
        let each = u64::from(header.segments) + 1;
        if header.strands * each != header.points {
            let Header { strands, points, .. } = header;
            let why = format!("{strands} strands of {each} points, but there are {points} points");
            return Err(input.bad(why));
        }
        memory::filled(header.strands as usize, each as u32, "strands")?
    };
    let numbers =
        |array: &[u8], what: &str| memory::collected(array.chunks_exact(4).map(f32_of), what);
    let points = vectors(points, 12, "points")?;
    let thickness = if header.has(THICKNESS) {
        Varying::PerPoint(numbers(thickness, "thicknesses")?)
    } else {
        Varying::Same(finite(input, header.thickness, "thickness")?)
    };
    let mut outside = Clamp::default();
    let opacity = if header.has(TRANSPARENCY) {
        let mut numbers = numbers(transparency, "transparencies")?;
        for number in &mut numbers {
            *number = outside.number(1.0 - *number);
        }
        Varying::PerPoint(numbers)
    } else {
        let transparency = finite(input, header.transparency, "transparency")?;
        Varying::Same(outside.number(1.0 - transparency))
    };
    outside.note("transparencies", &mut input.notes);
    let mut outside = Clamp::default();
    let color = if header.has(COLOR) {
        let mut colors = vectors(color, 12, "colours")?;
        outside.colors(&mut colors);
        Varying::PerPoint(colors)
    } else {
        for x in header.color.to_array() {
            finite(input, x, "colour")?;
        }
        Varying::Same(outside.color(header.color))
    };
    outside.note("colours", &mut input.notes);
    if thickness.values().iter().all(|&thickness| thickness == 0.0) {
        input.notes.push("its strands have no thickness; set `hair.thickness`".to_owned());
    }
    Strands::new(name_of(input.path), points, &counts, thickness, opacity, color)
        .map_err(|error| input.bad(error.to_string()))
}

/// A default of the header.
fn finite(input: &Input, value: f32, what: &str) -> Result<f32> {
    let why = || input.bad(format!("its default {what} is {value}"));
    if value.is_finite() { Ok(value) } else { Err(why()) }
}

/// The header and the bytes behind it, which are as many as the header says.
fn unpacked(input: &mut Input) -> Result<(Header, Vec<u8>)> {
    let path = input.path;
    let failed = |error| Error::file(path, error);
    let mut start = [0; 2];
    let mut file = files::open(path).map_err(failed)?;
    let packed = file.read_exact(&mut start).is_ok() && start == [0x1f, 0x8b];
    let file = files::open(path).map_err(failed)?;
    let mut stream: Box<dyn Read> =
        if packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
    let mut head = [0; HEADER];
    if stream.read_exact(&mut head).is_err() {
        return Err(input.bad(format!("it ends within the {HEADER} bytes of its header")));
    }
    if !head.starts_with(MAGIC) {
        return Err(input.bad("it does not begin with HAIR"));
    }
    let header = Header::of(&head);
    if header.flags >> ARRAYS.len() != 0 {
        return Err(input.bad(format!("its flags {:#x} are not all known", header.flags)));
    }
    if !header.has(POINTS) {
        return Err(input.bad(format!("its flags {:#x} say that it has no points", header.flags)));
    }
    let due = header.file_bytes();
    let why = |found: u64, more: &str| {
        let Header { strands, points, .. } = header;
        let due = format!("{strands} strands and {points} points take {due} bytes");
        Error::contents(path, format!("{due}, but it has {more}{found}"))
    };
    if !packed && due != input.size {
        return Err(why(input.size, ""));
    }
    if packed && due / DEFLATE_RATIO > input.size {
        return Err(why(input.size.saturating_mul(DEFLATE_RATIO), "at most "));
    }
    // The bytes, and the arrays that are made of them.
    input.take(due.saturating_mul(2) + 4 * header.strands, "hair")?;
    let rest = due - HEADER as u64;
    let mut bytes = memory::room(memory::count(rest), "hair")?;
    let read = stream.by_ref().take(rest).read_to_end(&mut bytes);
    read.map_err(|error| Error::contents(path, format!("it cannot be read: {error}")))?;
    if bytes.len() as u64 != rest {
        return Err(why(bytes.len() as u64 + HEADER as u64, ""));
    }
    match stream.read(&mut [0]) {
        Ok(0) => Ok((header, bytes)),
        Ok(_) => Err(why(due, "more than ")),
        Err(error) => Err(Error::contents(path, format!("it cannot be read: {error}"))),
    }
}
