//! Camera rays through media whose channels have different extinction, in one march: it follows the
//! channel with the least, and the others' optical depths are multiples of its.

use glam::{Vec3, Vec4};

use super::march_view::{Batch, Steps, View};
use crate::kernel::exponential::four_transmitted;
use crate::kernel::light::light_coordinates;
use crate::kernel::media::{Arriving, Piece, arriving_over, emission_along, source_along};
use crate::kernel::medium::{SMALLEST_WEIGHT, mean_transmittance};
use crate::kernel::occupancy::BATCH;
use crate::kernel::ray::Ray;
use crate::math::Each;

impl View<'_> {
    /// What a ray sees, over the ground at distance `ground` if that is above 0. Opacity is the
    /// mean over the channels.
    pub(super) fn march_colours(&self, ray: &Ray, steps: &Steps, ground: f32) -> Vec4 {
        let mut light = Vec3::ZERO;
        let through = self.scatter(ray, steps, |added| light += added.radiance);
        let through = if through > 0.0 { self.colours(through) } else { Vec3::ZERO };
        let behind = self.behind(ray, ground);
        let covered = 1.0 - through.element_sum() / 3.0;
        (light + through * behind.truncate()).extend(covered + (1.0 - covered) * behind.w)
    }

    /// Transmittances of the channels where that of the least extinct one is `through`.
    pub(super) fn colours(&self, through: f32) -> Vec3 {
        let optical_depth = -through.max(SMALLEST_WEIGHT).ln();
        four_transmitted((optical_depth * self.frame.media.ratios).extend(0.0)).truncate()
    }

    /// The shares of the channels' light that a step adds, which takes the share `weight` of the
    /// light of the least extinct one, of which `before` is left in front of it.
    pub(super) fn share_of_colours(&self, before: f32, weight: f32) -> Vec3 {
        self.colours(before) - self.colours(before - weight)
    }

    /// Radiance that the piece of a ray within `half` of distance `at` sends to the camera per unit
    /// of opacity, in each channel.
    pub(super) fn source_of_colours(
        &self,
        (ray, light): (&Ray, &Arriving),
        index_ray: &Ray,
        [at, half]: [f32; 2],
    ) -> Vec3 {
        let parallel = self.frame.light.spread == 0;
        let light = if parallel { *light } else { arriving_over(self.frame, ray, [at, half]) };
        let transmittances = self.colours_at(light_coordinates(self.frame, ray.at(at)));
        let piece = Piece { ray: index_ray, at, half };
        let source = |transmittance: f32| {
            source_along(&self.sampler, self.frame, &piece, &light, transmittance)
        };
        if self.frame.view.octaves == 0 {
            // Single scattering is linear in transmittance.
            let dark = source(0.0);
            return dark + transmittances * (source(1.0) - dark);
        }
        Vec3::from_array([0, 1, 2].each(|channel| source(transmittances[channel])[channel]))
    }

    /// [`View::emitted`] for each channel. `before` is the transmittance of the least extinct one.
    pub(super) fn emitted_colours(&self, batch: &Batch<'_>, before: f32, taus: [Vec4; 2]) -> Vec3 {
        let half = 0.25 * batch.step;
        let ratios = self.frame.media.ratios;
        let (mut sum, mut through) = (Vec3::ZERO, self.colours(before));
        for k in 0..2 * BATCH as usize {
            let piece = Piece { ray: batch.ray, at: batch.sample(k), half };
            let tau = taus[k / 4][k % 4] * ratios;
            let seen = through * tau.map(mean_transmittance) * 2.0 * half;
            sum += emission_along(&self.sampler, &piece) * seen;
            through *= four_transmitted(tau.extend(0.0)).truncate();
        }
        sum
    }

    /// Transmittances at (u, v, depth).
    pub(super) fn colours_at(&self, light: Vec3) -> Vec3 {
        self.map.lookup_colours(self.frame.map.window, light, self.frame.media.ratios)
    }
}
