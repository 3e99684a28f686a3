//! A brute-force picture in f64: there is no shadow map, and every point is lit through the exact
//! integral. It knows nothing of the renderers' steps.
//!
//! What a part of a ray sends to the camera is an integral over optical depth. So parts are halved
//! until neither the camera's nor the light's optical depth changes by more than [`MOST_DEPTH`]
//! over one; then four points integrate the remaining exponentials to 1e-8.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, DVec4};
use rayon::prelude::*;

use super::crossings::Crossings;
use super::extinction::Extinction;
use super::integral::{Cells, Stretch};
use super::shading::Shading;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::scene::{Casters, Light, LightKind, Medium, Scene};

/// Nodes and weights of four-point Gauss-Legendre quadrature on 0..1.
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Largest optical depth of a part of a ray, towards the camera and towards the light.
const MOST_DEPTH: f64 = 0.5;
/// Light attenuated to this share is neglected: a billionth of a pixel's.
const DARK: f64 = 1e-9;
/// Largest length of a part, as a share of its distance to a light with a position: from a point
/// light, and within the edge of a cone.
const NEAR_SHARES: [f64; 2] = [0.5, 0.04];
/// Largest number of halvings of a part: where a shadow's edge crosses a part, the light is never
/// smooth.
const MOST_HALVINGS: u32 = 24;

/// [`BruteForce::image`] with one ray through each pixel's centre.
///
/// # Errors
/// As [`BruteForce::image`].
pub fn brute_force_image(scene: &Scene, size: [u32; 2], cuts: u32) -> Result<Image> {
    BruteForce { cuts, ..BruteForce::default() }.image(scene, size)
}

/// How a brute-force picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BruteForce {
    /// The number of equal parts of each cell that a camera ray crosses. They are halved while they
    /// are optically thick; each has four Gauss points.
    pub cuts: u32,
    /// The number of rays along each edge of a pixel. They go through the middles of equal squares.
    pub rays: u32,
    /// World lengths by which points of surfaces and of the ground are moved towards the light.
    pub bias: f64,
}

impl Default for BruteForce {
    fn default() -> Self {
        Self { cuts: 1, rays: 1, bias: 0.0 }
    }
}

impl BruteForce {
    /// Single scattering of all lights of `scene`, and its surfaces, at `width` x `height` pixels, in
    /// linear radiance. Transmittance to the camera and from the light is exact at every point.
    ///
    /// # Errors
    /// If the scene's media are neither a single plain volume nor none.
    pub fn image(self, scene: &Scene, [width, height]: [u32; 2]) -> Result<Image> {
        let volume = scene.media.plain();
        if volume.is_none() && !scene.media.bodies().is_empty() {
            return Err(Error::value("scene", "its media are not plain"));
        }
        let medium = scene.media.first().map(|body| body.medium.clone()).unwrap_or_default();
        let casters = Casters { media: &scene.media, surfaces: &scene.surfaces };
        let extinction = &Extinction::of(casters);
        let shading = Shading::of(scene, extinction, self.bias);
        let crossings = Crossings::of(&scene.surfaces);
        let cells = volume.map(Cells::of);
        let truth = Truth { scene, medium, cells, extinction, crossings, shading, how: self };
        let rays = scene.camera.rays(f64::from(width) / f64::from(height));
        let mut image = Image::filled(width, height, [0.0; 4]);
        image.pixels.par_iter_mut().enumerate().for_each(|(i, pixel)| {
            let at = |c: u32, sub: u32, n: u32| {
                (f64::from(c) + (f64::from(sub) + 0.5) / f64::from(self.rays)) / f64::from(n)
            };
            let (x, y) = (i as u32 % width, i as u32 / width);
            let mut sum = DVec4::ZERO;
            for (sub_x, sub_y) in (0..self.rays).flat_map(|j| (0..self.rays).map(move |i| (i, j))) {
                let (origin, direction) = rays.ray(at(x, sub_x, width), at(y, sub_y, height));
                sum += truth.radiance(origin, direction);
            }
            *pixel = (sum / f64::from(self.rays).powi(2)).as_vec4().to_array();
        });
        Ok(image)
    }
}

