//! Functions of a density, read from tables: linear between the values at the edges of cells, and
//! constant beyond the ends. Short pieces and long ones read the same function, so the results of
//! adjacent pieces add up.

use glam::{Mat4, Vec4, Vec4Swizzles};

use crate::frame::{FARTHEST_CELL, LEAST_CELLS, TABLE_CELLS};
use crate::math::Each;

/// Number of cells of a table. Each half, values and integrals, has one entry more.
const CELLS: usize = TABLE_CELLS as usize;

/// The cell that contains a place: -1 in front of the table, [`CELLS`] behind it.
#[inline]
fn cell_of(place: f32) -> f32 {
    place.floor().clamp(-1.0, CELLS as f32)
}

/// Position of a value in a table, in cells.
#[inline]
fn place_of(header: Vec4, value: f32) -> f32 {
    ((value - header.z) * header.w).clamp(-FARTHEST_CELL, FARTHEST_CELL)
}

/// Mean of a table's function between two values: (red, green, blue) times opacity, and opacity.
/// `header` is (first entry, flag, value at the first edge, cells per value).
#[inline]
pub fn table_mean(tables: &[Vec4], header: Vec4, values: [f32; 2]) -> Vec4 {
    let (entries, integrals) = tables[header.x as usize..][..2 * (CELLS + 1)].split_at(CELLS + 1);
    let [a, b] = values.each(|value| place_of(header, value));
    let [begin, end] = [a, b].each(cell_of);
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
        // The edge between the two cells.
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

/// A cell of a table of opacities: (integral up to the cell, opacity at its lower edge, half of the
/// rise over the cell, 0).
pub type OpacityCell = Vec4;

/// The cells of a table's opacities, beginning with the one in front of the table.
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

/// A table of opacities only.
#[derive(Clone, Copy, Debug)]
pub struct OpacityTable<'a> {
    /// The cells, as [`opacity_cells`] makes them.
    pub cells: &'a [OpacityCell],
    /// The header of the table that they are made from.
    pub header: Vec4,
}

/// Opacity and its integral at one density, or at four.
#[derive(Clone, Copy, Debug)]
pub struct Readings<T> {
    place: T,
    cell: T,
    opacity: T,
    integral: T,
}

impl Readings<Vec4> {
    /// The last of the four.
    pub fn last(&self) -> Readings<f32> {
        Readings {
            place: self.place.w,
            cell: self.cell.w,
            opacity: self.opacity.w,
            integral: self.integral.w,
        }
    }
}

