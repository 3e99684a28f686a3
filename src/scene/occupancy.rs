//! Which bricks of the media are empty, and how fast the others change: the basis of empty-space
//! skipping and of longer steps through slowly varying media.

use glam::{DMat4, DVec3};
use ndarray::{Array3, Axis};

use super::transfer::TABLE_CELLS;
use super::{Body, Media, TransferFunction};
use crate::math::Aabb;
use crate::volume::{Range, Volume, brick_edge};

/// The smallest code of empty bricks; the distance to the next occupied brick is the code minus
/// this, plus one.
pub const EMPTY: u8 = 192;
/// The code of the bricks that change most, and of all occupied bricks where the change is not
/// known.
pub const ROUGHEST: u8 = 8;
/// A brick's code also accounts for the bricks within this distance, since steps that begin in one
/// brick may end in another.
const REACH: usize = 2;

/// A grid of bricks over the media's index space, with one code per brick.
///
/// An empty brick's code is the Chebyshev distance, in bricks, to the nearest occupied brick. If it
/// is d, the d - 1 bricks around in every direction are empty too, and a ray may jump to where it
/// leaves that block (Deakin and Knoll 2019, "Accelerated volume rendering with Chebyshev distance
/// maps").
///
/// An occupied brick's code is the length of steps there, in eighths of that where the media change
/// most. The error of a step is proportional to the slope of extinction and to the square of the
/// step's length, so lengths go with one over the square root of the slope.
#[derive(Clone, Debug, PartialEq)]
pub struct Occupancy {
    origin: DVec3,
    edge: f64,
    dims: [usize; 3],
    codes: Vec<u8>,
    roughness: f64,
}

impl Occupancy {
    /// The bricks of all of `media`'s bodies.
    pub(super) fn of(media: &Media) -> Self {
        let domain = media.domain();
        // For a single body the bricks are the volume's own; if its emission extends beyond its
        // densities, further bricks surround them.
        let (graded, only) = (media.graded(), media.only_volume().is_some());
        let edge = brick_edge(domain.size());
        // Bricks that do not begin at the domain's corner may be one more along an axis.
        let edge = if only { edge } else { brick_edge(domain.size() + edge) };
        let first = DVec3::splat(-0.5);
        let origin = match graded {
            _ if only => first,
            Some(_) => first - ((first - domain.min) / edge).ceil().max(DVec3::ZERO) * edge,
            None => domain.min,
        };
        let dims = ((domain.max - origin) / edge).ceil().max(DVec3::ONE);
        let dims = dims.to_array().map(|n| n as usize);
        let mut occupancy = Self {
            origin,
            edge,
            dims,
            codes: vec![u8::MAX; dims.iter().product()],
            roughness: 0.0,
        };
        let index_from_world = media.world_from_index().inverse();
        let index_from_world = (!only).then_some(&index_from_world);
        if let Some(body) = graded {
            occupancy.grade(body);
            occupancy.add_emission(body, index_from_world);
        } else {
            for body in media.bodies() {
                occupancy.add_body(body, index_from_world);
            }
        }
        occupancy.spread();
        occupancy
    }

    /// Lower corner of the first brick, in index space.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Voxels along each edge of a brick.
    pub fn edge(&self) -> f64 {
        self.edge
    }

    /// Bricks along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// One code per brick, x fastest; [`EMPTY`] and [`ROUGHEST`] explain them.
    pub fn codes(&self) -> &[u8] {
        &self.codes
    }

    /// The largest change of density, or of opacity, over a voxel; 0 for several bodies and for
    /// modulated extinction, where it is not known.
    pub(super) fn roughness(&self) -> f64 {
        self.roughness
    }

    /// Sets the codes from the only body, whose bricks are these or parts of them, and the largest
    /// change of its density, or of its opacity.
    fn grade(&mut self, body: &Body) {
        let bricks = body.volume.bricks();
        let ranges = bricks.ranges();
        let function = body.medium.transfer.as_deref();
        // The largest slope of all bricks within reach, axis by axis.
        let mut changes = ranges.mapv(|range| match function {
            Some(function) => opacity_change(function, range),
            None => range.slope,
        });
        for axis in (0..3).map(Axis) {
            widen(&mut changes, axis);
        }
        let largest = changes.iter().copied().fold(0.0, f32::max);
        self.roughness = f64::from(largest);
        let ahead = ((-0.5 - self.origin) / self.edge).round().to_array().map(|n| n as usize);
        let ratio = (self.edge / bricks.edge() as f64) as usize;
        // Where the voxels are tiny compared with a brick, rounding may move them into the next
        // one.
        let last = self.dims.map(|n| n - 1);
        let [nx, ny, _] = self.dims;
        for (((z, y, x), &range), &change) in ranges.indexed_iter().zip(&changes) {
            if function.map_or(range.high > 0.0, |function| shows(function, range)) {
                let longer = f32::from(ROUGHEST) * (largest / change.max(f32::MIN_POSITIVE)).sqrt();
                let [x, y, z] =
                    [0, 1, 2].map(|axis| (ahead[axis] + [x, y, z][axis] / ratio).min(last[axis]));
                let code = &mut self.codes[(z * ny + y) * nx + x];
                let longest = longer.clamp(f32::from(ROUGHEST), f32::from(EMPTY - 1)) as u8;
                *code = longest.min(*code);
            }
        }
    }

