//! Frame space, and the parts of a frame in it.

use glam::{DMat4, DVec3, DVec4, Vec3, Vec4};

use super::lattice::spacing;
use super::steps::{bricks, planes, reach, shared_length, shared_weight};
use super::{FrameGround, FrameLight, FrameMap, FrameMedia, FrameView, Marching};
use crate::scene::{Beam, Casters, Light, LightKind, LightView, Media, Medium};
use crate::settings::{Crossing, Lookup, Settings, Shading};

/// Steepness of exponential shadow tests over the depth of the volume. Annen et al. 2008 find that
/// 80 is the most that floats can represent; it determines how close to a surface the tests are
/// right.
const EXPONENTIAL_SHARPNESS: f64 = 80.0;
/// A camera ray ends where its transmittance falls below this: a quarter of what an 8-bit picture
/// can show.
const OPAQUE_TRANSMITTANCE: f64 = 1.0 / 1024.0;

/// Frame space: world space moved and scaled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    /// Its origin in the world.
    pub center: DVec3,
    /// World length of one unit.
    pub unit: f64,
}

impl Space {
    /// The space of a frame with these casters.
    pub(super) fn of(casters: Casters<'_>) -> Self {
        Self { center: casters.world_bounds().center(), unit: casters.unit() }
    }

    pub(super) fn point(self, world: DVec3) -> Vec3 {
        ((world - self.center) / self.unit).as_vec3()
    }

    fn at(self, world: DVec3) -> Vec4 {
        self.point(world).extend(0.0)
    }

    /// Transforms a difference of two points.
    fn within(self, world: DVec3) -> Vec4 {
        along(world / self.unit)
    }

    fn world_from_frame(self) -> DMat4 {
        DMat4::from_translation(self.center) * DMat4::from_scale(DVec3::splat(self.unit))
    }

