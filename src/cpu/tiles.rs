//! Work on maps and pictures in tiles over all threads. Neighbours read the same voxels and texels;
//! a core's cache still holds them for the next row of a tile, but not for the next row of a
//! picture.

use std::ops::Range;

use crate::error::{ErrorKind, Result};
use crate::parallel;
use crate::progress::Progress;
use crate::shadow::Runs;

/// Texels or pixels along each edge of a tile.
pub(super) const TILE: usize = 16;

/// Checks, when a pass has ended, that it was not cancelled: its result is incomplete then.
///
/// # Errors
/// If it was.
pub(super) fn finished(progress: &dyn Progress) -> Result<()> {
    if progress.cancelled() { Err(ErrorKind::Cancelled.into()) } else { Ok(()) }
}

/// Columns of the tiles of a width.
pub(super) fn columns(width: usize) -> impl Iterator<Item = Range<usize>> {
    (0..width.div_ceil(TILE)).map(move |i| i * TILE..((i + 1) * TILE).min(width))
}

/// Fills rows of `width` cells with what `cell` says at (x, y), with scratch that the cells of a
/// tile share.
pub(super) fn fill<T: Copy + Send + Sync, S>(
    cells: &mut [T],
    width: usize,
    progress: &dyn Progress,
    scratch: impl Fn() -> S + Sync + Send,
    cell: impl Fn(&mut S, [usize; 2]) -> T + Sync,
) {
    parallel::for_each(cells.chunks_mut((width * TILE).max(1)).enumerate(), |(j, band)| {
        let rows = band.len() / width;
        let tiles: Vec<Vec<T>> = parallel::map(columns(width), |columns| {
            if progress.cancelled() {
                return Vec::new();
            }
            let mut scratch = scratch();
            let places = (0..rows).flat_map(|y| columns.clone().map(move |x| [x, j * TILE + y]));
            places.map(|place| cell(&mut scratch, place)).collect()
        });
        if progress.cancelled() {
            return;
        }
        for (i, tile) in tiles.into_iter().enumerate() {
            let columns = tile.len() / rows;
            for (row, from) in band.chunks_exact_mut(width).zip(tile.chunks_exact(columns)) {
                row[i * TILE..][..columns].copy_from_slice(from);
            }
        }
        progress.advance(rows as u64);
    });
}

/// Fills rows of `width` cells with what `tile` says of the cells in some columns and rows, row by
/// row.
pub(super) fn fill_tiles<T: Copy + Send + Sync>(
    cells: &mut [T],
    width: usize,
    progress: &dyn Progress,
    tile: impl Fn(Range<usize>, Range<usize>) -> Vec<T> + Sync,
) {
    parallel::for_each(cells.chunks_mut((width * TILE).max(1)).enumerate(), |(j, band)| {
        let rows = j * TILE..j * TILE + band.len() / width;
        for columns in columns(width) {
            if progress.cancelled() {
                return;
            }
            let found = tile(columns.clone(), rows.clone());
            for (row, from) in band.chunks_exact_mut(width).zip(found.chunks_exact(columns.len())) {
                row[columns.clone()].copy_from_slice(from);
            }
        }
        progress.advance(rows.len() as u64);
    });
}

/// The lists of a map of `size` squared texels, row after row; `lists` returns those of the columns
/// and rows of a tile, row by row.
pub(super) fn runs<T: Copy + Default + Send>(
    size: usize,
    progress: &dyn Progress,
    lists: impl Fn(Range<usize>, Range<usize>) -> Result<Vec<Runs<T>>> + Sync,
) -> Result<Runs<T>> {
    progress.begin("shadow map", size as u64);
    let bands = parallel::map(0..size.div_ceil(TILE), |j| -> Result<Runs<T>> {
        let rows = j * TILE..((j + 1) * TILE).min(size);
        let tiles = parallel::map(columns(size), |columns| {
            finished(progress)?;
            lists(columns, rows.clone())
        });
        let tiles = tiles.into_iter().collect::<Result<Vec<_>>>()?;
        let mut band = Runs::default();
        for y in 0..rows.len() {
            for tile in &tiles {
                band.append(&tile[y])?;
            }
        }
        progress.advance(rows.len() as u64);
        Ok(band)
    });
    let mut all = Runs::default();
    for band in bands {
        all.append(&band?)?;
    }
    Ok(all)
}
