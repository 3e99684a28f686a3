//! What light passes through: volumes, what each is made of, and the space that they are marched
//! in.

use std::sync::{Arc, OnceLock};

use glam::{DMat4, DVec3};

use super::{Occupancy, TransferFunction};
use crate::math::Aabb;
use crate::volume::Volume;

/// A volume and what it is made of.
#[derive(Clone, Debug)]
pub struct Body {
    /// The densities, shared: scenes are cheap to copy and change.
    pub volume: Arc<Volume>,
    /// What they mean.
    pub medium: Medium,
}

/// From density to light: extinction, what it scatters, what it emits.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Extinction per unit of density, 1 / world length; at least 0. With a transfer function:
    /// where its opacity is 1.
    pub density_scale: f64,
    /// Factor on the extinction of each colour channel, at least 0; white for a grey medium.
    pub tint: DVec3,
    /// Share of the extinguished light that is scattered, per channel, 0..1.
    pub albedo: DVec3,
    /// Henyey and Greenstein's g, the mean cosine of scattering, -1 < g < 1; 0 is isotropic.
    pub phase_g: f64,
    /// Colour and opacity over density; without, extinction is proportional to density.
    pub transfer: Option<Arc<TransferFunction>>,
    /// Factor on the albedo that varies in space: red, green and blue, 0..1.
    pub color: Option<[Arc<Volume>; 3]>,
    /// Factor on the extinction that varies in space, 0..1.
    pub modulation: Option<Arc<Volume>>,
    /// Light that the medium makes itself, which casts no shadows and none of which is scattered.
    pub emission: Option<Emission>,
}

/// Light of a medium's own.
#[derive(Clone, Debug)]
pub struct Emission {
    /// What decides its colour: another grid, or `None` for the densities themselves.
    pub field: Option<Arc<Volume>>,
    /// Colour over the field's values; opacity is a factor on it.
    pub ramp: Arc<TransferFunction>,
    /// Radiance per world length where colour and opacity are 1.
    pub scale: f64,
}

impl Default for Medium {
    /// White and grey: all light is scattered, evenly, and extinction is density.
    fn default() -> Self {
        Self {
            density_scale: 1.0,
            tint: DVec3::ONE,
            albedo: DVec3::ONE,
            phase_g: 0.0,
            transfer: None,
            color: None,
            modulation: None,
            emission: None,
        }
    }
}

impl Medium {
    /// Whether both are the same, with the same volumes where they are.
    fn same(&self, other: &Self) -> bool {
        let grids = |medium: &Self| {
            let emitted = medium.emission.as_ref().and_then(|emission| emission.field.clone());
            let color = medium.color.iter().flatten().cloned();
            color
                .chain(medium.modulation.clone())
                .chain(emitted)
                .map(|grid| Arc::as_ptr(&grid))
                .collect::<Vec<_>>()
        };
        let kinds = |medium: &Self| {
            let emission = medium.emission.as_ref();
            let field = emission.map(|emission| emission.field.is_some());
            (medium.color.is_some(), medium.modulation.is_some(), field)
        };
        let emission = |medium: &Self| {
            medium.emission.as_ref().map(|emission| (emission.ramp.clone(), emission.scale))
        };
        let numbers =
            |medium: &Self| (medium.density_scale, medium.tint, medium.albedo, medium.phase_g);
        numbers(self) == numbers(other)
            && kinds(self) == kinds(other)
            && self.transfer == other.transfer
            && emission(self) == emission(other)
            && grids(self) == grids(other)
    }

    /// Whether extinction is density times a number and nothing varies but that.
    pub fn is_plain(&self) -> bool {
        self.transfer.is_none()
            && self.color.is_none()
            && self.modulation.is_none()
            && self.emission.is_none()
    }
}

/// Powers of two of a diagonal within which world lengths are what is computed in.
const ORDINARY_POWER: f64 = 16.0;
/// How many voxels of the space of several bodies a ray counts at most for each that the bodies
/// have.
const FINER_THAN_BODIES: f64 = 4.0;

/// Several bodies in one space of voxel indices: that of the body whose box around all is the
/// smallest, with voxels as fine as the finest of all along its axes. That of the only body is its
/// own.
///
/// Where bodies overlap, extinctions add up.
#[derive(Clone, Debug)]
pub struct Media {
    bodies: Vec<Body>,
    world_from_index: DMat4,
    domain: Aabb,
    /// Made when first asked for, and shared with copies.
    occupancy: Arc<OnceLock<Occupancy>>,
}

impl From<Volume> for Media {
    /// A white medium whose extinction is density.
    fn from(volume: Volume) -> Self {
        Self::of(Arc::new(volume), Medium::default())
    }
}

impl Media {
    /// One body. Where light is emitted beside its densities too, that is part of the domain.
    pub fn of(volume: Arc<Volume>, medium: Medium) -> Self {
        let world_from_index = *volume.world_from_index();
        let bodies = vec![Body { volume, medium }];
        let domain = around(&bodies, &world_from_index.inverse(), bodies[0].volume.domain());
        Self { bodies, world_from_index, domain, occupancy: Arc::default() }
    }

    /// Nothing, in a cube around the world's origin with edges of length 1.
    pub fn none() -> Self {
        let domain = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        let world_from_index = DMat4::IDENTITY;
        Self { bodies: Vec::new(), world_from_index, domain, occupancy: Arc::default() }
    }

    /// Any number of bodies; their order means nothing.
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

    /// Whether both are the same bodies, with the same volumes where they are.
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

