//! Several bodies at once: extinctions add up, and the scattered light is the mean of the bodies'
//! weighted by extinction.

use std::cell::Cell;

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::density::{Density, four_densities, sample_density};
use super::media::Piece;
use super::ray::{Ray, intersect_box};
use super::table::{OpacityCell, OpacityTable, Readings, opacity_cells, table_mean};
use crate::frame::{Field, Mixture, Part};
use crate::math::Each;
use crate::scene::Media;

/// A mixture, prepared for sampling.
#[derive(Clone, Debug)]
pub struct MixedMedia<'a> {
    mixture: Mixture<'a>,
    grids: Vec<Density<'a>>,
    /// The opacities of the first body's transfer function; empty if it has none.
    opacities: Vec<OpacityCell>,
}

impl<'a> MixedMedia<'a> {
    /// The mixture of `media`'s bodies.
    pub fn of(media: &'a Media) -> Self {
        let mixture = Mixture::of(media);
        let grids = mixture.volumes.iter().map(|volume| Density::of(volume)).collect();
        let first = mixture.parts.first().map(|part| part.transfer);
        let first = first.filter(|transfer| transfer.y > 0.0);
        let opacities =
            first.map_or_else(Vec::new, |header| opacity_cells(&mixture.tables, header));
        Self { mixture, grids, opacities }
    }
}

/// The part of a piece that lies in a field: its two ends in the field's indices, and its share of
/// the piece's length, 0 if there is none.
#[inline]
fn inside(field: &Field, piece: &Piece<'_>) -> ([Vec3; 2], f32) {
    let ray = if field.voxel_share.w == 1.0 {
        *piece.ray
    } else {
        piece.ray.transformed(&field.index_from_media)
    };
    let (min, max) = (field.domain_min.truncate(), field.domain_max.truncate());
    let (from, to) = (piece.at - piece.half, piece.at + piece.half);
    let ends = [ray.at(from), ray.at(to)];
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    if low.cmpge(min).all() && high.cmple(max).all() {
        return (ends, 1.0);
    }
    if high.cmplt(min).any() || low.cmpgt(max).any() {
        return (ends, 0.0);
    }
    let (enter, exit) = intersect_box(&ray, min, max);
    let (enter, exit) = (enter.max(from), exit.min(to));
    if exit <= enter {
        return (ends, 0.0);
    }
    ([ray.at(enter), ray.at(exit)], (exit - enter) / (to - from))
}

/// The value of a field in the middle of a piece; 0 outside of the field.
fn field_value(media: &MixedMedia<'_>, field: usize, piece: &Piece<'_>) -> f32 {
    let (ends, share) = inside(&media.mixture.fields[field], piece);
    if share > 0.0 { middle(&media.grids[field], ends) } else { 0.0 }
}

#[inline]
fn middle(grid: &Density<'_>, [a, b]: [Vec3; 2]) -> f32 {
    sample_density(grid, 0.5 * (a + b))
}

/// Rounding may leave pieces that touch this far apart, as a share of their length.
const TOUCHING: f32 = 1e-3;
/// A body's part over a piece: (albedo times extinction, extinction), both means over the piece.
fn part_along(media: &MixedMedia<'_>, part: &Part, piece: &Piece<'_>) -> Vec4 {
    let [density, color, _, modulation] = part.fields.each(|field| field as usize);
    let (ends, share) = inside(&media.mixture.fields[density], piece);
    if share == 0.0 {
        return Vec4::ZERO;
    }
    let grid = &media.grids[density];
    let classified = if part.transfer.y > 0.0 {
        let values = ends.each(|end| sample_density(grid, end));
        table_mean(&media.mixture.tables, part.transfer, values)
    } else {
        Vec4::splat(middle(grid, ends))
    };
    if classified.w == 0.0 {
        return Vec4::ZERO;
    }
    let mut extinction = part.strength.x * share;
    if modulation > 0 {
        extinction *= field_value(media, modulation - 1, piece);
    }
    let mut albedo = part.albedo.truncate();
    if color > 0 {
        albedo *= Vec3::from_array([0, 1, 2].each(|c| field_value(media, color - 1 + c, piece)));
    }
    extinction * classified * albedo.extend(1.0)
}

/// Mean extinction of all bodies over a piece, 1 / world length.
pub fn mixture_density(media: &MixedMedia<'_>, piece: &Piece<'_>) -> f32 {
    media.mixture.parts.iter().map(|part| part_along(media, part, piece).w).sum()
}

/// A cache for one light ray through a single body with a transfer function: the table readings
/// where the last four pieces began and where they ended, for pieces that begin there.
#[derive(Clone, Copy, Debug, Default)]
pub struct Met([Option<(f32, Readings<f32>)>; 2]);

/// Mean extinctions over four pieces of a ray, one behind the other, like [`mixture_density`], but
/// for a mixture of one body with a transfer function and without modulation. The pieces must lie
/// in the body's domain.
#[inline]
pub fn four_classified(
    media: &MixedMedia<'_>,
    ray: &Ray,
    at: Vec4,
    half: Vec4,
    met: &Cell<Met>,
) -> Vec4 {
    let (part, grid) = (&media.mixture.parts[0], &media.grids[0]);
    let (begins, ends) = (at - half, at + half);
    let apart = (ends.xyz() - begins.yzw()).abs();
    let nearest = TOUCHING * half.max_element();
    if apart.max_element() > nearest {
        let pieces = [0, 1, 2, 3].each(|i| Piece { ray, at: at[i], half: half[i] });
        return Vec4::from_array(pieces.each(|piece| mixture_density(media, &piece)));
    }
    let table = OpacityTable { cells: &media.opacities, header: part.transfer };
    let known = met.get().0.into_iter().flatten().find(|(at, _)| (at - begins.x).abs() <= nearest);
    let begin =
        known.unwrap_or_else(|| (begins.x, table.one(sample_density(grid, ray.at(begins.x)))));
    let readings = table.four(four_densities(grid, ray, ends));
    met.set(Met([Some((ends.w, readings.last())), Some(begin)]));
    part.strength.x * table.means(&begin.1, &readings)
}

/// The mean of the bodies' albedo over a piece, weighted by extinction: first with each body's
/// factor `phase` (a function of its g), then without.
pub fn mixture_source(
    media: &MixedMedia<'_>,
    piece: &Piece<'_>,
    phase: impl Fn(f32) -> f32,
) -> (Vec3, Vec3) {
    let (mut scattered, mut albedo, mut extinction) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for part in &media.mixture.parts {
        let along = part_along(media, part, piece);
        scattered += along.truncate() * phase(part.albedo.w);
        albedo += along.truncate();
        extinction += along.w;
    }
    let all = f32::max(extinction, 1e-30);
    (scattered / all, albedo / all)
}

/// Radiance that a piece emits per world length.
pub fn mixture_emission(media: &MixedMedia<'_>, piece: &Piece<'_>) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for part in media.mixture.parts.iter().filter(|part| part.fields[2] > 0) {
        let field = part.fields[2] as usize - 1;
        let (ends, share) = inside(&media.mixture.fields[field], piece);
        if share > 0.0 {
            let values = ends.each(|end| sample_density(&media.grids[field], end));
            let mean = table_mean(&media.mixture.tables, part.emission, values);
            sum += mean.truncate() * (part.strength.y * share);
        }
    }
    sum
}
