//! One picture boiled down to f32: the numbers that both backends see, laid out as the shaders read
//! them (`shaders/kernel/frame.wgsl`). Made once from a scene in f64, so that a difference between
//! backends cannot come from the set-up. Knows no backend.
//!
//! Positions are in *frame space*: world space moved so that the volume's centre is the origin,
//! which keeps f32 sharp for volumes far from the world's origin, and in units of the media
//! ([`crate::scene::Media::unit`]) where they are tiny or huge; in what follows, lengths are of such units.

mod mixture;
mod steps;

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec3, Vec4};

use crate::error::{Error, Result};
use crate::scene::{Light, LightView, Media, Scene};
use crate::settings::{Crossing, Lookup, Settings, Shading};
pub use mixture::{
    FARTHEST_CELL, Field, LEAST_CELLS, MOST_FIELDS, MOST_PARTS, Mixture, Part, TABLE_CELLS,
};
pub use steps::{
    LIGHT_STEPS_LEAST, LIGHT_STEPS_PER_VOXEL, LOOKUP_WEIGHT, SLAB_SAMPLES_PER_VOXEL,
    SLABS_PER_VOXEL, VIEW_STEPS_LEAST, VIEW_STEPS_MOST, VIEW_STEPS_PER_VOXEL,
};
use steps::{UNLIMITED, bricks, limits, marching, planes, reach, steps};

/// How steep exponential shadow tests are over the depth of the volume (Annen et al. 2008 find 80
/// the most that floats bear, which sets how close to a surface they are right).
const EXPONENTIAL_SHARPNESS: f64 = 80.0;
/// Transmittance below which a camera ray ends: a quarter of what an 8-bit picture can show.
const OPAQUE_TRANSMITTANCE: f64 = 1.0 / 1024.0;

/// Optical depth over the media's diagonal at most: f32 then holds all sums.
const MOST_OPTICAL_DEPTH: f64 = 1e30;

