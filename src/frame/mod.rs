//! One picture boiled down to f32: the numbers that both backends see, laid out as the shaders read
//! them (`shaders/kernel/frame.wgsl`). Made once from a scene in f64, so that a difference between
//! backends cannot come from the set-up. Knows no backend.
//!
//! Positions are in *frame space*: world space moved so that the volume's centre is the origin,
//! which keeps f32 sharp for volumes far from the world's origin, and in units of the media
//! ([`crate::scene::Media::unit`]) where they are tiny or huge; in what follows, lengths are of such units.

mod mixture;
mod parts;
mod steps;

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec3, Vec4};

use crate::error::{Error, Result};
use crate::scene::{Light, LightView, Media, Scene};
use crate::settings::{Crossing, Lookup, Settings, Shading};
pub use mixture::{
    FARTHEST_CELL, Field, LEAST_CELLS, MOST_FIELDS, MOST_PARTS, Mixture, Part, TABLE_CELLS,
};
pub use parts::{FrameGround, FrameLight, FrameMap, FrameMedia, FrameView, Marching};
pub use steps::{
    LIGHT_STEPS_LEAST, LIGHT_STEPS_PER_VOXEL, LOOKUP_WEIGHT, SLAB_SAMPLES_PER_VOXEL,
    SLABS_PER_VOXEL, VIEW_STEPS_LEAST, VIEW_STEPS_MOST, VIEW_STEPS_PER_VOXEL,
};
use steps::{UNLIMITED, bricks, marching, planes, reach, shared_length, shared_weight};

/// How steep exponential shadow tests are over the depth of the volume (Annen et al. 2008 find 80
/// the most that floats bear, which sets how close to a surface they are right).
const EXPONENTIAL_SHARPNESS: f64 = 80.0;
/// Transmittance below which a camera ray ends: a quarter of what an 8-bit picture can show.
const OPAQUE_TRANSMITTANCE: f64 = 1.0 / 1024.0;

/// Optical depth over the media's diagonal at most: f32 then holds all sums.
const MOST_OPTICAL_DEPTH: f64 = 1e30;

/// Parameters of a frame, in uniform-buffer layout.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// What the media are, and where.
    pub media: FrameMedia,
    /// The light.
    pub light: FrameLight,
    /// The picture.
    pub view: FrameView,
    /// The shadow map.
    pub map: FrameMap,
}