    fn add_body(&mut self, body: &Body, index_from_world: Option<&DMat4>) {
        let extinguishes = |range: Range| match &body.medium.transfer {
            Some(function) => shows(function, range),
            None => range.high > 0.0,
        };
        self.add_volume(&body.volume, index_from_world, extinguishes);
        self.add_emission(body, index_from_world);
    }

    /// Marks bricks that emit light, unless they are marked already.
    fn add_emission(&mut self, body: &Body, index_from_world: Option<&DMat4>) {
        let Some(emission) = &body.medium.emission else { return };
        let occupied = |range| shows(&emission.ramp, range);
        match &emission.field {
            None => self.add_volume(&body.volume, index_from_world, occupied),
            Some(field) => {
                // The emission's grid need not lie where the densities do.
                let index_from_world = match index_from_world {
                    Some(known) => *known,
                    None => body.volume.world_from_index().inverse(),
                };
                self.add_volume(field, Some(&index_from_world), occupied);
            }
        }
    }

    /// Marks the bricks in which `volume` holds a range of densities that is `occupied`. Without a
    /// transform the volume's bricks are these bricks.
    fn add_volume(
        &mut self,
        volume: &Volume,
        index_from_world: Option<&DMat4>,
        occupied: impl Fn(Range) -> bool,
    ) {
        let bricks = volume.bricks();
        let change = index_from_world.map(|transform| *transform * *volume.world_from_index());
        let edge = bricks.edge() as f64;
        for ((z, y, x), &range) in bricks.ranges().indexed_iter() {
            if !occupied(range) {
                continue;
            }
            let min = DVec3::new(x as f64, y as f64, z as f64) * edge - 0.5;
            let own = Aabb { min, max: min + edge };
            // Slightly enlarged, so that rounding loses no brick.
            let around = match &change {
                Some(change) => {
                    let around = own.transformed(change);
                    Aabb { min: around.min - 1e-3, max: around.max + 1e-3 }
                }
                None => Aabb { min: own.min + 1e-3, max: own.max - 1e-3 },
            };
            self.mark(&around);
        }
    }

    fn mark(&mut self, around: &Aabb) {
        let last = self.dims.map(|n| n as f64 - 1.0);
        let brick = |p: DVec3| ((p - self.origin) / self.edge).floor().to_array();
        let (low, high) = (brick(around.min), brick(around.max));
        if (0..3).any(|axis| high[axis] < 0.0 || low[axis] > last[axis]) {
            return;
        }
        let span = |axis: usize| {
            let [a, b] = [low[axis], high[axis]].map(|c| c.clamp(0.0, last[axis]) as usize);
            a..=b
        };
        let [nx, ny, _] = self.dims;
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let code = &mut self.codes[(z * ny + y) * nx + x];
                    // Bricks that are marked keep their code: emission alone casts no shadow, and
                    // camera rays take no longer steps.
                    if *code >= EMPTY {
                        *code = ROUGHEST;
                    }
                }
            }
        }
    }

    /// Computes the codes of empty bricks: each takes one more than the least code of its
    /// neighbours, in a forward and in a backward pass (Rosenfeld and Pfaltz 1968).
    fn spread(&mut self) {
        let [nx, ny, nz] = self.dims;
        // Surrounded by bricks that are farther than any, so that all have the same neighbours.
        let (row, layer) = (nx + 2, (nx + 2) * (ny + 2));
        let mut codes = vec![u8::MAX; layer * (nz + 2)];
        // Where rows and their surroundings begin.
        let places = |i: usize| ((i / ny + 1) * layer + (i % ny + 1) * row, i * nx);
        for (around, own) in (0..ny * nz).map(places) {
            codes[around + 1..][..nx].copy_from_slice(&self.codes[own..][..nx]);
        }
        let mut near = vec![0; row];
        for (first, _) in (0..ny * nz).map(places) {
            let (before, own) = codes.split_at_mut(first);
            let rows = [layer + row, layer, layer - row, row];
            let own = &mut own[1..=nx];
            next_to(rows.map(|by| &before[first - by..][..row]), &mut near, own);
            let mut last = u8::MAX;
            for code in own {
                last = (*code).min(farther(last));
                *code = last;
            }
        }
        for (first, whole) in (0..ny * nz).rev().map(places) {
            let (own, behind) = codes.split_at_mut(first + row);
            let rows = [layer + row, layer, layer - row, row];
            let own = &mut own[first + 1..][..nx];
            next_to(rows.map(|by| &behind[by - row..][..row]), &mut near, own);
            let mut last = u8::MAX;
            for code in own.iter_mut().rev() {
                last = (*code).min(farther(last));
                *code = last;
            }
            self.codes[whole..][..nx].copy_from_slice(own);
        }
    }
}