/// Parameters of a frame, in uniform-buffer layout: vectors of four throughout.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// Rows of the affine map from frame space to voxel index.
    pub index_from_frame: [Vec4; 3],
    /// xyz: lower corner of the medium in index space; w: extinction per unit of density (1 for a
    /// [`Mixture`], which is sampled as extinction).
    pub domain_min: Vec4,
    /// xyz: upper corner of the medium in index space; w: largest density.
    pub domain_max: Vec4,
    /// xyz: one over the number of voxels along each axis; w: voxel lengths that a ray may cross at most.
    pub voxel_share: Vec4,
    /// xyz: bricks of [`crate::scene::Occupancy`] along a unit of the space that shaders sample media in:
    /// texture coordinates of a plain volume, else index space; w: length of a camera ray's steps beyond which
    /// something thick may hide behind the last sample.
    pub brick_scale: Vec4,
    /// xyz: brick at that space's origin; w unused.
    pub brick_offset: Vec4,
    /// Steps for each voxel length: along light rays of threshold maps, slabs of fragment maps, along camera
    /// rays; w: samples of density in a slab for each voxel length.
    pub rates: Vec4,
    /// World lengths that those steps may have where the media change most, in the same order; w:
    /// transmittance below which a camera ray ends.
    pub lengths: Vec4,
    /// World lengths that no such step may exceed; w: four steps of a camera ray share a lookup if they are
    /// no longer together.
    pub longest: Vec4,
    /// Differences of optical depth between neighbouring steps, times the light that is left, beyond which those of
    /// threshold maps' rays and slabs are cut; optical depth of a camera ray's sample beyond which its steps
    /// are; share of a pixel's light that several of those have one lookup for.
    pub limits: Vec4,
    /// xyz: scattering albedo; w: Henyey-Greenstein g.
    pub albedo: Vec4,

    /// Origin of the light ray through map position (0, 0); w unused.
    pub light_origin: Vec4,
    /// Its change over the map's width.
    pub light_origin_u: Vec4,
    /// Its change over the map's height.
    pub light_origin_v: Vec4,
    /// Direction of the light ray through (0, 0), not normalised.
    pub light_direction: Vec4,
    /// Its change over the map's width.
    pub light_direction_u: Vec4,
    /// Its change over the map's height.
    pub light_direction_v: Vec4,
    /// Rows of the map from frame space to (u, v, depth, 1) times the fourth.
    pub light_from_frame: [Vec4; 4],
    /// xyz: position of a point or spot light; w: 1 for those, 0 for a directional light.
    pub light_position: Vec4,
    /// xyz: axis of a spot light; w: cosine where its cone begins to fade.
    pub light_axis: Vec4,
    /// xyz: irradiance (at distance 1 where the light has a position); w: cosine at the cone's edge.
    pub irradiance: Vec4,
    /// xyz: ambient radiance; w unused.
    pub ambient: Vec4,

    /// Origin of the camera ray through the picture's upper left corner; w: one over the world lengths of a unit.
    pub view_origin: Vec4,
    /// Its change over the picture's width.
    pub view_origin_x: Vec4,
    /// Its change over the picture's height.
    pub view_origin_y: Vec4,
    /// Direction of that ray, not normalised.
    pub view_direction: Vec4,
    /// Its change over the picture's width.
    pub view_direction_x: Vec4,
    /// Its change over the picture's height.
    pub view_direction_y: Vec4,

    /// Ground: height, albedo, half extent (infinite if endless), 1 if there is one.
    pub ground: Vec4,
    /// xyz: the world's origin in frame space, below which the ground is centred; w: the density that
    /// a stored value of 1 stands for, 1 where densities are stored as they are.
    pub world_origin: Vec4,
    /// xyz: background radiance; w: 1 if there is one.
    pub background: Vec4,

    /// xyz: the opacities whose depths the threshold map keeps; w unused.
    pub thresholds: Vec4,
    /// Optical depths of those opacities; w unused.
    pub threshold_depths: Vec4,

    /// Slices: distances of the first and the last plane along the axis of the light's view, the
    /// tolerance of fits, the truncation of raw lists (both of transmittance).
    pub slices: Vec4,
    /// x: how steep exponential shadow tests are, 1 / world length, 0 for exact ones; y: octaves of
    /// multiple scattering, 0 for none; z: how far apart in depth the fronts of neighbouring texels' shadows
    /// are still those of one surface, 0 where media are too thin for that to matter; w unused.
    pub filtering: Vec4,

    /// Picture width and height, camera rays a pixel, texels along the map's edge.
    pub sizes: [u32; 4],
    /// Light steps at least and at most, camera steps at least and at most.
    pub steps: [u32; 4],
    /// Crossing, lookup, texels along the edge of the filter's window (0: bilinear), shading.
    pub methods: [u32; 4],
    /// Lookups a ray of the paper's shading, planes (0: slabs of each ray's own), 1 if wide filters
    /// follow links, 1 if the media emit light.
    pub counts: [u32; 4],
}

impl Frame {
    /// How many vectors of floats stand before the integers.
    const VECTORS: usize = size_of::<Self>() / size_of::<Vec4>() - 4;

    /// Whether pictures need no more than parallel light, the default lookup, the bilinear filter, exact
    /// shadow tests and single scattering.
    pub fn is_usual(&self) -> bool {
        let [_, lookup, window, shading] = self.methods;
        lookup == 0
            && window == 0
            && shading == 0
            && self.filtering.x == 0.0
            && self.filtering.y == 0.0
            && self.filtering.z == 0.0
            && self.light_position.w == 0.0
    }

    /// The frame of `scene`, one [`crate::scene::Beam`]'s, under `settings`.
    ///
    /// # Errors
    /// If the light cannot be fitted to the volume ([`LightView::fit`]).
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self> {
        let view = LightView::fit(scene.light(), &scene.media)?;
        Self::with_light_view(scene, settings, &view)
    }

