//! Media that are more than one density times a constant, converted to f32 in the layout that
//! shaders read (`shaders/media/mixture.wgsl`).
//!
//! Colour and opacity over density become a table of integrals, so that a step through densities a
//! to b takes their mean over all densities between (Engel, Kraus and Ertl 2001, in the
//! approximation that neglects attenuation inside a step). Thin bands of a transfer function are
//! never skipped.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec4};

pub use crate::scene::transfer::TABLE_CELLS;
use crate::scene::{Body, Emission, Media, TransferFunction};
use crate::volume::Volume;

/// The largest number of grids that shaders support.
pub const MOST_FIELDS: usize = 8;
/// The largest number of bodies that shaders support.
pub const MOST_PARTS: usize = 8;
/// If two densities are closer than this number of cells, a function's mean is computed from its
/// values, since the difference of two nearly equal integrals would have no digits left.
pub const LEAST_CELLS: f32 = 1.0;
/// Positions are clamped to this many cells beyond a table's ends, where the function is constant.
pub const FARTHEST_CELL: f32 = 16_777_216.0;

/// A grid of numbers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Field {
    /// Rows of the affine transform from the media's index space to the grid's.
    pub index_from_media: [Vec4; 3],
    /// xyz: lower corner of the grid's domain in its index space; w: the number for which a stored
    /// value of 1 stands.
    pub domain_min: Vec4,
    /// xyz: upper corner of that domain; w: unused.
    pub domain_max: Vec4,
    /// xyz: one over the number of voxels along each axis; w: 1 if the grid's index space is the
    /// media's own.
    pub voxel_share: Vec4,
}

/// A body.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Part {
    /// xyz: scattering albedo; w: Henyey-Greenstein g.
    pub albedo: Vec4,
    /// x: extinction where density (with a transfer function: opacity) is 1; y: radiance per world
    /// length where colour and opacity of the emission are 1; zw unused.
    pub strength: Vec4,
    /// The transfer function's table: x: its first entry; y: 1 if there is a function, else 0; z:
    /// density where the table begins; w: cells per unit of density.
    pub transfer: Vec4,
    /// The emission's table in the same layout, over the values of its field.
    pub emission: Vec4,
    /// Indices of fields. x: density; y: the first of three for colour, z: emission, w: modulation;
    /// y, z and w are one more than the index, 0 for none.
    pub fields: [u32; 4],
}

/// Everything that passes need to know about media that are not plain.
#[derive(Clone, Debug, Default)]
pub struct Mixture<'a> {
    /// The bodies.
    pub parts: Vec<Part>,
    /// The grids that the bodies use.
    pub fields: Vec<Field>,
    /// The volumes of `fields`, in the same order.
    pub volumes: Vec<&'a Volume>,
    /// The tables of all functions, one after another: (red, green, blue) times opacity, and
    /// opacity. Each has [`TABLE_CELLS`] + 1 values at the edges of cells, then as many integrals
    /// up to there, in units of cells.
    pub tables: Vec<Vec4>,
    /// World length of the unit in which extinction and emission are given ([`Media::unit`]).
    unit: f64,
}

impl<'a> Mixture<'a> {
    /// The mixture of all of `media`'s bodies.
    pub fn of(media: &'a Media) -> Self {
        let mut mixture = Self { unit: media.unit(), ..Self::default() };
        for body in media.bodies() {
            mixture.add(body, media.world_from_index());
        }
        mixture
    }

    fn add(&mut self, Body { volume, medium }: &'a Body, world_from_media: &DMat4) {
        let density = self.field(volume, world_from_media);
        let color = match &medium.color {
            Some(channels) => {
                let [red, _, _] = [0, 1, 2].map(|c| self.field(&channels[c], world_from_media));
                red + 1
            }
            None => 0,
        };
        let modulation = match &medium.modulation {
            Some(volume) => self.field(volume, world_from_media) + 1,
            None => 0,
        };
        let transfer = match &medium.transfer {
            Some(function) => self.table(function),
            None => Vec4::ZERO,
        };
        let (emission, field, scale) = match &medium.emission {
            Some(Emission { field, ramp, scale }) => {
                let field = match field {
                    Some(volume) => self.field(volume, world_from_media),
                    None => density,
                };
                (self.table(ramp), field + 1, (*scale * self.unit) as f32)
            }
            None => (Vec4::ZERO, 0, 0.0),
        };
        self.parts.push(Part {
            albedo: medium.albedo.as_vec3().extend(medium.phase_g as f32),
            strength: Vec4::new((medium.density_scale * self.unit) as f32, scale, 0.0, 0.0),
            transfer,
            emission,
            fields: [density, color, field, modulation],
        });
    }