/// The code of an empty brick beside one with this code.
fn farther(code: u8) -> u8 {
    code.saturating_add(1).max(EMPTY)
}

/// Lowers codes of a row of bricks to what their neighbours in `rows`, which are two bricks longer,
/// allow. `near` is room for one of those.
fn next_to(rows: [&[u8]; 4], near: &mut [u8], own: &mut [u8]) {
    let [a, b, c, d] = rows;
    for ((((near, &a), &b), &c), &d) in near.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *near = a.min(b).min(c.min(d));
    }
    for (((code, &a), &b), &c) in own.iter_mut().zip(&*near).zip(&near[1..]).zip(&near[2..]) {
        *code = (*code).min(farther(a.min(b).min(c)));
    }
}

/// Replaces each value by the largest within [`REACH`] along an axis.
fn widen(values: &mut Array3<f32>, axis: Axis) {
    let own = values.clone();
    let count = values.len_of(axis);
    for away in 1..=REACH.min(count - 1) {
        for (to, from) in [(0..count - away, away..count), (away..count, 0..count - away)] {
            let mut to = values.slice_axis_mut(axis, to.into());
            ndarray::Zip::from(&mut to).and(own.slice_axis(axis, from.into())).for_each(|a, &b| {
                // They are numbers; maxima of what may be NaN take longer.
                if b > *a {
                    *a = b;
                }
            });
        }
    }
}

/// An upper bound for the change of opacity over a voxel of a brick: by the function's steepest
/// slope there, but at most the difference between its smallest and largest opacity.
fn opacity_change(function: &TransferFunction, range: Range) -> f32 {
    let [first, last] = function.range();
    let cell = ((last - first) / f64::from(TABLE_CELLS)).max(f64::MIN_POSITIVE);
    let [low, high] = [f64::from(range.low) - cell, f64::from(range.high) + cell];
    let points = function.points().iter();
    let inner = points.filter(|point| point.value > low && point.value < high);
    let mut before = (low, function.at(low).1);
    let (mut least, mut most, mut steepest) = (before.1, before.1, 0.0_f64);
    for (value, opacity) in
        inner.map(|point| (point.value, point.opacity)).chain([(high, function.at(high).1)])
    {
        (least, most) = (least.min(opacity), most.max(opacity));
        steepest = steepest.max((opacity - before.1).abs() / (value - before.0).max(cell));
        before = (value, opacity);
    }
    (steepest * f64::from(range.slope)).min(most - least) as f32
}

/// Whether a function's opacity is above 0 anywhere in a range.
fn shows(function: &TransferFunction, range: Range) -> bool {
    // Passes read functions from tables, whose cells smear a jump over two cells on either side.
    let [first, last] = function.range();
    let smeared = 2.0 * (last - first) / f64::from(TABLE_CELLS);
    let [low, high] = [f64::from(range.low) - smeared, f64::from(range.high) + smeared];
    let mut inside = function.points().iter().filter(|point| (low..=high).contains(&point.value));
    function.at(low).1 > 0.0 || function.at(high).1 > 0.0 || inside.any(|point| point.opacity > 0.0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn codes_grow_with_one_over_the_root_of_the_change() {
        // Along x: a jump of 4, a constant part, a jump of 1.
        let density =
            |x: usize| f32::from(u8::from(x < 20)) * 4.0 + f32::from(u8::from(x > 60)) + 1.0;
        let values = Array3::from_shape_fn((4, 4, 96), |(_, _, x)| density(x));
        let volume = Volume::new("jumps", values, DMat4::IDENTITY).unwrap();
        let media = Media::from(volume);
        let occupancy = media.occupancy();
        assert_eq!(occupancy.roughness(), 4.0);
        let code = |voxel: usize| occupancy.codes()[voxel / 4];
        assert_eq!((code(18), code(28)), (ROUGHEST, ROUGHEST));
        assert_eq!((code(61), code(70), code(80)), (2 * ROUGHEST, 2 * ROUGHEST, EMPTY - 1));
        assert_eq!(code(40), EMPTY - 1);
    }

    #[test]
    fn distances_are_the_largest_along_any_axis() {
        let mut values = Array3::zeros((24, 32, 40));
        values[[2, 14, 18]] = 1.0;
        values[[21, 2, 2]] = 1.0;
        let volume = Volume::new("dots", values, DMat4::IDENTITY).unwrap();
        let occupancy = Media::from(volume).occupancy().clone();
        assert_eq!((occupancy.dims(), occupancy.edge()), ([10, 8, 6], 4.0));
        for (i, &code) in occupancy.codes().iter().enumerate() {
            let brick = [i % 10, i / 10 % 8, i / 80].map(|c| c as i32);
            // Both lie within a brick, away from its sides.
            let to = |dot: [i32; 3]| (0..3).map(|a| (brick[a] - dot[a]).abs()).max().unwrap();
            let expected = to([4, 3, 0]).min(to([0, 0, 5]));
            let distance = if code < EMPTY { 0 } else { i32::from(code - EMPTY) + 1 };
            assert_eq!(distance, expected, "{brick:?}");
        }
    }
}
