//! Functions of a density, read from tables: lines between values at the edges of cells, and beyond the ends as
//! they are there. Long pieces and short ones read one function, so that what touches adds up.

use glam::{Mat4, Vec4};

use crate::frame::{FARTHEST_CELL, LEAST_CELLS, TABLE_CELLS};

/// Cells of a table and entries of one of its halves.
const CELLS: usize = TABLE_CELLS as usize;

/// The cell of a place: -1 in front of the table, [`CELLS`] behind it.
#[inline]
fn cell_of(place: f32) -> f32 {
    place.floor().clamp(-1.0, CELLS as f32)
}

/// Where a value lies in a table, in cells.
#[inline]
fn place_of(header: Vec4, value: f32) -> f32 {
    ((value - header.z) * header.w).clamp(-FARTHEST_CELL, FARTHEST_CELL)
}

/// Mean of a table's function between two values: (red, green, blue) times opacity, and opacity.
#[inline]
pub fn table_mean(tables: &[Vec4], header: Vec4, values: [f32; 2]) -> Vec4 {
    let (entries, integrals) = tables[header.x as usize..][..2 * (CELLS + 1)].split_at(CELLS + 1);
    let [a, b] = values.map(|value| place_of(header, value));
    let [begin, end] = [a, b].map(cell_of);
    let line = |cell: f32, place: f32| {
        let first = cell.max(0.0);
        let at = first as usize;
        let value = entries[at];
        let next = entries[((cell + 1.0) as usize).min(CELLS)];
        (at, value, (next - value) * (place - first), place - first)
    };
    let across = b - a;
    if across.abs() < LEAST_CELLS {
        let value = |cell: f32, place: f32| {
            let (_, value, rise, _) = line(cell, place);
            value + rise
        };
        let [from, to] = [value(begin, a), value(end, b)];
        if begin == end {
            return 0.5 * (from + to);
        }
        // The edge between their cells.
        let edge = begin.max(end);
        let middle = entries[edge as usize];
        return 0.5 * (middle + from + (to - from) * ((b - edge) / across));
    }
    let integral = |cell: f32, place: f32| {
        let (at, value, rise, inside) = line(cell, place);
        integrals[at] + (value + 0.5 * rise) * inside
    };
    (integral(end, b) - integral(begin, a)) / across
}

/// A cell of a table of opacities alone: (integral up to it, opacity at its edge, half of what it rises by, 0).
pub type OpacityCell = Vec4;

/// The cells of a table's opacities, the one in front of the table first.
pub fn opacity_cells(tables: &[Vec4], header: Vec4) -> Vec<OpacityCell> {
    let (entries, integrals) = tables[header.x as usize..][..2 * (CELLS + 1)].split_at(CELLS + 1);
    let inner = entries.windows(2).zip(integrals);
    let inner = inner.map(|(ends, integral)| {
        Vec4::new(integral.w, ends[0].w, 0.5 * (ends[1].w - ends[0].w), 0.0)
    });
    let before = Vec4::new(0.0, entries[0].w, 0.0, 0.0);
    let behind = Vec4::new(integrals[CELLS].w, entries[CELLS].w, 0.0, 0.0);
    [before].into_iter().chain(inner).chain([behind]).collect()
}

/// A table of opacities alone.
#[derive(Clone, Copy, Debug)]
pub struct OpacityTable<'a> {
    /// As [`opacity_cells`] makes them.
    pub cells: &'a [OpacityCell],
    /// The table's.
    pub header: Vec4,
}

impl OpacityTable<'_> {
    /// Means of the opacities between four pairs of values, as [`table_mean`].
    #[inline]
    pub fn four_means(&self, values: [Vec4; 2]) -> Vec4 {
        let farthest = Vec4::splat(FARTHEST_CELL);
        let [a, b] = values
            .map(|values| ((values - self.header.z) * self.header.w).clamp(-farthest, farthest));
        let [begins, ends] =
            [a, b].map(|places| places.floor().clamp(Vec4::NEG_ONE, Vec4::splat(CELLS as f32)));
        // Rows of (integral, value, half of the rise), one for each place; then columns.
        let columns = |cells: Vec4| {
            // Conversion to i32 is the fastest.
            let rows = cells.to_array().map(|cell| self.cells[(cell as i32 + 1) as usize]);
            Mat4::from_cols_array_2d(&rows.map(|row| row.to_array())).transpose()
        };
        let lines = |cells: Vec4, places: Vec4| (columns(cells), places - cells.max(Vec4::ZERO));
        let ((from, before), (to, behind)) = (lines(begins, a), lines(ends, b));
        let across = b - a;
        let near = across.abs().cmplt(Vec4::splat(LEAST_CELLS));
        let integral = |m: &Mat4, inside: Vec4| m.x_axis + inside * (m.y_axis + m.z_axis * inside);
        let rise = integral(&to, behind) - integral(&from, before);
        let means = rise / Vec4::select(near, Vec4::ONE, across);
        if !near.any() {
            return means;
        }
        let value = |m: &Mat4, inside: Vec4| m.y_axis + 2.0 * m.z_axis * inside;
        let [first, last] = [value(&from, before), value(&to, behind)];
        let edges = begins.max(ends);
        let is_one = begins.cmpeq(ends);
        // The value at the edge between two cells is the later one's.
        let middle = Vec4::select(ends.cmpgt(begins), to.y_axis, from.y_axis);
        let share = (b - edges) / Vec4::select(is_one, Vec4::ONE, across);
        let apart = 0.5 * (middle + first + (last - first) * share);
        let short = Vec4::select(is_one, 0.5 * (first + last), apart);
        Vec4::select(near, short, means)
    }
}