    /// The frame of `scene` under `settings`, with a given view of the light.
    ///
    /// # Errors
    /// If a scene is too large or too far away for f32.
    pub fn with_light_view(scene: &Scene, settings: &Settings, light: &LightView) -> Result<Self> {
        let media = &scene.media;
        let (sun, medium) = (scene.light(), &media.first().medium);
        let center = media.world_bounds().center();
        let unit = media.unit();
        let at = |p: DVec3| ((p - center) / unit).as_vec3().extend(0.0);
        let along = |v: DVec3| v.as_vec3().extend(0.0);
        let within = |v: DVec3| along(v / unit);
        let world_from_frame =
            DMat4::from_translation(center) * DMat4::from_scale(DVec3::splat(unit));
        let index_from_frame = media.world_from_index().inverse() * world_from_frame;
        let (light_from_frame, irradiance) = placed(light, sun, &world_from_frame, unit);
        let rays = {
            let [width, height] = settings.image_size.map(f64::from);
            scene.camera.rays(width / height)
        };
        let [inner, outer] = sun.cone_cosines().map(|c| c as f32);
        let axis = match sun.kind {
            crate::scene::LightKind::Spot { direction, .. } => direction.normalize_or_zero(),
            _ => DVec3::ZERO,
        };
        let [near, far] = light.axial_extent(media).map(|depth| depth / unit);
        let (_, exponential) = settings.filter.window();
        let sharpness =
            if exponential { EXPONENTIAL_SHARPNESS / (far - near).max(1e-30) } else { 0.0 };
        let planes = planes(settings, light, media);
        let thresholds = Vec3::from_array(settings.thresholds.map(|t| t as f32));
        let tolerance = if exponential { 0.0 } else { settings.finer(settings.tolerance) };
        let [rates, mut lengths, longest] = marching(media, settings, tolerance);
        lengths.w = settings.finer(OPAQUE_TRANSMITTANCE) as f32;
        let [brick_scale, brick_offset] = bricks(media, settings);
        let frame = Self {
            index_from_frame: [0, 1, 2].map(|i| index_from_frame.row(i).as_vec4()),
            domain_min: media.domain().min.as_vec3().extend(match media.plain() {
                Some(_) => (medium.density_scale * unit) as f32,
                None => 1.0,
            }),
            domain_max: media.domain().max.as_vec3().extend(media.largest()),
            voxel_share: Vec3::from_array(media.dims().map(|n| 1.0 / n as f32))
                .extend(media.most_voxels() as f32),
            brick_scale,
            brick_offset,
            rates,
            lengths,
            longest,
            limits: limits(settings, tolerance),
            albedo: medium.albedo.as_vec3().extend(medium.phase_g as f32),
            light_origin: at(light.origin),
            light_origin_u: within(light.origin_u),
            light_origin_v: within(light.origin_v),
            light_direction: along(light.direction),
            light_direction_u: along(light.direction_u),
            light_direction_v: along(light.direction_v),
            light_from_frame: [0, 1, 2, 3].map(|i| light_from_frame.row(i).as_vec4()),
            light_position: light.position.map_or(Vec4::ZERO, |p| at(p).truncate().extend(1.0)),
            light_axis: axis.as_vec3().extend(inner),
            irradiance: irradiance.as_vec3().extend(outer),
            ambient: along(scene.ambient),
            view_origin: at(rays.origin).with_w((1.0 / unit) as f32),
            view_origin_x: within(rays.origin_x),
            view_origin_y: within(rays.origin_y),
            view_direction: along(rays.direction),
            view_direction_x: along(rays.direction_x),
            view_direction_y: along(rays.direction_y),
            ground: ground(scene, center.y, unit),
            world_origin: at(DVec3::ZERO).with_w(1.0),
            background: scene.background.map_or(Vec4::ZERO, |b| b.as_vec3().extend(1.0)),
            thresholds: thresholds.extend(0.0),
            threshold_depths: (-(Vec3::ONE - thresholds).map(f32::ln)).extend(0.0),
            slices: Vec4::new(
                near as f32,
                far as f32,
                // Exponential tests are made fragment by fragment: all of them are kept.
                tolerance as f32,
                settings.finer(settings.truncation) as f32,
            ),
            filtering: Vec4::new(
                sharpness as f32,
                settings.octaves as f32,
                (reach(settings, light, media) / unit) as f32,
                0.0,
            ),
            sizes: [
                settings.image_size[0],
                settings.image_size[1],
                settings.samples,
                settings.map_size,
            ],
            steps: steps(settings),
            methods: methods(settings),
            counts: [
                settings.light_samples,
                planes,
                u32::from(settings.links),
                u32::from(media.emits()),
            ],
        };
        frame.checked(media)
    }

