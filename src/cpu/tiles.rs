//! Work on maps and pictures in tiles over all threads. Neighbours read the same voxels and texels;
//! a core's cache still holds them for the next row of a tile, but not for the next row of a
//! picture.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::progress::Progress;
use crate::shadow::Runs;

/// Texels or pixels along each edge of a tile.
const TILE: usize = 16;

/// The columns of each tile, for a given width.
fn columns(width: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    let tiles = (0..width.div_ceil(TILE)).into_par_iter();
    tiles.map(move |i| i * TILE..((i + 1) * TILE).min(width))
}

/// Fills rows of `width` cells with the values of `cell` at (x, y). Cells that are computed one
/// after another share scratch memory.
pub(super) fn fill<T: Copy + Send + Sync, S>(
    cells: &mut [T],
    width: usize,
    progress: &dyn Progress,
    scratch: impl Fn() -> S + Sync + Send,
    cell: impl Fn(&mut S, [usize; 2]) -> T + Sync,
) {
    cells.par_chunks_mut((width * TILE).max(1)).enumerate().for_each(|(j, band)| {
        let rows = band.len() / width;
        let tile = |scratch: &mut S, columns: Range<usize>| -> Vec<T> {
            let places = (0..rows).flat_map(|y| columns.clone().map(move |x| [x, j * TILE + y]));
            places.map(|place| cell(scratch, place)).collect()
        };
        let tiles: Vec<Vec<T>> = columns(width).map_init(&scratch, tile).collect();
        for (i, tile) in tiles.into_iter().enumerate() {
            let columns = tile.len() / rows;
            for (row, from) in band.chunks_exact_mut(width).zip(tile.chunks_exact(columns)) {
                row[i * TILE..][..columns].copy_from_slice(from);
            }
        }
        progress.advance(rows as u64);
    });
}

/// The lists of a map of `size` squared texels, row after row; `lists` returns those of some
/// columns of a row.
pub(super) fn runs<T: Copy + Default + Send>(
    size: usize,
    progress: &dyn Progress,
    lists: impl Fn(Range<usize>, usize) -> Result<Runs<T>> + Sync,
) -> Result<Runs<T>> {
    progress.begin("shadow map", size as u64);
    let bands = (0..size.div_ceil(TILE)).into_par_iter().map(|j| {
        let rows = j * TILE..((j + 1) * TILE).min(size);
        let tiles: Result<Vec<Vec<Runs<T>>>> = columns(size)
            .map(|columns| rows.clone().map(|y| lists(columns.clone(), y)).collect())
            .collect();
        let tiles = tiles?;
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
    for band in bands.collect::<Vec<Result<Runs<T>>>>() {
        all.append(&band?)?;
    }
    Ok(all)
}
