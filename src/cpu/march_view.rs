//! Pass `march_view`: from the camera through the volume, each step lit through the shadow map, and
//! on to the ground or the background.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::frame::{Frame, OPAQUE_TRANSMITTANCE};
use crate::image::Image;
use crate::kernel::light::light_coordinates;
use crate::kernel::media::{Piece, Sampler, arriving, density_along, emission_along, source_along};
use crate::kernel::medium::{scattered, step_opacity};
use crate::kernel::occupancy::{BATCH, Walk};
use crate::kernel::ray::{Ray, intersect_box, step_count};
use crate::kernel::view::{
    camera_ray, ground_distance, ground_radiance, pixel_offset, surface_depth,
};
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::ShadowMap;

/// The whole picture: premultiplied linear radiance and opacity.
pub(super) fn march_view(
    media: &Media,
    frame: &Frame,
    map: &dyn ShadowMap,
    progress: &dyn Progress,
) -> Image {
    let [width, height, samples, _] = frame.sizes;
    progress.begin("picture", u64::from(height));
    let view = View { sampler: Sampler::of(media), frame, map };
    let mut image = Image::filled(width, height, [0.0; 4]);
    image.pixels.par_chunks_exact_mut(width as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut sum = Vec4::ZERO;
            for i in 0..samples {
                let offset = pixel_offset(i, samples);
                let at = |c: usize, offset: f32, n: u32| (c as f32 + offset) / n as f32;
                let ray = camera_ray(frame, at(x, offset.x, width), at(y, offset.y, height));
                sum += view.march(&ray);
            }
            *pixel = (sum / samples as f32).to_array();
        }
        progress.advance(1);
    });
    image
}

/// What a camera ray meets.
pub(super) struct View<'a> {
    pub(super) sampler: Sampler<'a>,
    pub(super) frame: &'a Frame,
    pub(super) map: &'a dyn ShadowMap,
}

/// The part of a camera ray in the volume, cut into steps.
pub(super) struct Steps {
    enter: f32,
    step: f32,
    count: u32,
    index_ray: Ray,
}

/// Two steps of equal length.
struct Pair<'a> {
    /// In index space.
    ray: &'a Ray,
    begin: f32,
    step: f32,
    /// How many of the two there are.
    count: u32,
}

/// What a step, or two, add to a picture.
pub(super) struct Added {
    /// Distances where it begins and ends.
    pub(super) part: [f32; 2],
    /// Its share of the ray's light: opacity behind what stands before it.
    pub(super) weight: f32,
    /// Transmittance from the camera in front of it.
    pub(super) through: f32,
    /// Radiance that reaches the camera from it.
    pub(super) radiance: Vec3,
}