    pub(super) fn media(self, media: &Media, ratios: DVec3) -> FrameMedia {
        let none = Medium::default();
        let medium = media.first().map_or(&none, |body| &body.medium);
        let index_from_frame = media.world_from_index().inverse() * self.world_from_frame();
        let [brick_scale, brick_offset] = bricks(media);
        FrameMedia {
            index_from_frame: [0, 1, 2].map(|i| index_from_frame.row(i).as_vec4()),
            domain_min: media.domain().min.as_vec3(),
            extinction: match media.plain() {
                Some(_) => (medium.density_scale * self.unit) as f32,
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
            ratios: ratios.as_vec3(),
            coloured: u32::from(ratios != DVec3::ONE),
        }
    }

    pub(super) fn light(self, sun: &Light, light: &LightView) -> FrameLight {
        let (light_from_frame, irradiance) =
            placed(light, sun, &self.world_from_frame(), self.unit);
        let [cone_inner, cone_outer] = sun.cone_cosines().map(|c| c as f32);
        let axis = match sun.kind {
            LightKind::Spot { direction, .. } => direction.normalize_or_zero(),
            _ => DVec3::ZERO,
        };
        FrameLight {
            origin: self.at(light.origin),
            origin_u: self.within(light.origin_u),
            origin_v: self.within(light.origin_v),
            direction: along(light.direction),
            direction_u: along(light.direction_u),
            direction_v: along(light.direction_v),
            from_frame: [0, 1, 2, 3].map(|i| light_from_frame.row(i).as_vec4()),
            position: light.position.map_or(Vec3::ZERO, |p| self.point(p)),
            spread: match (light.position, light.face) {
                (None, _) => 0,
                (Some(_), None) => 1,
                (Some(_), Some(face)) => 2 + face,
            },
            axis: axis.as_vec3(),
            cone_inner,
            irradiance: irradiance.as_vec3(),
            cone_outer,
        }
    }

    pub(super) fn view(
        self,
        scene: &Beam,
        thickest: &Media,
        settings: &Settings,
        march: Marching,
    ) -> FrameView {
        let [width, height] = settings.image.size;
        let rays = scene.camera.rays(f64::from(width) / f64::from(height));
        FrameView {
            origin: self.at(rays.origin),
            origin_x: self.within(rays.origin_x),
            origin_y: self.within(rays.origin_y),
            direction: along(rays.direction),
            direction_x: along(rays.direction_x),
            direction_y: along(rays.direction_y),
            world_origin: self.point(DVec3::ZERO),
            per_world: (1.0 / self.unit) as f32,
            ambient: scene.ambient.as_vec3(),
            octaves: settings.view.octaves,
            background: scene.background.map_or(Vec4::ZERO, |b| b.as_vec3().extend(1.0)),
            ground: self.ground(scene),
            width,
            height,
            samples: settings.image.samples,
            shading: u32::from(settings.view.shading == Shading::Paper),
            light_samples: settings.view.light_samples,
            opaque: settings.finer(OPAQUE_TRANSMITTANCE) as f32,
            shared_weight: shared_weight(settings),
            shared_length: shared_length(thickest, settings),
            tolerance: pixel_tolerance(settings) as f32,
            spacing: spacing(scene, settings),
            first_row: 0,
            unused: 0,
            march,
        }
    }

    fn ground(self, scene: &Beam) -> FrameGround {
        scene.ground.map_or(FrameGround::default(), |ground| {
            let extent = ground.half_extent.map_or(f32::INFINITY, |e| (e / self.unit) as f32);
            FrameGround {
                height: ((ground.height - self.center.y) / self.unit) as f32,
                albedo: ground.albedo as f32,
                half_extent: extent.min(1e30),
                exists: 1,
            }
        })
    }

    pub(super) fn map(
        self,
        media: &Media,
        settings: &Settings,
        light: &LightView,
        [rays, slabs]: [Marching; 2],
    ) -> FrameMap {
        let [near, far] = light.axial_extent(media).map(|depth| depth / self.unit);
        let (window, exponential) = settings.map.filter.window();
        let sharpness =
            if exponential { EXPONENTIAL_SHARPNESS / (far - near).max(1e-30) } else { 0.0 };
        let thresholds = Vec3::from_array(settings.map.threshold.levels.map(|t| t as f32));
        FrameMap {
            rays,
            slabs,
            thresholds,
            sharpness: sharpness as f32,
            threshold_depths: -(Vec3::ONE - thresholds).map(f32::ln),
            surface_reach: (reach(settings, light, media) / self.unit) as f32,
            size: settings.map.size,
            crossing: match settings.map.threshold.crossing {
                Crossing::Exact => 0,
                Crossing::Smoothstep => 1,
                Crossing::Bucket => 2,
            },
            lookup: match settings.map.threshold.lookup {
                Lookup::Default => 0,
                Lookup::Paper => 1,
            },
            window,
            near: near as f32,
            far: far as f32,
            tolerance: tolerance(settings) as f32,
            truncation: settings.finer(settings.map.fragments.truncation) as f32,
            planes: planes(settings, light, media),
            follows_links: u32::from(settings.map.follows_links(false)),
            bias: (settings.view.bias / self.unit) as f32,
            covers: u32::from(settings.map.fragments.coverage),
        }
    }
}

fn along(direction: DVec3) -> Vec4 {
    direction.as_vec3().extend(0.0)
}

/// The tolerance of fits. It is 0 for exponential tests, which are made fragment by fragment, so
/// all fragments are kept.
pub(super) fn tolerance(settings: &Settings) -> f64 {
    let (_, exponential) = settings.map.filter.window();
    if exponential { 0.0 } else { settings.finer(settings.map.fragments.tolerance) }
}

/// The tolerance of pixels. The paper's method has a ray for each.
fn pixel_tolerance(settings: &Settings) -> f64 {
    match settings.view.shading {
        Shading::Physical => settings.finer(settings.image.tolerance),
        Shading::Paper => 0.0,
    }
}

/// The transform from frame space, whose unit is `unit` world lengths, to the light's space, with
/// depths in the same unit; and the light's irradiance, for a point or spot light that at a
/// distance of one unit.
fn placed(light: &LightView, sun: &Light, world_from_frame: &DMat4, unit: f64) -> (DMat4, DVec3) {
    // Depth is a length. With a position the other three components are lengths too, but only their
    // ratios matter.
    let (lengths, share) = match light.position {
        Some(_) => (DVec4::splat(1.0 / unit), 1.0 / (unit * unit)),
        None => (DVec4::new(1.0, 1.0, 1.0 / unit, 1.0), 1.0),
    };
    let to_units = DMat4::from_diagonal(lengths);
    (to_units * light.light_from_world * *world_from_frame, sun.irradiance * share)
}