impl Frame {
    /// Whether pictures need no more than parallel light, the default lookup, the bilinear filter, exact
    /// shadow tests and single scattering.
    pub fn is_usual(&self) -> bool {
        let (view, map) = (&self.view, &self.map);
        map.lookup == 0
            && map.window == 0
            && view.shading == 0
            && map.sharpness == 0.0
            && view.octaves == 0
            && map.surface_reach == 0.0
            && self.light.has_position == 0
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
        let rays_of_view = {
            let [width, height] = settings.image_size.map(f64::from);
            scene.camera.rays(width / height)
        };
        let [inner, outer] = sun.cone_cosines().map(|c| c as f32);
        let axis = match sun.kind {
            crate::scene::LightKind::Spot { direction, .. } => direction.normalize_or_zero(),
            _ => DVec3::ZERO,
        };
        let [near, far] = light.axial_extent(media).map(|depth| depth / unit);
        let (window, exponential) = settings.filter.window();
        let sharpness =
            if exponential { EXPONENTIAL_SHARPNESS / (far - near).max(1e-30) } else { 0.0 };
        let planes = planes(settings, light, media);
        let tolerance = if exponential { 0.0 } else { settings.finer(settings.tolerance) };
        let [rays, slabs, march] = marching(media, settings, tolerance);
        let [brick_scale, brick_offset] = bricks(media);
        let thresholds = Vec3::from_array(settings.thresholds.map(|t| t as f32));
        let [width, height] = settings.image_size;
        let frame = Self {
            media: FrameMedia {
                index_from_frame: [0, 1, 2].map(|i| index_from_frame.row(i).as_vec4()),
                domain_min: media.domain().min.as_vec3(),
                extinction: match media.plain() {
                    Some(_) => (medium.density_scale * unit) as f32,
                    None => 1.0,
                },
                domain_max: media.domain().max.as_vec3(),
                largest: media.largest(),
                voxel_share: Vec3::from_array(media.dims().map(|n| 1.0 / n as f32)),
                most_voxels: media.most_voxels() as f32,
                brick_scale,
                stored_one: 1.0,
                brick_offset,
                emits: u32::from(media.emits()),
                albedo: medium.albedo.as_vec3(),
                phase_g: medium.phase_g as f32,
            },
            light: FrameLight {
                origin: at(light.origin),
                origin_u: within(light.origin_u),
                origin_v: within(light.origin_v),
                direction: along(light.direction),
                direction_u: along(light.direction_u),
                direction_v: along(light.direction_v),
                from_frame: [0, 1, 2, 3].map(|i| light_from_frame.row(i).as_vec4()),
                position: light.position.map_or(Vec3::ZERO, |p| at(p).truncate()),
                has_position: u32::from(light.position.is_some()),
                axis: axis.as_vec3(),
                cone_inner: inner,
                irradiance: irradiance.as_vec3(),
                cone_outer: outer,
            },
            view: FrameView {
                origin: at(rays_of_view.origin),
                origin_x: within(rays_of_view.origin_x),
                origin_y: within(rays_of_view.origin_y),
                direction: along(rays_of_view.direction),
                direction_x: along(rays_of_view.direction_x),
                direction_y: along(rays_of_view.direction_y),
                world_origin: at(DVec3::ZERO).truncate(),
                per_world: (1.0 / unit) as f32,
                ambient: scene.ambient.as_vec3(),
                octaves: settings.octaves,
                background: scene.background.map_or(Vec4::ZERO, |b| b.as_vec3().extend(1.0)),
                ground: ground(scene, center.y, unit),
                width,
                height,
                samples: settings.samples,
                shading: u32::from(settings.shading == Shading::Paper),
                light_samples: settings.light_samples,
                opaque: settings.finer(OPAQUE_TRANSMITTANCE) as f32,
                shared_weight: shared_weight(settings),
                shared_length: shared_length(media, settings),
                march,
            },
            map: FrameMap {
                rays,
                slabs,
                thresholds,
                sharpness: sharpness as f32,
                threshold_depths: -(Vec3::ONE - thresholds).map(f32::ln),
                surface_reach: (reach(settings, light, media) / unit) as f32,
                size: settings.map_size,
                crossing: crossing(settings),
                lookup: lookup(settings),
                window,
                near: near as f32,
                far: far as f32,
                // Exponential tests are made fragment by fragment: all of them are kept.
                tolerance: tolerance as f32,
                truncation: settings.finer(settings.truncation) as f32,
                planes,
                follows_links: u32::from(settings.links),
                unused: [0; 2],
            },
        };
        frame.checked(media)
    }

    /// The same frame, if f32 holds it.
    fn checked(self, media: &Media) -> Result<Self> {
        // Integers are no more than some millions, which as floats are next to nothing.
        let numbers: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&self));
        let finite = numbers.iter().all(|number| number.is_finite());
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
        (self.map.tolerance, self.map.truncation) = (0.0, 0.0);
        // Quality is in the number of samples.
        let slabs = &mut self.map.slabs;
        let quality = slabs.samples / SLAB_SAMPLES_PER_VOXEL;
        (slabs.per_voxel, slabs.rough) = (quality * SLABS_PER_VOXEL, 0.0);
        self
    }

    /// From now on takes exactly as many steps along every light ray, all as long as each other.
    pub fn take_light_steps(&mut self, count: u32) {
        self.map.rays.take(count);
        self.map.slabs.take(count);
    }

    /// From now on takes exactly as many steps along every camera ray, all as long as each other.
    pub fn take_view_steps(&mut self, count: u32) {
        self.view.march.take(count);
    }
}

impl Marching {
    fn take(&mut self, count: u32) {
        (self.least, self.most) = (count, count);
        (self.rough, self.limit) = (0.0, UNLIMITED);
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

/// [`FrameMap::crossing`].
fn crossing(settings: &Settings) -> u32 {
    match settings.crossing {
        Crossing::Exact => 0,
        Crossing::Smoothstep => 1,
        Crossing::Bucket => 2,
    }
}

/// [`FrameMap::lookup`].
fn lookup(settings: &Settings) -> u32 {
    match settings.lookup {
        Lookup::Default => 0,
        Lookup::Paper => 1,
    }
}

/// The ground as a frame holds it, in a frame space whose origin lies at height `center`, in units
/// of as many world lengths.
fn ground(scene: &Scene, center: f64, unit: f64) -> FrameGround {
    scene.ground.map_or(FrameGround::default(), |ground| {
        let extent = ground.half_extent.map_or(f32::INFINITY, |e| (e / unit) as f32);
        FrameGround {
            height: ((ground.height - center) / unit) as f32,
            albedo: ground.albedo as f32,
            half_extent: extent.min(1e30),
            exists: 1,
        }
    })
}
