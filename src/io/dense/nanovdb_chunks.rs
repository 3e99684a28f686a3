//! How NanoVDB files pack a grid: unpacked, or in chunks that are preceded by their lengths. Knows
//! nothing of grids.

use std::io::Read;

use flate2::read::ZlibDecoder;

use crate::error::memory;
use crate::io::vdb::decompress_blosc;

/// Unpacks the `size` bytes of the grid that starts where `data` starts. Also returns the name of
/// the packing.
pub(super) fn unpack(
    data: &[u8],
    codec: u16,
    size: usize,
) -> Result<(Vec<u8>, &'static str), String> {
    let short = |found: usize| format!("its grid ends early: {found} bytes, expected {size}");
    let mut rest = data;
    let mut next = || {
        let (length, behind) = rest.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (chunk, behind) = behind.split_at_checked(length)?;
        rest = behind;
        Some(chunk)
    };
    match codec {
        0 => {
            let grid = data.get(..size).ok_or_else(|| short(data.len()))?;
            Ok((memory::copied(grid, "its grid").map_err(|error| error.to_string())?, "none"))
        }
        1 => {
            let chunk = next().ok_or_else(|| short(0))?;
            // Deflate packs by at most 1 to 1032.
            let most = size.min(chunk.len().saturating_mul(1032));
            let mut grid = memory::room(most, "its grid").map_err(|error| error.to_string())?;
            let unpacked = ZlibDecoder::new(chunk).take(most as u64).read_to_end(&mut grid);
            unpacked.map_err(|error| format!("its grid cannot be unpacked: {error}"))?;
            if grid.len() < size { Err(short(grid.len())) } else { Ok((grid, "zip")) }
        }
        2 => {
            let mut grid = Vec::new();
            while grid.len() < size {
                let chunk = next().ok_or_else(|| short(grid.len()))?;
                // A chunk's header states its size. LZ4 packs by at most 1 to 255, and runs of
                // zeros, one per byte of the type, may raise that once more.
                let stated = chunk.get(4..8).and_then(|bytes| bytes.try_into().ok());
                let length = stated.map_or(0, u32::from_le_bytes) as usize;
                if length == 0 || length > size - grid.len() || length / 512 > chunk.len() {
                    return Err(format!(
                        "a blosc chunk of {} bytes claims to hold {length}",
                        chunk.len()
                    ));
                }
                let before = grid.len();
                memory::grow(&mut grid, length, "its grid").map_err(|error| error.to_string())?;
                grid.resize(before + length, 0);
                decompress_blosc(chunk, &mut grid[before..])?;
            }
            Ok((grid, "blosc"))
        }
        other => Err(format!("codec {other} is not one of 0 (none), 1 (zip), 2 (blosc)")),
    }
}