    fn field(&mut self, volume: &'a Volume, world_from_media: &DMat4) -> u32 {
        let index_from_media = volume.world_from_index().inverse() * *world_from_media;
        self.fields.push(Field {
            index_from_media: [0, 1, 2].map(|i| index_from_media.row(i).as_vec4()),
            domain_min: volume.domain().min.as_vec3().extend(1.0),
            domain_max: volume.domain().max.as_vec3().extend(0.0),
            voxel_share: DVec3::from_array(volume.dims().map(|n| 1.0 / n as f64))
                .as_vec3()
                .extend(f32::from(volume.world_from_index() == world_from_media)),
        });
        self.volumes.push(volume);
        self.fields.len() as u32 - 1
    }

    fn table(&mut self, function: &TransferFunction) -> Vec4 {
        let [low, high] = function.range();
        let cell = (high - low).max(1e-30) / f64::from(TABLE_CELLS);
        let first = self.tables.len();
        let edge = |i: u32| low + f64::from(i) * cell;
        // Each value is the function's mean under a hat that falls to zero at the neighbouring
        // edges; so linear interpolation preserves the function's integral, wherever it jumps.
        let weighted = |value: f64| -> DVec4 {
            let (color, opacity) = function.at(value);
            (color * opacity).extend(opacity)
        };
        let inner = (1..TABLE_CELLS).map(|i| {
            let [before, here, after] = [edge(i - 1), edge(i), edge(i + 1)];
            mean(function, [before, here], [0.0, 1.0]) + mean(function, [here, after], [1.0, 0.0])
        });
        let values: Vec<DVec4> =
            [weighted(low)].into_iter().chain(inner).chain([weighted(high)]).collect();
        self.tables.extend(values.iter().map(|value| value.as_vec4()));
        let mut integral = DVec4::ZERO;
        self.tables.push(Vec4::ZERO);
        for ends in values.windows(2) {
            integral += 0.5 * (ends[0] + ends[1]);
            self.tables.push(integral.as_vec4());
        }
        Vec4::new(first as f32, 1.0, low as f32, (1.0 / cell) as f32)
    }
}

/// The mean of colour times opacity, and of opacity, between two values, weighted by a linear
/// function with the given values at both ends. All three factors are linear between points, so
/// Simpson's rule is exact.
fn mean(function: &TransferFunction, [from, to]: [f64; 2], weights: [f64; 2]) -> DVec4 {
    let points = function.points();
    let begin = points.partition_point(|point| point.value <= from);
    let inner = points[begin..].iter().map(|point| point.value).take_while(|&value| value < to);
    let weight = |at: f64| weights[0] + (weights[1] - weights[0]) * (at - from) / (to - from);
    let mut sum = DVec4::ZERO;
    let mut at = from;
    for next in inner.chain([to]) {
        if next > at {
            sum += (next - at) * simpson(function, [at, next], [weight(at), weight(next)]);
            at = next;
        }
    }
    sum / (to - from)
}

fn simpson(function: &TransferFunction, [from, to]: [f64; 2], weights: [f64; 2]) -> DVec4 {
    // Evaluated inside the piece, so that a jump at an end is not read from its other side.
    let inside = |share: f64| {
        let (color, opacity) = function.at(from + share * (to - from));
        color.extend(opacity)
    };
    let (a, b) = (inside(0.25), inside(0.75));
    let (begin, middle, end) = (a * 1.5 - b * 0.5, (a + b) * 0.5, b * 1.5 - a * 0.5);
    let weigh = |v: DVec4, weight: f64| (v.truncate() * v.w).extend(v.w) * weight;
    let half = 0.5 * (weights[0] + weights[1]);
    (weigh(begin, weights[0]) + 4.0 * weigh(middle, half) + weigh(end, weights[1])) / 6.0
}
