//! Several bodies at once: extinctions add up, and what is scattered is their mean by extinction.

use glam::{Vec3, Vec4};

use super::density::{Density, sample_density};
use super::media::Piece;
use super::ray::{Ray, intersect_box};
use crate::frame::{Field, LEAST_CELLS, Mixture, Part, TABLE_CELLS};
use crate::scene::Media;

/// A mixture ready to be sampled.
#[derive(Clone, Debug)]
pub struct MixedMedia<'a> {
    mixture: Mixture<'a>,
    grids: Vec<Density<'a>>,
}

impl<'a> MixedMedia<'a> {
    /// The mixture of `media`'s bodies.
    pub fn of(media: &'a Media) -> Self {
        let mixture = Mixture::of(media);
        let grids = mixture.volumes.iter().map(|volume| Density::of(volume)).collect();
        Self { mixture, grids }
    }

    /// Whether a body emits light.
    pub fn emits(&self) -> bool {
        self.mixture.parts.iter().any(|part| part.fields[2] > 0)
    }
}

/// The part of a piece that lies in a field, and the ray in the field's index space; empty if the second
/// distance is not greater.
fn inside(field: &Field, piece: &Piece<'_>) -> (Ray, [f32; 2]) {
    let ray = piece.ray.transformed(&field.index_from_media);
    let (min, max) = (field.domain_min.truncate(), field.domain_max.truncate());
    let (enter, exit) = intersect_box(&ray, min, max);
    (ray, [enter.max(piece.at - piece.half), exit.min(piece.at + piece.half)])
}

/// A field's number in the middle of a piece, 0 outside of it.
fn field_value(media: &MixedMedia<'_>, field: usize, piece: &Piece<'_>) -> f32 {
    let grid = &media.mixture.fields[field];
    let (ray, [from, to]) = inside(grid, piece);
    if to <= from { 0.0 } else { sample_density(&media.grids[field], ray.at((from + to) * 0.5)) }
}

/// Integral of a table up to a place in it, in cells.
fn integral_to(table: &[Vec4], place: f32) -> Vec4 {
    let cells = TABLE_CELLS as f32;
    let held = place.clamp(0.0, cells);
    let cell = (held as usize).min(TABLE_CELLS as usize - 1);
    let (a, b) = (table[2 + cell], table[3 + cell]);
    a + (b - a) * (held - cell as f32)
        + table[0] * place.min(0.0)
        + table[1] * (place - cells).max(0.0)
}

/// Mean of a table's function between two values: (red, green, blue) times opacity, and opacity.
fn table_mean(tables: &[Vec4], header: Vec4, [a, b]: [f32; 2]) -> Vec4 {
    let table = &tables[header.x as usize..];
    let (a, b) = ((a - header.z) * header.w, (b - header.z) * header.w);
    let spread = (0.5 * (LEAST_CELLS - (b - a).abs())).max(0.0);
    let (low, high) = (a.min(b) - spread, a.max(b) + spread);
    (integral_to(table, high) - integral_to(table, low)) / (high - low)
}

/// What a body does over a piece: (albedo times extinction, extinction), means over the piece.
fn part_along(media: &MixedMedia<'_>, part: &Part, piece: &Piece<'_>) -> Vec4 {
    let [density, color, _, modulation] = part.fields.map(|field| field as usize);
    let (ray, [from, to]) = inside(&media.mixture.fields[density], piece);
    if to <= from {
        return Vec4::ZERO;
    }
    let share = (to - from) / (2.0 * piece.half);
    let sample = |t: f32| sample_density(&media.grids[density], ray.at(t));
    let classified = if part.transfer.y > 0.0 {
        table_mean(&media.mixture.tables, part.transfer, [sample(from), sample(to)])
    } else {
        Vec4::splat(sample((from + to) * 0.5))
    };
    let mut extinction = part.strength.x * share;
    if modulation > 0 {
        extinction *= field_value(media, modulation - 1, piece);
    }
    let mut albedo = part.albedo.truncate();
    if color > 0 {
        albedo *= Vec3::from_array([0, 1, 2].map(|c| field_value(media, color - 1 + c, piece)));
    }
    extinction * classified * albedo.extend(1.0)
}

/// Mean extinction over a piece, 1 / world length.
pub fn mixture_density(media: &MixedMedia<'_>, piece: &Piece<'_>) -> f32 {
    media.mixture.parts.iter().map(|part| part_along(media, part, piece).w).sum()
}

/// What a piece scatters per unit of opacity: with `phase` of each body's g, and without.
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

/// Radiance per world length that a piece emits.
pub fn mixture_emission(media: &MixedMedia<'_>, piece: &Piece<'_>) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for part in media.mixture.parts.iter().filter(|part| part.fields[2] > 0) {
        let field = part.fields[2] as usize - 1;
        let (ray, [from, to]) = inside(&media.mixture.fields[field], piece);
        if to > from {
            let sample = |t: f32| sample_density(&media.grids[field], ray.at(t));
            let ends = [sample(from), sample(to)];
            let mean = table_mean(&media.mixture.tables, part.emission, ends);
            sum += mean.truncate() * (part.strength.y * (to - from) / (2.0 * piece.half));
        }
    }
    sum
}
