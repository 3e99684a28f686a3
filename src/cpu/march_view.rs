//! Pass `march_view`: marches from the camera through the volume, lights each step through the
//! shadow map, and continues to the ground or the background.

use std::cell::Cell;

use glam::{Vec3, Vec4};

use super::ground::farthest;
use super::raster_view::ViewRaster;
use super::refine_view::{Refinement, refine_view};
use super::shade_view::Overlay;
use super::tiles;
use crate::error::Result;
use crate::frame::{Frame, FrameView, pixel_offset};
use crate::image::Image;
use crate::kernel::light::light_coordinates;
use crate::kernel::media::{
    Arriving, Piece, Sampler, arriving, arriving_over, density_along, emission_along, four_along,
    source_along,
};
use crate::kernel::medium::{mean_transmittance, scattered, step_opacity};
use crate::kernel::occupancy::{BATCH, CUT_LIMIT, CUT_SHARE, Walk};
use crate::kernel::ray::{Ray, intersect_box, step_count, voxels_over};
use crate::kernel::view::{camera_ray, ground_distance};
use crate::math::Each;
use crate::parallel;
use crate::progress::Progress;
use crate::scene::Casters;
use crate::shadow::Shadow;

/// The whole picture: premultiplied linear radiance and opacity.
///
/// # Errors
/// If surfaces take too much memory, or shading is the paper's and there are some, or if it is
/// cancelled.
pub(super) fn march_view(
    casters: Casters<'_>,
    frame: &Frame,
    map: &dyn Shadow,
    progress: &dyn Progress,
) -> Result<Image> {
    let FrameView { width, height, samples, spacing, tolerance, .. } = frame.view;
    let refined = frame.view.refines();
    map.prepare();
    let view = View { sampler: Sampler::of(casters.media), frame, map };
    let raster = ViewRaster::new(casters, frame)?;
    let overlay =
        raster.as_ref().map(|raster| Overlay::new(&view, raster, samples, !refined, progress));
    let overlay = overlay.transpose()?;
    let pixel = |place: [usize; 2], rays: u32| {
        let seen = overlay.as_ref().and_then(|overlay| overlay.pixel(place, rays));
        seen.unwrap_or_else(|| view.pixel(place, rays))
    };
    if refined {
        let size = [width, height].each(|n| n as usize);
        let refinement = Refinement { size, spacing: spacing as usize, samples, tolerance };
        let image = refine_view(refinement, progress, |place| view.is_empty(place), pixel);
        return tiles::finished(progress).map(|()| image);
    }
    progress.begin("picture", u64::from(height));
    let mut image = Image::filled(width, height, [0.0; 4]);
    tiles::fill(
        &mut image.pixels,
        width as usize,
        progress,
        || (),
        |(), place| pixel(place, samples).to_array(),
    );
    tiles::finished(progress).map(|()| image)
}

/// The pixels (x, y) of the same picture.
///
/// # Errors
/// If surfaces take too much memory.
pub(super) fn march_pixels(
    casters: Casters<'_>,
    frame: &Frame,
    map: &dyn Shadow,
    pixels: &[[u32; 2]],
) -> Result<Vec<[f32; 4]>> {
    map.prepare();
    let view = View { sampler: Sampler::of(casters.media), frame, map };
    let raster = ViewRaster::new(casters, frame)?;
    let samples = frame.view.samples;
    Ok(parallel::map(pixels, |pixel| {
        let place = pixel.each(|c| c as usize);
        let seen = raster.as_ref().and_then(|raster| view.seen_at(raster, place, samples));
        seen.unwrap_or_else(|| view.pixel(place, samples)).to_array()
    }))
}

/// The surroundings of a camera ray.
pub(super) struct View<'a> {
    pub(super) sampler: Sampler<'a>,
    pub(super) frame: &'a Frame,
    pub(super) map: &'a dyn Shadow,
}

