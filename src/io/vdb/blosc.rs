//! Reads and writes Blosc 1 chunks: 16 bytes of header, then blocks of LZ4 streams. Bytes are
//! shuffled, so that bytes of equal significance of neighbouring numbers are adjacent. Knows
//! nothing of voxels.
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
/// The largest number of streams per block; a block of numbers with more bytes is not split.
const MAX_STREAMS: usize = 16;
/// The smallest number of numbers per stream; a smaller block is not split.
const MIN_STREAM: usize = 128;

/// Decompresses the chunk into `output`, which has the expected size. The header is checked against
/// that size and never trusted. `shuffled` is scratch memory.
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
        return Err(Fault::bad(
            start,
            format!("blosc format version {version}; only 1 and 2 are supported"),
        ));
    }
    if total != output.len() {
        let why = format!("a blosc chunk of {total} bytes, expected {}", output.len());
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
        return Err(Fault::bad(start, format!("blosc flags {flags:#04x}: only LZ4 is supported")));
    }
    if block_size == 0 || type_size == 0 {
        return Err(Fault::bad(start, "a blosc chunk with blocks or numbers of zero bytes"));
    }
    let block_size = block_size.min(total);
    for block in output.chunks_mut(block_size) {
        let block_start = bytes.u32()? as usize;
        let Some(data) = chunk.get(block_start..) else {
            return Err(Fault::bad(
                start,
                format!("a blosc block at byte {block_start}, beyond the end of its chunk"),
            ));
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
        let why = format!("{} bytes do not split evenly into {streams} streams", output.len());
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
                let why = format!("an LZ4 block of {written} bytes, expected {length}");
                return Err(Fault::bad(at, why));
            }
            Err(error) => return Err(Fault::bad(at, format!("LZ4: {error}"))),
        }
    }
    Ok(())
}

/// Moves byte k of number i, which lies at `k * numbers + i`, back to its place.
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

/// Appends a chunk that decompresses to `bytes`, numbers of `type_size` bytes. Returns `false`,
/// with meaningless bytes appended, if the chunk would not be shorter. The same bytes give the same
/// chunk. `shuffled` is scratch memory.
pub(super) fn compress(
    bytes: &[u8],
    type_size: usize,
    shuffled: &mut Vec<u8>,
    out: &mut Vec<u8>,
) -> bool {
    // Blosc itself does not compress less than this.
    if bytes.len() < MIN_STREAM || !bytes.len().is_multiple_of(type_size) {
        return false;
    }
    let start = out.len();
    // Decoders split blocks by this rule; the flag tells newer ones where it does not apply.
    let split = type_size <= MAX_STREAMS && bytes.len() / type_size >= MIN_STREAM;
    let (streams, mark) = if split { (type_size, 0) } else { (1, NOT_SPLIT) };
    out.extend([2, 1, LZ4 << 5 | SHUFFLED | mark, type_size as u8]);
    // One block: number of bytes, block size, chunk size (filled in below), start of the block.
    for size in [bytes.len() as u32, bytes.len() as u32, 0, 20] {
        out.extend(size.to_le_bytes());
    }
    shuffle(bytes, type_size, shuffled);
    for stream in shuffled.chunks_exact(bytes.len() / streams) {
        let packed = lz4_flex::block::compress(stream);
        let stored = if packed.len() < stream.len() { &packed } else { stream };
        out.extend((stored.len() as u32).to_le_bytes());
        out.extend_from_slice(stored);
    }
    let size = out.len() - start;
    out[start + 12..start + 16].copy_from_slice(&(size as u32).to_le_bytes());
    size < bytes.len()
}

