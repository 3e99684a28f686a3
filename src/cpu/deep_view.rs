//! The camera's view as a deep image: the medium and the ground along each pixel's central ray,
//! each piece with its distances, so that compositing programs can insert objects between them.

use glam::Vec3;

use super::march_view::View;
use crate::frame::Frame;
use crate::kernel::media::Sampler;
use crate::kernel::view::{camera_ray, ground_distance};
use crate::scene::Media;
use crate::shadow::Map;

/// Adjacent steps are merged into one sample up to this opacity.
const MERGED_OPACITY: f32 = 1.0 / 64.0;

/// A piece of a pixel's ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepSample {
    /// Distance in world lengths, from the camera's origin along the ray, where it begins.
    pub front: f32,
    /// Distance in world lengths where it ends; equal to `front` for the ground.
    pub back: f32,
    /// Radiance that it sends to the camera, without attenuation by pieces in front of it
    /// (premultiplied by its opacity).
    pub radiance: Vec3,
    /// Its own opacity, 0..1.
    pub alpha: f32,
}

/// A camera's view of a scene through its shadow map, pixel by pixel.
pub struct DeepView<'a> {
    view: View<'a>,
}

impl<'a> DeepView<'a> {
    /// The view of `media` with the parameters `frame`, lit through `map`. Rays go through the
    /// centres of pixels, whatever the frame's samples, and shading is single scattering.
    pub fn new(media: &'a Media, frame: &'a Frame, map: &'a Map) -> Self {
        Self { view: View { sampler: Sampler::of(media), frame, map } }
    }

    /// The samples of pixel (`x`, `y`), row 0 on top, from front to back and without overlap.
    /// Adjacent steps of the march are merged into one sample as long as it takes less than 1/64 of
    /// the light.
    pub fn pixel(&self, x: u32, y: u32) -> Vec<DeepSample> {
        let frame = self.view.frame;
        let [width, height] = [frame.view.width, frame.view.height];
        let at = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        let ray = camera_ray(frame, at(x, width), at(y, height));
        let ground = ground_distance(frame, &ray);
        let steps = self.view.steps(&ray, if ground > 0.0 { ground } else { f32::INFINITY });
        let mut samples: Vec<DeepSample> = Vec::new();
        let through = self.view.scatter(&ray, &steps, |added| {
            let ([front, back], through) = (added.part, added.through.max(1e-30));
            let alpha = (added.weight / through).min(1.0);
            let own = DeepSample { front, back, radiance: added.radiance / through, alpha };
            match samples.last_mut() {
                Some(last) if last.back >= front && last.alpha + alpha <= MERGED_OPACITY => {
                    last.radiance += (1.0 - last.alpha) * own.radiance;
                    last.alpha += (1.0 - last.alpha) * alpha;
                    last.back = back;
                }
                _ => samples.push(own),
            }
        });
        if ground > 0.0 && through > 0.0 {
            let radiance = self.view.lit_ground(ray.at(ground));
            samples.push(DeepSample { front: ground, back: ground, radiance, alpha: 1.0 });
        }
        // One over the unit in which the frame computes.
        let unit = 1.0 / frame.view.per_world;
        for sample in &mut samples {
            (sample.front, sample.back) = (sample.front * unit, sample.back * unit);
        }
        samples
    }
}
