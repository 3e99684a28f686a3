//! Media: several bodies, and the space in which rays march through them.

use std::sync::{Arc, OnceLock};

use glam::{DMat4, DVec3};

use super::{Body, Medium, Occupancy};
use crate::math::Aabb;
use crate::volume::Volume;

/// Media with a diagonal between 2 to the minus this and 2 to this are computed in world lengths.
const ORDINARY_POWER: f64 = 16.0;
/// With several bodies, a ray counts at most this many voxels of their common space for each voxel
/// of the bodies.
const FINER_THAN_BODIES: f64 = 4.0;

/// Several bodies in one space of voxel indices. That space has the axes of the body whose box
/// around all bodies is the smallest, and voxels as fine as the finest of all. A single body keeps
/// its own index space.
///
/// Where bodies overlap, their extinctions add up.
#[derive(Clone, Debug)]
pub struct Media {
    bodies: Vec<Body>,
    world_from_index: DMat4,
    domain: Aabb,
    /// Computed at first use, and shared with copies.
    occupancy: Arc<OnceLock<Occupancy>>,
}

impl From<Volume> for Media {
    /// A white medium whose extinction equals density.
    fn from(volume: Volume) -> Self {
        Self::of(Arc::new(volume), Medium::default())
    }
}

impl Media {
    /// Media of one body. If its emission extends beyond its densities, so does the domain.
    pub fn of(volume: Arc<Volume>, medium: Medium) -> Self {
        let world_from_index = *volume.world_from_index();
        let bodies = vec![Body { volume, medium }];
        let domain = around(&bodies, &world_from_index.inverse(), bodies[0].volume.domain());
        Self { bodies, world_from_index, domain, occupancy: Arc::default() }
    }

    /// Empty media, with a cube of edge length 1 around the world's origin as their domain.
    pub fn none() -> Self {
        let domain = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        let world_from_index = DMat4::IDENTITY;
        Self { bodies: Vec::new(), world_from_index, domain, occupancy: Arc::default() }
    }

