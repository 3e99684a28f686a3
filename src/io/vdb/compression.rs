//! The compression of a grid's values, and the framing of every compressed run of bytes. Knows
//! nothing of masks or trees.

use std::fmt;

use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::{DecompressorOxide, decompress, inflate_flags};

use super::blosc;
use super::fault::{Fault, Parsed};
use super::source::Bytes;
use crate::error::memory;

/// How a grid's values are compressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compression {
    /// Values are deflated; ignored where `blosc` is set.
    pub zip: bool,
    /// Only active values are stored.
    pub active_mask: bool,
    /// Values are Blosc chunks with LZ4.
    pub blosc: bool,
}

impl Compression {
    /// Only active values, in Blosc chunks with LZ4: OpenVDB's own default.
    pub const BLOSC: Self = Self { zip: false, active_mask: true, blosc: true };
    /// Only active values, deflated.
    pub const ZIP: Self = Self { zip: true, active_mask: true, blosc: false };
    /// Only active values, not compressed.
    pub const ACTIVE_MASK: Self = Self { zip: false, active_mask: true, blosc: false };
    /// All values, not compressed.
    pub const NONE: Self = Self { zip: false, active_mask: false, blosc: false };

    /// The compression for the file's flags; `None` if some are unknown.
    pub(super) fn from_flags(flags: u32) -> Option<Self> {
        let has = |flag: u32| flags & flag != 0;
        (flags < 8).then_some(Self { zip: has(1), active_mask: has(2), blosc: has(4) })
    }

    /// The file's flags.
    pub(super) fn flags(self) -> u32 {
        u32::from(self.zip) | u32::from(self.active_mask) << 1 | u32::from(self.blosc) << 2
    }
}

/// The names that OpenVDB uses: "none", "zip", "blosc + active values", ...
impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = [(self.zip, "zip"), (self.blosc, "blosc"), (self.active_mask, "active values")];
        let words: Vec<_> = parts.iter().filter(|(set, _)| *set).map(|(_, word)| *word).collect();
        if words.is_empty() { f.write_str("none") } else { f.write_str(&words.join(" + ")) }
    }
}

/// A run of bytes as it is stored in the file.
#[derive(Clone, Copy)]
pub(super) enum Run<'a> {
    Bare(&'a [u8]),
    Zip(&'a [u8], u64),
    Blosc(&'a [u8], u64),
}

/// Reads the run that decompresses to `size` bytes.
pub(super) fn take_run<'a>(
    bytes: &mut Bytes<'a>,
    compression: Compression,
    size: usize,
) -> Parsed<Run<'a>> {
    if !compression.zip && !compression.blosc {
        return bytes.take(size).map(Run::Bare);
    }
    let at = bytes.position();
    let length = bytes.i64()?;
    let start = bytes.position();
    if length <= 0 {
        if length.unsigned_abs() != size as u64 {
            let stored = length.unsigned_abs();
            let why = format!("{stored} bytes stored, expected {size}");
            return Err(Fault::bad(at, why));
        }
        return bytes.take(size).map(Run::Bare);
    }
    let Ok(length) = usize::try_from(length) else {
        return Err(Fault::Short { at: start, needed: length as u64 });
    };
    let data = bytes.take(length)?;
    Ok(if compression.blosc { Run::Blosc(data, start) } else { Run::Zip(data, start) })
}

/// Compression level of deflate: zlib's default.
const DEFLATE_LEVEL: u8 = 6;

/// Appends a run with its framing. `part_bytes` is the size of the numbers in it; `shuffled` is
/// scratch memory.
pub(super) fn put_run(
    run: &[u8],
    compression: Compression,
    part_bytes: usize,
    shuffled: &mut Vec<u8>,
    out: &mut Vec<u8>,
) {
    if !compression.zip && !compression.blosc {
        out.extend_from_slice(run);
        return;
    }
    let frame = out.len();
    out.extend([0; 8]);
    let packed = if compression.blosc {
        blosc::compress(run, part_bytes, shuffled, out)
    } else {
        out.extend(miniz_oxide::deflate::compress_to_vec_zlib(run, DEFLATE_LEVEL));
        out.len() - frame - 8 < run.len()
    };
    // A run that does not shrink is stored uncompressed, after its negated length.
    let length = if packed {
        (out.len() - frame - 8) as i64
    } else {
        out.truncate(frame + 8);
        out.extend_from_slice(run);
        -(run.len() as i64)
    };
    out[frame..frame + 8].copy_from_slice(&length.to_le_bytes());
}

/// Scratch memory for decompression, which one thread reuses.
#[derive(Default)]
pub(super) struct Workspace {
    bytes: Vec<u8>,
    shuffled: Vec<u8>,
    inflate: Option<Box<DecompressorOxide>>,
}

impl Workspace {
    fn resize(&mut self, size: usize) -> Parsed<()> {
        let more = size.saturating_sub(self.bytes.len());
        memory::reserve(&mut self.bytes, more, "a node's values")?;
        self.bytes.resize(size, 0);
        Ok(())
    }

    /// Decompresses a run of `size` bytes.
    pub(super) fn unpack<'a>(&'a mut self, run: Run<'a>, size: usize) -> Parsed<&'a [u8]> {
        match run {
            Run::Bare(bytes) => return Ok(bytes),
            Run::Zip(data, start) => {
                self.resize(size)?;
                self.inflate(data, start)?;
            }
            Run::Blosc(data, start) => {
                self.resize(size)?;
                blosc::decompress(data, start, &mut self.bytes, &mut self.shuffled)
                    .map_err(complete)?;
            }
        }
        Ok(&self.bytes)
    }

    /// Fills all of `self.bytes`. The output cannot grow, which stops a decompression bomb.
    fn inflate(&mut self, data: &[u8], start: u64) -> Parsed<()> {
        let flags = inflate_flags::TINFL_FLAG_PARSE_ZLIB_HEADER
            | inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
        let inflate = self.inflate.get_or_insert_default();
        inflate.init();
        let (status, _, written) = decompress(inflate, data, &mut self.bytes, 0, flags);
        if status != TINFLStatus::Done || written != self.bytes.len() {
            let due = self.bytes.len();
            let why = format!("zip: {status:?} after {written} of {due} bytes");
            return Err(Fault::bad(start, why));
        }
        Ok(())
    }
}

/// Fills `target` from one Blosc chunk, for other formats that contain such chunks. The error says
/// why it failed.
pub(in crate::io) fn decompress_blosc(chunk: &[u8], target: &mut [u8]) -> Result<(), String> {
    blosc::decompress(chunk, 0, target, &mut Vec::new()).map_err(|fault| match complete(fault) {
        Fault::Bad { why, .. } => why,
        Fault::Io(error) => error.to_string(),
        Fault::Short { needed, .. } => format!("{needed} more bytes needed"),
        Fault::Memory(error) => error.to_string(),
    })
}

/// A chunk that is decompressed is complete. Missing bytes are then an error of its contents, not a
/// request for more of the file.
fn complete(fault: Fault) -> Fault {
    match fault {
        Fault::Short { at, needed } => {
            Fault::bad(at, format!("a blosc chunk ends early: {needed} more bytes needed"))
        }
        other => other,
    }
}
