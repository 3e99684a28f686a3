//! Outlines in a map or a picture: which tiles and texels they touch, and lists of what lies in each.

use std::ops::Range;

use glam::Vec2;

use super::tiles::TILE;
use crate::error::{ErrorKind, Result};
use crate::math::Each;
use crate::parallel;

/// Number of surfaces' parts that are prepared together.
const CHUNK: usize = 1024;

/// Most bytes of the fragments of a tile, of which each thread works on one, and of the tiles' lists.
const MOST_BYTES: f64 = (1_u64 << 29) as f64;

/// Lists of texels or tiles.
#[derive(Debug)]
pub(super) struct Lists<T> {
    /// The index of each list's first item, and the number of items at the end.
    pub(super) starts: Vec<u32>,
    pub(super) items: Vec<T>,
}

impl<T: Copy + Default> Lists<T> {
    /// The items of (list, item) pairs, each list's in the order of the pairs.
    pub(super) fn sorted<'a>(
        count: usize,
        pairs: impl Iterator<Item = &'a (u32, T)> + Clone,
    ) -> Self
    where
        T: 'a,
    {
        let mut starts = vec![0_u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[*list as usize + 1] += 1;
        }
        for list in 0..count {
            starts[list + 1] += starts[list];
        }
        let mut next = starts.clone();
        let mut items = vec![T::default(); starts[count] as usize];
        for (list, item) in pairs {
            let place = &mut next[*list as usize];
            items[*place as usize] = *item;
            *place += 1;
        }
        Self { starts, items }
    }

    /// The items of a list.
    pub(super) fn of(&self, list: usize) -> &[T] {
        &self.items[self.starts[list] as usize..self.starts[list + 1] as usize]
    }
}

/// Checks a number of bytes against the most that are taken.
pub(super) fn check(bytes: f64, what: &str) -> Result<()> {
    if bytes <= MOST_BYTES {
        return Ok(());
    }
    let (needed, limit) = (format!("{bytes:.0} bytes"), format!("{MOST_BYTES:.0} bytes"));
    Err(ErrorKind::Limit { what: what.to_owned(), needed, limit }.into())
}

/// The number of square cells, with edges of `edge` texels, that a convex outline touches, on
/// average over its places: the area of the outline grown by a cell.
pub(super) fn touched_cells(outline: &[Vec2; 4], edge: f32) -> f64 {
    let [a, b, c, d] = outline.each(|corner| corner / edge);
    let area = 0.5 * (c - a).perp_dot(d - b).abs();
    let spans = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
    f64::from(area + spans.x + spans.y + 1.0)
}

/// What `one` makes of items, on all threads, in their order.
pub(super) fn flat<T: Sync, U: Send>(items: &[T], one: impl Fn(&T) -> Option<U> + Sync) -> Vec<U> {
    let chunks = parallel::map(items.chunks(CHUNK), |chunk| -> Vec<U> {
        chunk.iter().filter_map(&one).collect()
    });
    chunks.into_iter().flatten().collect()
}

/// The columns or rows among `all` that lie between places of these coordinates, in texels.
pub(super) fn texels(places: impl Iterator<Item = f32>, all: &Range<usize>) -> Range<usize> {
    let (low, high) =
        places.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    // Conversions cut off the fraction and saturate, and NaN is 0.
    let begin = (low as usize).max(all.start);
    let end = (high as usize).saturating_add(usize::from(high >= 0.0)).min(all.end);
    begin.min(end)..end
}

/// The range of u of an outline between the rows' borders `y` and `y + 1`, in texels.
pub(super) fn row_extent(outline: &[Vec2], y: f32) -> Option<[f32; 2]> {
    let mut extent: Option<[f32; 2]> = None;
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let (top, bottom) = if a.y < b.y { (a, b) } else { (b, a) };
        if bottom.y < y || top.y > y + 1.0 {
            continue;
        }
        let rise = bottom.y - top.y;
        for at in [y, y + 1.0] {
            let at = at.clamp(top.y, bottom.y);
            let share = if rise > 0.0 { (at - top.y) / rise } else { 0.0 };
            let x = top.x + (bottom.x - top.x) * share;
            let [low, high] = extent.unwrap_or([x; 2]);
            extent = Some([low.min(x), high.max(x)]);
        }
        if rise <= 0.0 {
            let [low, high] = extent.unwrap_or([bottom.x; 2]);
            extent = Some([low.min(bottom.x), high.max(bottom.x)]);
        }
    }
    extent
}

/// For each tile of a map of `size` squared texels, the indices of the items whose outlines touch it.
///
/// # Errors
/// If their lists would take too much memory.
pub(super) fn bins<T: Sync>(
    items: &[T],
    size: usize,
    outline: impl Fn(&T) -> [Vec2; 4] + Sync,
) -> Result<Lists<u32>> {
    let across = size.div_ceil(TILE);
    let all = (across * across) as f64;
    let pairs = items.iter().map(|one| touched_cells(&outline(one), TILE as f32).min(all));
    check(pairs.sum::<f64>() * size_of::<(u32, u32)>() as f64, "wide hair or large triangles")?;
    let touched = |item: &T| -> Vec<u32> {
        let tiles = outline(item).each(|corner| corner / TILE as f32);
        let rows = texels(tiles.iter().map(|corner| corner.y), &(0..across));
        let of_row = |y: usize| {
            let extent = row_extent(&tiles, y as f32);
            let columns = extent.map(|ends| texels(ends.into_iter(), &(0..across)));
            columns.unwrap_or(0..0).map(move |x| (y * across + x) as u32)
        };
        rows.flat_map(of_row).collect()
    };
    let chunks = parallel::map(items.chunks(CHUNK).enumerate(), |(chunk, items)| {
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(2 * items.len());
        for (i, item) in items.iter().enumerate() {
            let index = (chunk * CHUNK + i) as u32;
            pairs.extend(touched(item).into_iter().map(|tile| (tile, index)));
        }
        pairs
    });
    Ok(Lists::sorted(across * across, chunks.iter().flatten()))
}
