//! The camera's view as a deep image: media, surfaces and the ground along each pixel's central ray,
//! each piece with its distances, so that compositing programs can insert objects between them.

use glam::Vec3;

use super::ground::farthest;
use super::layers::Layer;
use super::march_view::View;
use super::raster_view::ViewRaster;
use super::tiles;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::media::Sampler;
use crate::kernel::ray::Ray;
use crate::kernel::view::ground_distance;
use crate::scene::Casters;
use crate::shadow::Map;

/// Adjacent steps are merged into one sample up to this opacity.
const MERGED_OPACITY: f32 = 1.0 / 64.0;

/// Smallest share of a sample that is cut off.
const LEAST_SHARE: f32 = 1e-6;

/// A piece of a pixel's ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepSample {
    /// Distance in world lengths, from the camera's origin along the ray, where it begins.
    pub front: f32,
    /// Distance in world lengths where it ends; equal to `front` for surfaces.
    pub back: f32,
    /// Radiance that it sends to the camera, without attenuation by pieces in front of it
    /// (premultiplied by its opacity).
    pub radiance: Vec3,
    /// Its own opacity, 0..1.
    pub alpha: f32,
}

/// A camera's view of a scene through its shadow map, row by row.
pub struct DeepView<'a> {
    view: View<'a>,
    surfaces: Option<ViewRaster>,
}

impl<'a> DeepView<'a> {
    /// The view of `casters`, which may be media alone, with the parameters `frame`, lit through
    /// `map`. Rays go through the centres of pixels, and shading is single scattering. Strands cover
    /// parts of pixels, and triangles as many as the frame's samples of a pixel meet.
    ///
    /// # Errors
    /// If surfaces take too much memory.
    pub fn new(casters: impl Into<Casters<'a>>, frame: &'a Frame, map: &'a Map) -> Result<Self> {
        let casters = casters.into();
        let surfaces = ViewRaster::new(casters, frame)?;
        Ok(Self { view: View { sampler: Sampler::of(casters.media), frame, map }, surfaces })
    }

    /// The samples of the pixels of row `y`, 0 on top: of each pixel from front to back and without
    /// overlap. Adjacent steps of the march are merged into one sample as long as it takes less than
    /// 1/64 of the light.
    pub fn row(&self, y: u32) -> Vec<Vec<DeepSample>> {
        let frame = self.view.frame;
        let tiles = tiles::columns(frame.view.width as usize).map(|columns| {
            let layers = match &self.surfaces {
                Some(raster) => self.view.layers_of_row(raster, &columns, y as usize),
                None => Vec::new(),
            };
            let pixel = |(i, x): (usize, usize)| {
                let ray = self.view.ray([x, y as usize], [0, 1]);
                let ground = ground_distance(frame, &ray);
                match layers.get(i) {
                    Some((layers, clear, end)) => {
                        self.samples((&ray, ground), layers, (*clear, *end))
                    }
                    None => self.samples((&ray, ground), &[], (1.0, farthest(ground))),
                }
            };
            columns.clone().enumerate().map(pixel).collect::<Vec<_>>()
        });
        tiles.flatten().collect()
    }

    /// The samples along a ray, which meets the ground at distance `ground` if that is above 0: of
    /// the medium up to `end`, of `layers`, and of the ground if they leave it `clear`.
    fn samples(
        &self,
        (ray, ground): (&Ray, f32),
        layers: &[Layer],
        (clear, end): (f32, f32),
    ) -> Vec<DeepSample> {
        let frame = self.view.frame;
        let steps = self.view.steps(ray, end);
        let mut samples: Vec<DeepSample> = Vec::new();
        let through = self.view.scatter(ray, &steps, |added| {
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
        if !layers.is_empty() {
            samples = with_layers(&samples, layers);
        }
        if ground > 0.0 && through > 0.0 && clear > 0.0 {
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

/// The samples of a medium and the layers among them, in order. Samples are cut at the layers.
fn with_layers(medium: &[DeepSample], layers: &[Layer]) -> Vec<DeepSample> {
    let mut all = Vec::with_capacity(medium.len() + 2 * layers.len());
    let mut layers = layers.iter().peekable();
    let surface = |layer: &Layer| DeepSample {
        front: layer.depth,
        back: layer.depth,
        radiance: layer.alpha() * layer.radiance,
        alpha: layer.alpha(),
    };
    for sample in medium {
        let mut rest = *sample;
        while let Some(layer) = layers.next_if(|layer| layer.depth < rest.back) {
            if layer.depth > rest.front {
                let share = (layer.depth - rest.front) / (rest.back - rest.front);
                let share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
                let [before, behind] = [share, 1.0 - share].map(|share| part(&rest, share));
                all.push(DeepSample { back: layer.depth, ..before });
                rest = DeepSample { front: layer.depth, ..behind };
            }
            all.push(surface(layer));
        }
        all.push(rest);
    }
    all.extend(layers.map(surface));
    all
}

/// A share of a sample's length.
fn part(sample: &DeepSample, share: f32) -> DeepSample {
    let alpha = -(share * (-sample.alpha).ln_1p()).exp_m1();
    let of_light = if sample.alpha > 0.0 { alpha / sample.alpha } else { share };
    DeepSample { radiance: sample.radiance * of_light, alpha, ..*sample }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples composited over each other are the whole.
    #[test]
    fn samples_are_cut_without_a_trace() {
        let one = |front: f32, back: f32, alpha: f32| DeepSample {
            front,
            back,
            radiance: Vec3::splat(0.3 * alpha),
            alpha,
        };
        let layer = |depth: f32| Layer { depth, weight: 0.0, clear: 1.0, radiance: Vec3::ZERO };
        let medium = [one(1.0, 2.0, 0.75), one(2.0, 3.0, 1.0)];
        let cut = with_layers(&medium, &[0.5, 1.5, 1.75, 2.0, 2.5, 9.0].map(layer));
        let over = |samples: &[DeepSample]| {
            samples.iter().fold((0.0, 1.0), |(light, through), sample| {
                (light + through * sample.radiance.x, through * (1.0 - sample.alpha))
            })
        };
        assert_eq!(cut.len(), 11);
        assert!(cut.is_sorted_by(|a, b| a.back <= b.front));
        let (whole, parts) = (over(&medium), over(&cut));
        assert!((whole.0 - parts.0).abs() < 1e-6 && (whole.1 - parts.1).abs() < 1e-6);
    }
}