    /// What the bodies are made of.
    pub fn mediums_mut(&mut self) -> impl Iterator<Item = &mut Medium> {
        self.occupancy = Arc::default();
        self.bodies.iter_mut().map(|body| &mut body.medium)
    }

    /// Makes extinction that of one channel. Where the media hold anything stays the same.
    pub(super) fn make_grey(&mut self, channel: usize) {
        if self.bodies.iter().any(|body| body.medium.tint[channel] == 0.0) {
            self.occupancy = Arc::default();
        }
        for Body { medium, .. } in &mut self.bodies {
            medium.density_scale *= medium.tint[channel];
            medium.tint = DVec3::ONE;
        }
    }

    /// Leaves nothing that shines by itself.
    pub(super) fn remove_emission(&mut self) {
        if self.emits() {
            self.mediums_mut().for_each(|medium| medium.emission = None);
        }
    }

    /// The first body.
    pub fn first(&self) -> Option<&Body> {
        self.bodies.first()
    }

    /// What the first body is made of.
    ///
    /// # Panics
    /// If there is none.
    pub fn medium_mut(&mut self) -> &mut Medium {
        self.occupancy = Arc::default();
        &mut self.bodies[0].medium
    }

    /// The only body's volume, if extinction is its density times a number and nothing varies but
    /// that.
    pub fn plain(&self) -> Option<&Volume> {
        match &self.bodies[..] {
            [body] if body.medium.is_plain() => Some(&body.volume),
            _ => None,
        }
    }

    /// The only body, if extinction follows from its density alone, by a number or a transfer
    /// function: then it is known how fast it changes.
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

    /// What they are called, with plus signs between.
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.bodies.iter().map(|body| body.volume.name.as_str()).collect();
        names.join(" + ")
    }

    /// From index (x, y, z) to world position, column vectors.
    pub fn world_from_index(&self) -> &DMat4 {
        &self.world_from_index
    }

    /// The part of index space that holds medium.
    pub fn domain(&self) -> Aabb {
        self.domain
    }

    /// The only body, if nothing lies beside its voxels: then index space is theirs.
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

    /// Where they hold anything, brick by brick.
    pub fn occupancy(&self) -> &Occupancy {
        self.occupancy.get_or_init(|| Occupancy::of(self))
    }

    /// The largest change of extinction over a voxel, 1 / world length; 0 for several bodies and
    /// for modulated extinction, which nothing is known of.
    pub fn roughness(&self) -> f64 {
        let scale = self.graded().map_or(0.0, |body| body.medium.density_scale);
        self.occupancy().roughness() * scale
    }

    /// Points around what can be seen of all bodies ([`Volume::visible_points`]).
    pub fn visible_points(&self, share: f32) -> Vec<DVec3> {
        self.bodies.iter().flat_map(|body| body.volume.visible_points(share)).collect()
    }

    /// World lengths that stand for one in f32, where maps and pictures are computed: 1 for media
    /// that are neither tiny nor huge, else the power of two next to their diagonal. Numbers keep
    /// their digits then, and their squares fit, whatever a file's lengths are.
    pub fn unit(&self) -> f64 {
        let power = self.world_bounds().size().length().log2().round();
        if power.is_finite() && power.abs() > ORDINARY_POWER { power.exp2() } else { 1.0 }
    }

    /// Voxel lengths that a ray through the domain may count at most. Of a body alone that is its
    /// diagonal. The index space of several is as fine as the finest of them, which may be by any
    /// factor: what rays take follows from the voxels that there are.
    pub fn most_voxels(&self) -> f64 {
        let diagonal =
            |body: &Body| DVec3::from_array(body.volume.dims().map(|n| n as f64)).length();
        let sum: f64 = self.bodies.iter().map(diagonal).sum();
        if self.bodies.len() > 1 { FINER_THAN_BODIES * sum } else { sum }
    }

    /// A bound of extinction anywhere, 1 / world length: what all bodies have where they are
    /// densest.
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

    /// The largest density of all.
    pub fn largest(&self) -> f32 {
        self.bodies.iter().map(|body| body.volume.largest()).fold(0.0, f32::max)
    }
}

/// The space of `chosen`, made finer as all bodies ask for, and the box around all of them in it.
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

/// The box around `own` and all that bodies extinguish or emit, in an index space.
fn around(bodies: &[Body], index_from_world: &DMat4, own: Aabb) -> Aabb {
    let field =
        |body: &Body| body.medium.emission.as_ref().and_then(|emission| emission.field.clone());
    let others = bodies.iter().flat_map(|body| [Some(body.volume.clone()), field(body)]);
    others.flatten().fold(own, |all, volume| {
        let corners = volume.world_corners().map(|p| index_from_world.transform_point3(p));
        let Some(box_of) = Aabb::around(corners) else { return all };
        // A box that is the same but for rounding is the same.
        let slack = 1e-6 * all.size();
        let (low, high) = (box_of.min.cmplt(all.min - slack), box_of.max.cmpgt(all.max + slack));
        Aabb {
            min: DVec3::select(low, box_of.min, all.min),
            max: DVec3::select(high, box_of.max, all.max),
        }
    })
}

/// What a space is chosen by: the volume of its box, then the transform itself, so that the order
/// of the bodies means nothing.
fn order((world_from_index, domain): &(DMat4, Aabb)) -> [f64; 17] {
    let volume = world_from_index.determinant().abs() * domain.size().element_product();
    // Boxes that differ by rounding only are as large as each other.
    let volume = f64::from(volume as f32);
    let mut key = [volume; 17];
    key[1..].copy_from_slice(&world_from_index.to_cols_array());
    key
}