impl OpacityTable<'_> {
    /// Reads the table at four densities.
    #[inline]
    pub fn four(&self, densities: Vec4) -> Readings<Vec4> {
        let farthest = Vec4::splat(FARTHEST_CELL);
        let place = ((densities - self.header.z) * self.header.w).clamp(-farthest, farthest);
        let cell = place.floor().clamp(Vec4::NEG_ONE, Vec4::splat(CELLS as f32));
        // Conversion to i32 is the fastest.
        let rows = cell.to_array().each(|cell| self.cells[(cell as i32 + 1) as usize].to_array());
        let columns = Mat4::from_cols_array_2d(&rows).transpose();
        let inside = place - cell.max(Vec4::ZERO);
        let half_rise = columns.z_axis * inside;
        let integral = columns.x_axis + inside * (columns.y_axis + half_rise);
        Readings { place, cell, opacity: columns.y_axis + 2.0 * half_rise, integral }
    }

    /// Reads the table at one density.
    #[inline]
    pub fn one(&self, density: f32) -> Readings<f32> {
        let place = place_of(self.header, density);
        let cell = cell_of(place);
        let [integral, opacity, half_rise, _] = self.cells[(cell as i32 + 1) as usize].to_array();
        let inside = place - cell.max(0.0);
        let half_rise = half_rise * inside;
        let integral = integral + inside * (opacity + half_rise);
        Readings { place, cell, opacity: opacity + 2.0 * half_rise, integral }
    }

    /// Mean opacities from a density to the first of four, and from each of the four to the next,
    /// like [`table_mean`].
    #[inline]
    pub fn means(&self, begin: &Readings<f32>, ends: &Readings<Vec4>) -> Vec4 {
        let from = |begin: f32, ends: Vec4| ends.wxyz().with_x(begin);
        let place = from(begin.place, ends.place);
        let integral = from(begin.integral, ends.integral);
        let across = ends.place - place;
        let near = across.abs().cmplt(Vec4::splat(LEAST_CELLS));
        let means = (ends.integral - integral) / Vec4::select(near, Vec4::ONE, across);
        if !near.any() {
            return means;
        }
        let (first, last) = (from(begin.opacity, ends.opacity), ends.opacity);
        let cell = from(begin.cell, ends.cell);
        let is_one = cell.cmpeq(ends.cell);
        if is_one.all() {
            return 0.5 * (first + last);
        }
        // The edge between two cells is where the later one begins.
        let edge = cell.max(ends.cell);
        let at_edge =
            Vec4::from_array(edge.to_array().each(|cell| self.cells[(cell as i32 + 1) as usize].y));
        let share = (ends.place - edge) / Vec4::select(is_one, Vec4::ONE, across);
        let apart = 0.5 * (at_edge + first + (last - first) * share);
        let short = Vec4::select(is_one, 0.5 * (first + last), apart);
        Vec4::select(near, short, means)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::{DMat4, DVec3};
    use ndarray::Array3;

    use super::*;
    use crate::frame::Mixture;
    use crate::scene::transfer::TransferPoint;
    use crate::scene::{Body, Media, Medium, TransferFunction};
    use crate::volume::Volume;

    /// A function with a jump up, a slope and a jump down, none of them at the edge of a cell, and
    /// its integral.
    fn band() -> (Vec<Vec4>, Vec4, f64) {
        let points =
            [(0.0, 0.0), (0.48, 0.0), (0.48, 1.0), (0.4843, 0.5), (0.4843, 0.0), (1.0, 0.0)];
        let points = points.map(|(value, opacity)| TransferPoint {
            value,
            color: DVec3::new(1.0, 0.5, 0.25),
            opacity,
        });
        let transfer = Some(Arc::new(TransferFunction::new(points.to_vec()).unwrap()));
        let volume = Volume::new("one", Array3::ones((2, 2, 2)), DMat4::IDENTITY).unwrap();
        let medium = Medium { transfer, ..Medium::default() };
        let media = Media::new(vec![Body { volume: Arc::new(volume), medium }]);
        let mixture = Mixture::of(&media);
        (mixture.tables.clone(), mixture.parts[0].transfer, 0.75 * 0.0043)
    }

    /// Values from 0 to 1 with steps of very different lengths.
    fn cuts(mut state: u64) -> Vec<f32> {
        let mut at = 0.0_f32;
        let mut cuts = vec![at];
        while at < 1.0 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let unit = (state >> 40) as f32 / (1 << 24) as f32;
            at = (at + 0.02 * unit.powi(6) + 1e-6).min(1.0);
            cuts.push(at);
        }
        cuts
    }

    #[test]
    fn pieces_of_any_length_add_up_to_the_functions_integral() {
        let (tables, header, truth) = band();
        for seed in 0..20 {
            let cuts = cuts(seed);
            for turn in [false, true] {
                let mut sum = [0.0_f64; 4];
                for ends in cuts.windows(2) {
                    let [a, b] = [ends[0], ends[1]];
                    let mean = table_mean(&tables, header, if turn { [b, a] } else { [a, b] });
                    for (sum, mean) in sum.iter_mut().zip(mean.to_array()) {
                        *sum += f64::from(mean) * f64::from(b - a);
                    }
                }
                // Positions around the band are rounded to 2^-15 of a cell, so each end of a piece
                // may be off by that much.
                let seen = cuts.windows(2).filter(|ends| ends[1] > 0.475 && ends[0] < 0.49).count();
                let bound = seen as f64 * 2.0 * 0.5_f64.powi(15) / 1024.0;
                for (sum, share) in sum.into_iter().zip([1.0, 0.5, 0.25, 1.0]) {
                    let error = (sum - share * truth).abs();
                    assert!(error < bound, "{seed}: {sum}, not {}", share * truth);
                }
            }
        }
    }

    #[test]
    fn four_opacities_are_those_of_the_table() {
        let (tables, header, _) = band();
        let cells = opacity_cells(&tables, header);
        let table = OpacityTable { cells: &cells, header };
        let values: Vec<f32> =
            cuts(7).into_iter().chain([-0.5, 0.3, 1.5, 2.0, 0.48, 0.4801]).collect();
        for five in values.windows(5) {
            let ends = table.four(Vec4::from_slice(&five[1..]));
            let means = table.means(&table.one(five[0]), &ends);
            for k in 0..4 {
                let one = table_mean(&tables, header, [five[k], five[k + 1]]).w;
                assert!((means[k] - one).abs() < 1e-4, "{five:?}: {}, not {one}", means[k]);
            }
            assert_eq!(ends.last().place, table.one(five[4]).place);
        }
    }
}