    /// Media of any number of bodies; their order does not matter.
    pub fn new(bodies: Vec<Body>) -> Self {
        if let [only] = &bodies[..] {
            return Self::of(only.volume.clone(), only.medium.clone());
        }
        let candidates = bodies.iter().map(|body| common_space(&bodies, body));
        let smallest = candidates
            .min_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(std::cmp::Ordering::Equal));
        match smallest {
            Some((world_from_index, domain)) => {
                Self { bodies, world_from_index, domain, occupancy: Arc::default() }
            }
            None => Self::none(),
        }
    }

    /// Whether both have equal bodies that refer to the same volumes in memory.
    pub fn same(&self, other: &Self) -> bool {
        let same =
            |(a, b): (&Body, &Body)| Arc::ptr_eq(&a.volume, &b.volume) && a.medium.same(&b.medium);
        (self.world_from_index, self.domain) == (other.world_from_index, other.domain)
            && self.bodies.len() == other.bodies.len()
            && self.bodies.iter().zip(&other.bodies).all(same)
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The bodies' optical properties, to be changed.
    pub fn mediums_mut(&mut self) -> impl Iterator<Item = &mut Medium> {
        self.occupancy = Arc::default();
        self.bodies.iter_mut().map(|body| &mut body.medium)
    }

    /// Makes extinction that of one channel. The occupancy is kept unless some tint is zero.
    pub(super) fn make_grey(&mut self, channel: usize) {
        if self.bodies.iter().any(|body| body.medium.tint[channel] == 0.0) {
            self.occupancy = Arc::default();
        }
        for Body { medium, .. } in &mut self.bodies {
            medium.density_scale *= medium.tint[channel];
            medium.tint = DVec3::ONE;
        }
    }

    /// The same media, which let as much light through but scatter and emit none.
    #[must_use]
    pub fn black(&self) -> Self {
        let mut black = self.clone();
        black.remove_emission();
        for Body { medium, .. } in &mut black.bodies {
            medium.albedo = DVec3::ZERO;
        }
        black
    }

    /// Multiplies all extinction.
    pub(super) fn make_thicker(&mut self, factor: f64) {
        for Body { medium, .. } in &mut self.bodies {
            medium.density_scale *= factor;
        }
    }

    /// Removes all emission.
    pub(super) fn remove_emission(&mut self) {
        if self.emits() {
            self.mediums_mut().for_each(|medium| medium.emission = None);
        }
    }

    /// The first body.
    pub fn first(&self) -> Option<&Body> {
        self.bodies.first()
    }

    /// The first body's optical properties, to be changed.
    ///
    /// # Panics
    /// If there is no body.
    pub fn medium_mut(&mut self) -> &mut Medium {
        self.occupancy = Arc::default();
        &mut self.bodies[0].medium
    }

    /// The only body's volume, if its extinction is density times a constant and nothing else
    /// varies in space.
    pub fn plain(&self) -> Option<&Volume> {
        match &self.bodies[..] {
            [body] if body.medium.is_plain() => Some(&body.volume),
            _ => None,
        }
    }

    /// The only body, if its extinction depends on its density only, through a constant or a
    /// transfer function. Then it is known how fast extinction changes.
    pub fn graded(&self) -> Option<&Body> {
        match &self.bodies[..] {
            [body] if body.medium.modulation.is_none() => Some(body),
            _ => None,
        }
    }

    /// Whether some body emits light.
    pub fn emits(&self) -> bool {
        self.bodies.iter().any(|body| body.medium.emission.is_some())
    }

    /// The names of the bodies' volumes, joined by plus signs.
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.bodies.iter().map(|body| body.volume.name.as_str()).collect();
        names.join(" + ")
    }

    /// Transform from index (x, y, z) to world position, for column vectors.
    pub fn world_from_index(&self) -> &DMat4 {
        &self.world_from_index
    }

    /// The part of index space that holds the media.
    pub fn domain(&self) -> Aabb {
        self.domain
    }

    /// The only body's volume, if the domain is that volume's: then the index space is too.
    pub(super) fn only_volume(&self) -> Option<&Volume> {
        match &self.bodies[..] {
            [only] if only.volume.domain() == self.domain => Some(&only.volume),
            _ => None,
        }
    }

    /// Voxels along x, y, z: the only body's, else the domain's size.
    pub fn dims(&self) -> [usize; 3] {
        match self.only_volume() {
            Some(only) => only.dims(),
            None => self.domain.size().to_array().map(|n| (n.ceil() as usize).max(1)),
        }
    }

    /// The box around the domain in world space.
    pub fn world_bounds(&self) -> Aabb {
        self.domain.transformed(&self.world_from_index)
    }

    /// The corners of the domain in world space, x fastest.
    pub fn world_corners(&self) -> [DVec3; 8] {
        self.domain.corners().map(|p| self.world_from_index.transform_point3(p))
    }

    /// Which bricks of the media are empty, and how fast the others change. Computed at first use.
    pub fn occupancy(&self) -> &Occupancy {
        self.occupancy.get_or_init(|| Occupancy::of(self))
    }

    /// The largest change of extinction over a voxel, 1 / world length; 0 for several bodies and
    /// for modulated extinction, where it is not known.
    pub fn roughness(&self) -> f64 {
        let scale = self.graded().map_or(0.0, |body| body.medium.density_scale);
        self.occupancy().roughness() * scale
    }

    /// World positions around the visible parts of all bodies ([`Volume::visible_points`]).
    pub fn visible_points(&self, share: f32) -> Vec<DVec3> {
        self.bodies.iter().flat_map(|body| body.volume.visible_points(share)).collect()
    }

    /// The world length of the unit in which maps and pictures are computed in f32: 1 for media of
    /// ordinary size, else the power of two nearest to the media's diagonal. So lengths and their
    /// squares fit f32, whatever unit a file uses.
    pub fn unit(&self) -> f64 {
        unit_of(&self.world_bounds())
    }

    /// The largest number of voxel lengths that a ray through the domain may count. For one body it
    /// is the diagonal. The index space of several bodies is as fine as the finest of them, which
    /// may be finer by any factor; so the number follows from the bodies' own voxels.
    pub fn most_voxels(&self) -> f64 {
        let diagonal =
            |body: &Body| DVec3::from_array(body.volume.dims().map(|n| n as f64)).length();
        let sum: f64 = self.bodies.iter().map(diagonal).sum();
        if self.bodies.len() > 1 { FINER_THAN_BODIES * sum } else { sum }
    }

    /// An upper bound of extinction anywhere, 1 / world length: the sum of the bodies' largest
    /// extinctions.
    pub fn densest(&self) -> f64 {
        let densest = |Body { volume, medium }: &Body| {
            let density = match &medium.transfer {
                Some(function) => {
                    function.points().iter().fold(0.0, |most, point| point.opacity.max(most))
                }
                None => f64::from(volume.largest()),
            };
            medium.density_scale * density
        };
        self.bodies.iter().map(densest).sum()
    }

    /// The largest density of all bodies.
    pub fn largest(&self) -> f32 {
        self.bodies.iter().map(|body| body.volume.largest()).fold(0.0, f32::max)
    }
}