    /// The same frame, if f32 holds it.
    fn checked(self, media: &Media) -> Result<Self> {
        let finite =
            bytemuck::cast_slice::<Vec4, f32>(&self.vectors()).iter().all(|v| v.is_finite());
        if !finite {
            return Err(Error::value("scene", "a length or a factor of it does not fit f32"));
        }
        let thickest = media.densest() * media.world_bounds().size().length();
        if thickest <= MOST_OPTICAL_DEPTH {
            Ok(self)
        } else {
            let why = format!("an optical depth of up to {thickest:e} does not fit f32");
            Err(Error::value("density scale", why))
        }
    }

    /// The same frame with slabs as short as they ever are, all of them kept.
    #[must_use]
    pub fn with_all_slabs(mut self) -> Self {
        (self.slices.z, self.slices.w) = (0.0, 0.0);
        // Quality is in the number of samples.
        let quality = self.rates.w / SLAB_SAMPLES_PER_VOXEL;
        (self.rates.y, self.lengths.y) = (quality * SLABS_PER_VOXEL, 0.0);
        self
    }

    /// From now on takes exactly as many steps along every light ray, all as long as each other.
    pub fn take_light_steps(&mut self, count: u32) {
        [self.steps[0], self.steps[1]] = [count; 2];
        (self.lengths.x, self.lengths.y) = (0.0, 0.0);
        (self.limits.x, self.limits.y) = (UNLIMITED, UNLIMITED);
    }

    /// From now on takes exactly as many steps along every camera ray, all as long as each other.
    pub fn take_view_steps(&mut self, count: u32) {
        [self.steps[2], self.steps[3]] = [count; 2];
        (self.lengths.z, self.limits.z) = (0.0, UNLIMITED);
    }

    /// All vectors, for checks.
    fn vectors(&self) -> [Vec4; Self::VECTORS] {
        let floats: &[f32] = bytemuck::cast_slice(std::slice::from_ref(self));
        std::array::from_fn(|i| Vec4::from_slice(&floats[4 * i..]))
    }
}

/// From frame space, of units of as many world lengths, to the light's, whose depths are in them too, and the
/// irradiance there: that of a point or spot light is at a distance of a unit.
fn placed(light: &LightView, sun: &Light, world_from_frame: &DMat4, unit: f64) -> (DMat4, DVec3) {
    // Depth is a length; with a position so are the other three, whose ratios count.
    let (lengths, share) = match light.position {
        Some(_) => (DVec4::splat(1.0 / unit), 1.0 / (unit * unit)),
        None => (DVec4::new(1.0, 1.0, 1.0 / unit, 1.0), 1.0),
    };
    let to_units = DMat4::from_diagonal(lengths);
    (to_units * light.light_from_world * *world_from_frame, sun.irradiance * share)
}

/// Crossing, lookup, texels along the edge of the filter's window, shading.
fn methods(settings: &Settings) -> [u32; 4] {
    let crossing = match settings.crossing {
        Crossing::Exact => 0,
        Crossing::Smoothstep => 1,
        Crossing::Bucket => 2,
    };
    let lookup = match settings.lookup {
        Lookup::Default => 0,
        Lookup::Paper => 1,
    };
    [crossing, lookup, settings.filter.window().0, u32::from(settings.shading == Shading::Paper)]
}

/// The ground as a frame holds it, in a frame space whose origin lies at height `center`, in units
/// of as many world lengths.
fn ground(scene: &Scene, center: f64, unit: f64) -> Vec4 {
    scene.ground.map_or(Vec4::ZERO, |ground| {
        let extent = ground.half_extent.map_or(f32::INFINITY, |e| (e / unit) as f32);
        let height = ((ground.height - center) / unit) as f32;
        Vec4::new(height, ground.albedo as f32, extent.min(1e30), 1.0)
    })
}