impl View<'_> {
    fn march(&self, ray: &Ray) -> Vec4 {
        let ground = ground_distance(self.frame, ray);
        let steps = self.steps(ray, if ground > 0.0 { ground } else { f32::INFINITY });
        let (light, through) = if self.frame.methods[3] == 1 {
            self.paper_shading(ray, &steps)
        } else {
            self.single_scattering(ray, &steps)
        };
        let behind = if ground > 0.0 {
            self.lit_ground(ray.at(ground)).extend(1.0)
        } else {
            self.frame.background
        };
        light.extend(1.0 - through) + through * behind.truncate().extend(behind.w)
    }

    /// Radiance of the ground at a point of it.
    pub(super) fn lit_ground(&self, point: Vec3) -> Vec3 {
        let mut light = light_coordinates(self.frame, point);
        light.z = surface_depth(self.frame, light);
        ground_radiance(self.frame, point, self.lookup(light))
    }

    pub(super) fn steps(&self, ray: &Ray, farthest: f32) -> Steps {
        let frame = self.frame;
        let index_ray = ray.transformed(&frame.index_from_frame);
        let (min, max) = (frame.domain_min.truncate(), frame.domain_max.truncate());
        let (enter, exit) = intersect_box(&index_ray, min, max);
        let length = exit.min(farthest) - enter;
        if length <= 0.0 {
            return Steps { enter, step: 0.0, count: 0, index_ray };
        }
        let voxels = length * index_ray.direction.length();
        let count = step_count(voxels, frame.rates.z, frame.steps[2], frame.steps[3]);
        Steps { enter, step: length / count as f32, count, index_ray }
    }

    /// Transmittance from the light to a point.
    fn transmittance(&self, point: Vec3) -> f32 {
        self.lookup(light_coordinates(self.frame, point))
    }

    /// Transmittance at (u, v, depth).
    fn lookup(&self, light: Vec3) -> f32 {
        self.map.filtered(self.frame.methods[2], light.x, light.y, light.z)
    }

    /// Radiance scattered towards the camera, and the transmittance of the whole ray.
    fn single_scattering(&self, ray: &Ray, steps: &Steps) -> (Vec3, f32) {
        let mut light = Vec3::ZERO;
        let through = self.scatter(ray, steps, |added| light += added.radiance);
        (light, through)
    }

    /// Calls `visit` for what steps add, in order. A step takes two samples of density; a step, or two
    /// that add little, take one of the light. The transmittance of the whole ray.
    pub(super) fn scatter(&self, ray: &Ray, steps: &Steps, mut visit: impl FnMut(Added)) -> f32 {
        let frame = self.frame;
        let mut walk = Walk::new(
            self.sampler.occupancy,
            frame,
            &steps.index_ray,
            [steps.enter, steps.step],
            frame.lengths.z,
        );
        let (mut next, mut through) = (0, 1.0);
        loop {
            let (i, joined) = walk.next_step(next, steps.count);
            if i >= steps.count {
                return through;
            }
            let left = steps.count - i;
            let joined = joined.min(left / BATCH).max(1);
            next = i + BATCH * joined;
            let step = joined as f32 * steps.step;
            for (first, count) in [(0.0, left.min(2)), (2.0, left.saturating_sub(2).min(2))] {
                let begin = steps.enter + i as f32 * steps.step + first * step;
                through = self.pair(
                    ray,
                    &Pair { ray: &steps.index_ray, begin, step, count },
                    through,
                    &mut visit,
                );
                if through < OPAQUE_TRANSMITTANCE {
                    return 0.0;
                }
            }
        }
    }

    /// Calls `visit` for what two steps add; the transmittance behind them.
    fn pair(&self, ray: &Ray, pair: &Pair<'_>, through: f32, visit: &mut impl FnMut(Added)) -> f32 {
        let frame = self.frame;
        let at = |place: f32| pair.begin + place * pair.step;
        let distances = Vec4::new(at(0.25), at(0.75), at(1.25), at(1.75));
        let quarter = 0.25 * pair.step;
        let sample = |t: f32| density_along(&self.sampler, pair.ray, t, quarter);
        let mut taus = Vec4::ZERO;
        if pair.count > 0 {
            (taus.x, taus.y) = (sample(distances.x), sample(distances.y));
        }
        if pair.count > 1 {
            (taus.z, taus.w) = (sample(distances.z), sample(distances.w));
        }
        let emits = frame.counts[3] == 1;
        if taus == Vec4::ZERO && !emits {
            return through;
        }
        taus *= frame.domain_min.w * (0.5 * pair.step);
        let added = scattered(through, taus, distances);
        let ends = if added.weights.y > 0.0 { [at(1.0), at(2.0)] } else { [at(2.0); 2] };
        let parts = [([at(0.0), ends[0]], added.weights.x), (ends, added.weights.y)];
        let mut before = through;
        for ((part, weight), place) in parts.into_iter().zip(added.places.to_array()) {
            if weight <= 0.0 {
                continue;
            }
            let half = 0.5 * (part[1] - part[0]);
            let radiance = weight * self.source(ray, pair.ray, [place, half]);
            visit(Added { part, weight, through: before, radiance });
            before -= weight;
        }
        if emits {
            let radiance = self.emitted(pair, through, [taus, distances]);
            visit(Added { part: [at(0.0), at(2.0)], weight: 0.0, through, radiance });
        }
        added.through
    }

    /// Light that a piece of a ray, around a place and of half a length, sends to the camera per unit of
    /// opacity.
    fn source(&self, ray: &Ray, index_ray: &Ray, [at, half]: [f32; 2]) -> Vec3 {
        let point = ray.at(at);
        let light = arriving(self.frame, ray, point);
        let transmittance = self.transmittance(point);
        let piece = Piece { ray: index_ray, at, half };
        source_along(&self.sampler, self.frame, &piece, &light, transmittance)
    }

    /// Radiance that reaches the camera of what four samples emit, each behind half of itself; `through`
    /// is the transmittance in front of the first.
    fn emitted(&self, pair: &Pair<'_>, through: f32, [taus, distances]: [Vec4; 2]) -> Vec3 {
        let half = 0.25 * pair.step;
        let (mut sum, mut before) = (Vec3::ZERO, through);
        for k in 0..2 * pair.count as usize {
            let piece = Piece { ray: pair.ray, at: distances[k], half };
            sum += emission_along(&self.sampler, &piece)
                * (before * (-0.5 * taus[k]).exp() * 2.0 * half);
            before *= (-taus[k]).exp();
        }
        sum
    }

    /// The paper's shading: the sampled value as colour and opacity, accumulated unshadowed, then
    /// darkened by the plain average of the opacities looked up at equal distances along the ray.
    fn paper_shading(&self, ray: &Ray, steps: &Steps) -> (Vec3, f32) {
        let frame = self.frame;
        let extinction_step = frame.domain_min.w * steps.step;
        let brightest = frame.domain_max.w.max(1e-30);
        let (mut colour, mut through) = (0.0_f32, 1.0_f32);
        for i in 0..steps.count {
            let t = steps.enter + (i as f32 + 0.5) * steps.step;
            let density = density_along(&self.sampler, &steps.index_ray, t, 0.5 * steps.step);
            let opacity = step_opacity(density * extinction_step);
            colour += through * opacity * (density / brightest);
            through *= 1.0 - opacity;
        }
        let lookups = frame.counts[0];
        let length = steps.step * steps.count as f32;
        let mut shadow = 0.0;
        for i in 0..lookups {
            let t = steps.enter + (i as f32 + 0.5) / lookups as f32 * length;
            shadow += 1.0 - self.transmittance(ray.at(t));
        }
        let lit = 1.0 - shadow / lookups as f32;
        (Vec3::splat(colour * if steps.count > 0 { lit } else { 0.0 }), through)
    }
}