/// The world length of the unit for things of these bounds ([`Media::unit`]).
pub(super) fn unit_of(bounds: &Aabb) -> f64 {
    let power = bounds.size().length().log2().round();
    if power.is_finite() && power.abs() > ORDINARY_POWER { power.exp2() } else { 1.0 }
}

/// The index space of `chosen`, as fine as the finest body, and the box around all bodies in it.
fn common_space(bodies: &[Body], chosen: &Body) -> (DMat4, Aabb) {
    let own = *chosen.volume.world_from_index();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let finer = bodies.iter().fold(DVec3::ONE, |finer, body| {
        let change = body.volume.world_from_index().inverse() * own;
        finer.max(DVec3::from_array(axes.map(|axis| change.transform_vector3(axis).length())))
    });
    let world_from_index = own * DMat4::from_scale(1.0 / finer);
    let index_from_world = world_from_index.inverse();
    let corners = chosen.volume.world_corners().map(|p| index_from_world.transform_point3(p));
    let own = Aabb::around(corners).unwrap_or_else(|| chosen.volume.domain());
    (world_from_index, around(bodies, &index_from_world, own))
}

/// The box around `own` and around all densities and emission of the bodies, in an index space.
fn around(bodies: &[Body], index_from_world: &DMat4, own: Aabb) -> Aabb {
    let field =
        |body: &Body| body.medium.emission.as_ref().and_then(|emission| emission.field.clone());
    let others = bodies.iter().flat_map(|body| [Some(body.volume.clone()), field(body)]);
    others.flatten().fold(own, |all, volume| {
        let corners = volume.world_corners().map(|p| index_from_world.transform_point3(p));
        let Some(box_of) = Aabb::around(corners) else { return all };
        // Boxes that differ only by rounding count as equal.
        let slack = 1e-6 * all.size();
        let (low, high) = (box_of.min.cmplt(all.min - slack), box_of.max.cmpgt(all.max + slack));
        Aabb {
            min: DVec3::select(low, box_of.min, all.min),
            max: DVec3::select(high, box_of.max, all.max),
        }
    })
}

/// The sort key of candidate spaces: the volume of the box, then the transform itself, so that the
/// order of the bodies does not matter.
fn order((world_from_index, domain): &(DMat4, Aabb)) -> [f64; 17] {
    let volume = world_from_index.determinant().abs() * domain.size().element_product();
    // Rounded to f32, so that boxes which differ only by rounding are equally large.
    let volume = f64::from(volume as f32);
    let mut key = [volume; 17];
    key[1..].copy_from_slice(&world_from_index.to_cols_array());
    key
}