/// The part of a camera ray inside the volume, cut into steps.
pub(super) struct Steps {
    enter: f32,
    exit: f32,
    /// The number of steps if all had the shortest length.
    count: u32,
    index_ray: Ray,
}

/// Four steps of equal length with two density samples each.
pub(super) struct Batch<'a> {
    /// The ray in index space.
    pub(super) ray: &'a Ray,
    begin: f32,
    pub(super) step: f32,
}

impl Batch<'_> {
    /// Distance of sample `k`, 0 to 7.
    pub(super) fn sample(&self, k: usize) -> f32 {
        self.begin + (0.25 + 0.5 * k as f32) * self.step
    }
}

/// What a step, or several steps together, add to a picture.
pub(super) struct Added {
    /// Distances where it begins and ends.
    pub(super) part: [f32; 2],
    /// Its share of the ray's light, 0..1: its opacity, attenuated by what lies in front of it.
    pub(super) weight: f32,
    /// Transmittance from the camera to its front.
    pub(super) through: f32,
    /// Radiance from it that reaches the camera.
    pub(super) radiance: Vec3,
}

impl View<'_> {
    /// The pixel (x, y), with a number of rays.
    fn pixel(&self, place: [usize; 2], samples: u32) -> Vec4 {
        let marched = (0..samples).map(|i| self.march(&self.ray(place, [i, samples])));
        marched.sum::<Vec4>() / samples as f32
    }

    /// The ray of one of the samples of pixel (x, y).
    pub(super) fn ray(&self, [x, y]: [usize; 2], [sample, samples]: [u32; 2]) -> Ray {
        let FrameView { width, height, .. } = self.frame.view;
        let offset = pixel_offset(sample, samples);
        let at = |c: usize, offset: f32, n: u32| (c as f32 + offset) / n as f32;
        camera_ray(self.frame, at(x, offset.x, width), at(y, offset.y, height))
    }

    /// Whether the central ray of pixel (x, y) meets neither medium nor ground.
    fn is_empty(&self, place: [usize; 2]) -> bool {
        let ray = self.ray(place, [0, 1]);
        let steps = self.steps(&ray, f32::INFINITY);
        steps.exit <= steps.enter && ground_distance(self.frame, &ray) <= 0.0
    }

    fn march(&self, ray: &Ray) -> Vec4 {
        let ground = ground_distance(self.frame, ray);
        let steps = self.steps(ray, farthest(ground));
        if self.frame.media.coloured == 1 {
            return self.march_colours(ray, &steps, ground);
        }
        let (light, through) = if self.frame.view.shading == 1 {
            self.paper_shading(ray, &steps)
        } else {
            self.single_scattering(ray, &steps)
        };
        let behind = self.behind(ray, ground);
        light.extend(1.0 - through) + through * behind.truncate().extend(behind.w)
    }

    pub(super) fn steps(&self, ray: &Ray, farthest: f32) -> Steps {
        let frame = self.frame;
        let index_ray = ray.transformed(&frame.media.index_from_frame);
        let (min, max) = (frame.media.domain_min, frame.media.domain_max);
        let (enter, exit) = intersect_box(&index_ray, min, max);
        let exit = exit.min(farthest);
        if exit <= enter {
            return Steps { enter, exit: enter, count: 1, index_ray };
        }
        let voxels = voxels_over(frame, &index_ray, exit - enter, exit - enter);
        let count = step_count(
            voxels,
            frame.view.march.per_voxel,
            frame.view.march.least,
            frame.view.march.most,
        );
        Steps { enter, exit, count, index_ray }
    }

    /// Transmittance from the light to a point.
    fn transmittance(&self, point: Vec3) -> f32 {
        self.lookup(light_coordinates(self.frame, point))
    }

    /// Transmittance at (u, v, depth).
    pub(super) fn lookup(&self, light: Vec3) -> f32 {
        self.map.lookup(self.frame.map.window, light.x, light.y, light.z)
    }

    /// Radiance scattered towards the camera, and the transmittance of the whole ray.
    fn single_scattering(&self, ray: &Ray, steps: &Steps) -> (Vec3, f32) {
        let mut light = Vec3::ZERO;
        let through = self.scatter(ray, steps, |added| light += added.radiance);
        (light, through)
    }

    /// Calls `visit` for the contributions of steps, in order, and returns the transmittance of the
    /// whole ray. Each step takes two density samples; each step, or several that add little, take
    /// one light sample.
    pub(super) fn scatter(&self, ray: &Ray, steps: &Steps, mut visit: impl FnMut(Added)) -> f32 {
        let frame = self.frame;
        let light = arriving(frame, ray, ray.origin);
        let shortest = (steps.exit - steps.enter) / steps.count as f32;
        let lengths = [shortest, frame.view.march.rough, frame.view.march.longest];
        let mut walk = Walk::new(self.sampler.occupancy, &steps.index_ray, steps.exit, lengths);
        let (mut t, mut through) = (walk.next_place(steps.enter), 1.0);
        let opaque = frame.view.opaque;
        while t < steps.exit && through >= opaque {
            let (batch, taus) = self.cut(&walk, &steps.index_ray, t, through);
            t = walk.next_place(t + BATCH as f32 * batch.step);
            through = self.batch((ray, &light), &batch, taus, through, &mut visit);
        }
        if through >= opaque { through } else { 0.0 }
    }

    /// The batch of steps from `t` on, with its samples' optical depths: as long as the walk
    /// allows, and shortened until no sample is thicker than the frame allows. `through` is the
    /// transmittance from the camera to `t`.
    fn cut<'r>(
        &self,
        walk: &Walk<'_>,
        ray: &'r Ray,
        t: f32,
        through: f32,
    ) -> (Batch<'r>, [Vec4; 2]) {
        let frame = self.frame;
        let mut batch = Batch { ray, begin: t, step: walk.step_from(t) };
        let mut limit = frame.view.march.limit;
        let met = Cell::default();
        loop {
            let four = |first: usize| {
                let at = Vec4::from_array([0, 1, 2, 3].each(|k| batch.sample(first + k)));
                four_along(&self.sampler, batch.ray, at, Vec4::splat(0.25 * batch.step), &met)
            };
            let per_density = frame.media.extinction * (0.5 * batch.step);
            let taus = [per_density * four(0), per_density * four(4)];
            let mut thickest = taus[0].max(taus[1]).max_element();
            if batch.step > frame.view.march.hiding {
                let (end, quarter) = (t + BATCH as f32 * batch.step, 0.25 * batch.step);
                let density = density_along(&self.sampler, ray, end, quarter);
                thickest = thickest.max(per_density * density);
            }
            let visible = thickest * through.sqrt();
            if visible <= limit {
                return (batch, taus);
            }
            limit = CUT_LIMIT * frame.view.march.limit;
            let shorter = walk.cut(batch.step, CUT_SHARE * frame.view.march.limit / visible);
            if shorter >= batch.step {
                return (batch, taus);
            }
            batch.step = shorter;
        }
    }

    /// Calls `visit` for the contributions of a batch of steps, and returns the transmittance
    /// behind it. For parallel light, `light` is what arrives anywhere.
    fn batch(
        &self,
        (ray, light): (&Ray, &Arriving),
        batch: &Batch<'_>,
        taus: [Vec4; 2],
        through: f32,
        visit: &mut impl FnMut(Added),
    ) -> f32 {
        let frame = self.frame;
        let emits = frame.media.emits == 1;
        if taus == [Vec4::ZERO; 2] && !emits {
            return through;
        }
        let shared = [frame.view.shared_weight, frame.view.shared_length];
        let added = scattered(through, taus, batch.sample(0), 0.5 * batch.step, shared);
        let (mut before, mut front) = (through, 0);
        for k in 0..BATCH as usize {
            let weight = added.weights[k];
            if weight <= 0.0 {
                continue;
            }
            let steps = added.shared_steps(k);
            let half = 0.5 * batch.step * steps as f32;
            let piece = [added.places[k], half];
            let radiance = if frame.media.coloured == 1 {
                self.share_of_colours(before, weight)
                    * self.source_of_colours((ray, light), batch.ray, piece)
            } else {
                weight * self.source((ray, light), batch.ray, piece)
            };
            let behind = k + steps as usize;
            let part = [front, behind].each(|step| batch.begin + step as f32 * batch.step);
            visit(Added { part, weight, through: before, radiance });
            before -= weight;
            front = behind;
        }
        if emits {
            let radiance = if frame.media.coloured == 1 {
                self.emitted_colours(batch, through, taus)
            } else {
                self.emitted(batch, through, taus)
            };
            let part = [batch.begin, batch.begin + BATCH as f32 * batch.step];
            visit(Added { part, weight: 0.0, through, radiance });
        }
        added.through
    }

    /// Radiance that the piece of a ray within `half` of distance `at` sends to the camera per unit
    /// of opacity.
    fn source(
        &self,
        (ray, light): (&Ray, &Arriving),
        index_ray: &Ray,
        [at, half]: [f32; 2],
    ) -> Vec3 {
        let point = ray.at(at);
        let parallel = self.frame.light.spread == 0;
        let light = if parallel { *light } else { arriving_over(self.frame, ray, [at, half]) };
        let transmittance = self.transmittance(point);
        let piece = Piece { ray: index_ray, at, half };
        source_along(&self.sampler, self.frame, &piece, &light, transmittance)
    }

    /// Radiance that the samples emit and that reaches the camera, attenuated by the samples in
    /// front of each. `before` is the transmittance from the camera to the first sample.
    fn emitted(&self, batch: &Batch<'_>, before: f32, taus: [Vec4; 2]) -> Vec3 {
        let half = 0.25 * batch.step;
        let (mut sum, mut through) = (Vec3::ZERO, before);
        for k in 0..2 * BATCH as usize {
            let (piece, tau) =
                (Piece { ray: batch.ray, at: batch.sample(k), half }, taus[k / 4][k % 4]);
            let seen = through * mean_transmittance(tau) * 2.0 * half;
            sum += emission_along(&self.sampler, &piece) * seen;
            through *= (-tau).exp();
        }
        sum
    }

    /// The paper's shading: accumulates the sampled value, as colour and opacity, without shadows,
    /// then darkens it by the plain average of the opacities looked up at equal distances along the
    /// ray.
    fn paper_shading(&self, ray: &Ray, steps: &Steps) -> (Vec3, f32) {
        let frame = self.frame;
        let length = steps.exit - steps.enter;
        if length <= 0.0 {
            return (Vec3::ZERO, 1.0);
        }
        let step = length / steps.count as f32;
        let extinction_step = frame.media.extinction * step;
        let brightest = frame.media.largest.max(1e-30);
        let (mut colour, mut through) = (0.0_f32, 1.0_f32);
        for i in 0..steps.count {
            let t = steps.enter + (i as f32 + 0.5) * step;
            let density = density_along(&self.sampler, &steps.index_ray, t, 0.5 * step);
            let opacity = step_opacity(density * extinction_step);
            colour += through * opacity * (density / brightest);
            through *= 1.0 - opacity;
        }
        let lookups = frame.view.light_samples;
        let mut shadow = 0.0;
        for i in 0..lookups {
            let t = steps.enter + (i as f32 + 0.5) / lookups as f32 * length;
            shadow += 1.0 - self.transmittance(ray.at(t));
        }
        let lit = 1.0 - shadow / lookups as f32;
        (Vec3::splat(colour * lit), through)
    }
}