/// The inverse of [`unshuffle`], for complete numbers.
fn shuffle(bytes: &[u8], type_size: usize, shuffled: &mut Vec<u8>) {
    shuffled.clear();
    for byte in 0..type_size {
        shuffled.extend(bytes.iter().skip(byte).step_by(type_size));
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// 128 numbers with their bytes k of number i = 8 k + i mod 8.
    fn numbers() -> Vec<u8> {
        (0..512_usize).map(|byte| (8 * (byte % 4) + byte / 4 % 8) as u8).collect()
    }

    /// An LZ4 block: eight literals, then a match of offset 8 up to five last literals.
    fn packed(stream: &[u8]) -> Vec<u8> {
        let matched = stream.len() - 8 - 5;
        let mut block = vec![0x8f];
        block.extend(&stream[..8]);
        block.extend([8, 0, (matched - 4 - 15) as u8, 0x50]);
        block.extend(&stream[stream.len() - 5..]);
        block
    }

    fn chunk(flags: u8, total: u32, block_size: u32, streams: &[Vec<u8>]) -> Vec<u8> {
        let data: Vec<u8> = streams
            .iter()
            .flat_map(|stream| [&(stream.len() as u32).to_le_bytes()[..], stream].concat())
            .collect();
        let mut chunk = vec![2, 1, flags, 4];
        for size in [total, block_size, 20 + data.len() as u32, 20] {
            chunk.extend(size.to_le_bytes());
        }
        chunk.extend(data);
        chunk
    }

    fn streams() -> Vec<Vec<u8>> {
        let stream = |byte| numbers().into_iter().skip(byte).step_by(4).collect::<Vec<u8>>();
        vec![packed(&stream(0)), stream(1), packed(&stream(2)), packed(&stream(3))]
    }

    fn unpack(chunk: &[u8]) -> Parsed<Vec<u8>> {
        let mut output = vec![0; 512];
        decompress(chunk, 0, &mut output, &mut Vec::new()).map(|()| output)
    }

    #[test]
    fn split_streams_packed_and_raw_come_back_in_order() {
        assert_eq!(unpack(&chunk(0x21, 512, 512, &streams())).unwrap(), numbers());
    }

    #[test]
    fn a_block_that_is_not_split_has_one_stream() {
        let joined: Vec<u8> =
            (0..4).flat_map(|byte| numbers().into_iter().skip(byte).step_by(4)).collect();
        assert_eq!(unpack(&chunk(0x31, 512, 512, &[joined])).unwrap(), numbers());
        assert_eq!(unpack(&chunk(0x30, 512, 512, &[numbers()])).unwrap(), numbers());
    }

    #[test]
    fn a_copied_chunk_has_no_blocks() {
        let copied = [&chunk(0x23, 512, 512, &[])[..16], &numbers()].concat();
        assert_eq!(unpack(&copied).unwrap(), numbers());
    }

    #[test]
    fn what_is_compressed_comes_back() {
        let noise = |i: usize| (i.wrapping_mul(0x9e37_79b9) >> 7) as u8;
        for length in [128, 136, 504, 512, 2048, 6144, 131_072] {
            for type_size in [1, 2, 4, 8] {
                let bytes: Vec<u8> =
                    (0..length).map(|i| if i % 16 < 3 { noise(i) } else { 7 }).collect();
                let mut chunk = Vec::new();
                // In a short block, the header outweighs the savings.
                let shrank = compress(&bytes, type_size, &mut Vec::new(), &mut chunk);
                assert!(shrank || length < 504, "{length} bytes, {type_size} a number");
                assert_eq!(shrank, chunk.len() < length);
                let mut output = vec![0; length];
                decompress(&chunk, 0, &mut output, &mut Vec::new()).unwrap();
                assert!(output == bytes, "{length} bytes, {type_size} a number");
            }
        }
        let noisy: Vec<u8> = (0..2048).map(noise).collect();
        assert!(!compress(&noisy, 4, &mut Vec::new(), &mut Vec::new()), "noise does not shrink");
    }

    #[test]
    fn a_chunk_cut_anywhere_is_an_error() {
        let whole = chunk(0x21, 512, 512, &streams());
        for length in 0..whole.len() {
            assert!(unpack(&whole[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn a_header_that_differs_from_what_is_due_is_an_error() {
        for (total, block_size) in [(511, 512), (513, 512), (u32::MAX, 512), (512, 0), (512, 1)] {
            assert!(unpack(&chunk(0x21, total, block_size, &streams())).is_err());
        }
        // Another codec, and bits shuffled instead of bytes.
        for flags in [0x01, 0x41, 0x81, 0x25] {
            assert!(unpack(&chunk(flags, 512, 512, &streams())).is_err());
        }
    }
}
