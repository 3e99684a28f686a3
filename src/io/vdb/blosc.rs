//! One Blosc 1 chunk: 16 bytes of header, then blocks of LZ4 streams, whose bytes are shuffled so
//! that like bytes of neighbouring numbers lie together. It knows nothing of voxels.
//!
//! ```text
//! 0 format version (2)   1 codec version   2 flags   3 type size
//! 4 bytes in all u32     8 block size u32  12 chunk size u32
//! 16 start of each block u32, then the blocks
//! ```

use super::fault::{Fault, Parsed};
use super::source::Bytes;

const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BIT_SHUFFLED: u8 = 4;
const NOT_SPLIT: u8 = 16;
const LZ4: u8 = 1;
/// Streams of a block at most; a block of more bytes a number is not split.
const MAX_STREAMS: usize = 16;
/// Numbers in a stream at least; a smaller block is not split.
const MIN_STREAM: usize = 128;

/// Decompresses the chunk into `output`, which has the size that the caller expects: the header is
/// held against it and never trusted. `shuffled` is memory to work in.
pub(super) fn decompress(
    chunk: &[u8],
    start: u64,
    output: &mut [u8],
    shuffled: &mut Vec<u8>,
) -> Parsed<()> {
    let mut bytes = Bytes::new(chunk, start);
    let head = bytes.take(4)?;
    let (version, flags, type_size) = (head[0], head[2], usize::from(head[3]));
    let sizes: [u32; 3] = bytes.each(Bytes::u32)?;
    let [total, block_size, _] = sizes.map(|size| size as usize);
    if version != 1 && version != 2 {
        return Err(Fault::bad(start, format!("blosc format version {version}, 2 is known")));
    }
    if total != output.len() {
        let why = format!("a blosc chunk of {total} bytes where {} are due", output.len());
        return Err(Fault::bad(start, why));
    }
    if total == 0 {
        return Ok(());
    }
    if flags & COPIED != 0 {
        output.copy_from_slice(bytes.take(total)?);
        return Ok(());
    }
    if flags >> 5 != LZ4 || flags & BIT_SHUFFLED != 0 {
        return Err(Fault::bad(start, format!("blosc flags {flags:#04x}: only LZ4 is known")));
    }
    if block_size == 0 || type_size == 0 {
        return Err(Fault::bad(start, "a blosc chunk with blocks or numbers of no bytes"));
    }
    let block_size = block_size.min(total);
    for block in output.chunks_mut(block_size) {
        let block_start = bytes.u32()? as usize;
        let Some(data) = chunk.get(block_start..) else {
            return Err(Fault::bad(start, format!("a blosc block at {block_start} of the chunk")));
        };
        let split = flags & NOT_SPLIT == 0
            && type_size <= MAX_STREAMS
            && block_size / type_size >= MIN_STREAM
            && block.len() == block_size;
        let streams = if split { type_size } else { 1 };
        let mut data = Bytes::new(data, start + block_start as u64);
        if flags & SHUFFLED != 0 && type_size > 1 {
            shuffled.resize(block.len(), 0);
            read_streams(&mut data, streams, shuffled)?;
            unshuffle(shuffled, type_size, block);
        } else {
            read_streams(&mut data, streams, block)?;
        }
    }
    Ok(())
}

/// Fills `output` from `streams` streams of equal length.
fn read_streams(data: &mut Bytes, streams: usize, output: &mut [u8]) -> Parsed<()> {
    let length = output.len() / streams;
    if length * streams != output.len() {
        let why = format!("{} bytes do not split in {streams}", output.len());
        return Err(Fault::bad(data.position(), why));
    }
    for stream in output.chunks_exact_mut(length) {
        let at = data.position();
        let size = data.u32()? as usize;
        let packed = data.take(size)?;
        if size == length {
            stream.copy_from_slice(packed);
            continue;
        }
        match lz4_flex::block::decompress_into(packed, stream) {
            Ok(written) if written == length => {}
            Ok(written) => {
                let why = format!("an LZ4 block of {written} bytes where {length} are due");
                return Err(Fault::bad(at, why));
            }
            Err(error) => return Err(Fault::bad(at, format!("LZ4: {error}"))),
        }
    }
    Ok(())
}

/// Puts byte k of number i, which lies at `k * numbers + i`, back to its place.
fn unshuffle(shuffled: &[u8], type_size: usize, output: &mut [u8]) {
    let numbers = output.len() / type_size;
    let (whole, rest) = output.split_at_mut(numbers * type_size);
    rest.copy_from_slice(&shuffled[whole.len()..]);
    if type_size == 4 {
        let (low, high) = shuffled[..whole.len()].split_at(2 * numbers);
        let ((a, b), (c, d)) = (low.split_at(numbers), high.split_at(numbers));
        let (a, b, c, d) = (&a[..numbers], &b[..numbers], &c[..numbers], &d[..numbers]);
        for (index, number) in whole.as_chunks_mut().0.iter_mut().enumerate() {
            *number = [a[index], b[index], c[index], d[index]];
        }
        return;
    }
    for (byte, stream) in shuffled[..whole.len()].chunks_exact(numbers.max(1)).enumerate() {
        for (index, &value) in stream.iter().enumerate() {
            whole[index * type_size + byte] = value;
        }
    }
}