/// A scene, prepared for rays.
struct Truth<'a> {
    scene: &'a Scene,
    medium: Medium,
    cells: Option<Cells<'a>>,
    extinction: &'a Extinction<'a>,
    /// All surfaces, as the camera sees them.
    crossings: Crossings,
    shading: Shading<'a>,
    how: BruteForce,
}

/// A source of light.
#[derive(Clone, Copy)]
enum Source<'a> {
    Light(&'a Light),
    /// Ambient light from all directions, without shadow.
    Ambient,
}

impl Source<'_> {
    /// Its position, and the largest length of parts relative to the distance from it.
    fn place(self) -> Option<(DVec3, f64)> {
        let Self::Light(light) = self else { return None };
        match light.kind {
            LightKind::Directional { .. } => None,
            LightKind::Point { position } => Some((position, NEAR_SHARES[0])),
            LightKind::Spot { position, .. } => Some((position, NEAR_SHARES[1])),
        }
    }
}

/// A stretch of a camera ray.
struct Seen<'a> {
    stretch: &'a Stretch,
    origin: DVec3,
    direction: DVec3,
    /// Extinction per unit of density.
    scale: f64,
    /// Optical depth from the camera to the stretch.
    tau: f64,
}

impl Truth<'_> {
    fn radiance(&self, origin: DVec3, direction: DVec3) -> DVec4 {
        let scene = self.scene;
        let ground = ground_distance(scene, origin, direction);
        let end = ground.unwrap_or(f64::INFINITY);
        let (mut tau, mut light) = (0.0, DVec3::ZERO);
        // The share of light that surfaces let through, and where the last of them was.
        let (mut clear, mut from) = (1.0, 0.0);
        for met in self.crossings.met(origin, direction, [0.0, end]) {
            let way = [from, met.distance];
            light += clear * self.between((origin, direction), way, &mut tau);
            let seen = clear * (-tau).exp() * met.opacity;
            if seen > DARK {
                light += seen * self.shading.radiance(&met, origin, direction);
            }
            (clear, from) = (clear * (1.0 - met.opacity), met.distance);
            if clear < DARK {
                break;
            }
        }
        if clear >= DARK {
            light += clear * self.between((origin, direction), [from, end], &mut tau);
        }
        let (behind, alpha) = match (ground, scene.background) {
            (Some(t), _) => (self.ground_radiance(origin + t * direction), 1.0),
            (None, Some(background)) => (background, 1.0),
            (None, None) => (DVec3::ZERO, 0.0),
        };
        let through = clear * (-tau).exp();
        let alpha = 1.0 - through * (1.0 - alpha);
        (light + through * behind).extend(alpha)
    }

    /// What the medium between two distances sends to the camera; `tau` is the optical depth from
    /// there, and grows.
    fn between(&self, (origin, direction): (DVec3, DVec3), way: [f64; 2], tau: &mut f64) -> DVec3 {
        let (scale, cuts) = (self.medium.density_scale, self.how.cuts);
        let mut light = DVec3::ZERO;
        let Some(cells) = &self.cells else { return light };
        cells.walk(origin, direction, way, |stretch| {
            let tau_before = *tau;
            let part = (stretch.exit - stretch.enter) / f64::from(cuts);
            let view = Seen { stretch, origin, direction, scale, tau: tau_before };
            for source in self.sources() {
                for cut in 0..cuts {
                    let [from, to] = [cut, cut + 1].map(|i| stretch.enter + f64::from(i) * part);
                    let ends = [from, to].map(|t| self.end(&view, source, t));
                    light += self.part(&view, source, [from, to], ends, MOST_HALVINGS);
                }
            }
            *tau += scale * stretch.integral();
            true
        });
        light
    }

    /// All sources of light: each light, and ambient light.
    fn sources(&self) -> impl Iterator<Item = Source<'_>> {
        self.scene.lights.iter().map(Source::Light).chain([Source::Ambient])
    }

    /// At a distance: optical depth to the camera, and transmittance from the light.
    fn end(&self, view: &Seen<'_>, source: Source<'_>, t: f64) -> [f64; 2] {
        let to_camera = view.tau + view.scale * view.stretch.integral_to(t);
        if (-to_camera).exp() < DARK {
            return [to_camera, 0.0];
        }
        let point = view.origin + t * view.direction;
        match source {
            Source::Light(light) => [to_camera, self.extinction.light_transmittance(light, point)],
            Source::Ambient => [to_camera, 1.0],
        }
    }

    /// What a part of a ray, with known values at its ends, sends to the camera.
    fn part(
        &self,
        view: &Seen<'_>,
        source: Source<'_>,
        [from, to]: [f64; 2],
        ends: [[f64; 2]; 2],
        left: u32,
    ) -> DVec3 {
        let [[near, arriving_near], [far, arriving_far]] = ends;
        if (-near).exp() < DARK || far <= near {
            return DVec3::ZERO;
        }
        let (dim, bright) = (arriving_near.min(arriving_far), arriving_near.max(arriving_far));
        let changes = bright > dim * MOST_DEPTH.exp();
        // A thick part with dark ends may still contain light.
        let thick = far - near > MOST_DEPTH;
        let most = if thick { 1.0 } else { bright * (far - near) };
        // Close to a light, the squared distance determines how much the light changes.
        let middle = 0.5 * (from + to);
        let close = source.place().is_some_and(|(position, share)| {
            let distance = (view.origin + middle * view.direction - position).length();
            to - from > share * distance
        });
        if left > 0 && most * (-near).exp() > DARK && (thick || changes || close) {
            let end = self.end(view, source, middle);
            return self.part(view, source, [from, middle], [ends[0], end], left - 1)
                + self.part(view, source, [middle, to], [end, ends[1]], left - 1);
        }
        let mut light = DVec3::ZERO;
        for [node, weight] in GAUSS {
            let t = from + node * (to - from);
            let extinction = view.scale * view.stretch.density(t);
            if extinction > 0.0 {
                let seen = (-view.tau - view.scale * view.stretch.integral_to(t)).exp();
                let point = view.origin + t * view.direction;
                let scattered = self.scattered(source, point, view.direction);
                light += scattered * (seen * extinction * weight * (to - from));
            }
        }
        light
    }

    /// Radiance that the medium at `point` scatters towards the camera, per unit of optical depth.
    fn scattered(&self, source: Source<'_>, point: DVec3, view: DVec3) -> DVec3 {
        let Source::Light(light) = source else { return self.medium.albedo * self.scene.ambient };
        let g = self.medium.phase_g;
        let cosine = -view.dot(light.direction_at(point));
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
        self.medium.albedo * phase * self.arriving(light, point)
    }

    fn arriving(&self, light: &Light, point: DVec3) -> DVec3 {
        light.irradiance_at(point) * self.extinction.light_transmittance(light, point)
    }

    fn ground_radiance(&self, point: DVec3) -> DVec3 {
        let scene = self.scene;
        let albedo = scene.ground.map_or(0.0, |ground| ground.albedo);
        let direct = |light: &Light| {
            let cosine = (-light.direction_at(point).y).max(0.0);
            let place = point - self.how.bias * light.direction_at(point);
            let arriving =
                light.irradiance_at(point) * self.extinction.light_transmittance(light, place);
            arriving * (cosine * FRAC_1_PI)
        };
        albedo * (scene.lights.iter().map(direct).sum::<DVec3>() + scene.ambient)
    }
}

fn ground_distance(scene: &Scene, origin: DVec3, direction: DVec3) -> Option<f64> {
    let ground = scene.ground?;
    let t = (ground.height - origin.y) / direction.y;
    let hit = origin + t * direction;
    let within = hit.x.abs().max(hit.z.abs()) <= ground.half_extent.unwrap_or(f64::INFINITY);
    (t > 0.0 && t.is_finite() && within).then_some(t)
}
