//! What camera rays meet behind media and surfaces: the ground, or the background.

use glam::{Vec3, Vec4};

use super::march_view::View;
use crate::kernel::light::light_coordinates;
use crate::kernel::ray::Ray;
use crate::kernel::view::{ground_radiance, surface_depth};

/// How far a ray can see that meets the ground at distance `ground`, if that is above 0.
pub(super) fn farthest(ground: f32) -> f32 {
    if ground > 0.0 { ground } else { f32::INFINITY }
}

impl View<'_> {
    /// What is behind everything: the ground at distance `ground` if that is above 0, else the
    /// background.
    pub(super) fn behind(&self, ray: &Ray, ground: f32) -> Vec4 {
        if ground <= 0.0 {
            return self.frame.view.background;
        }
        let point = ray.at(ground);
        let lit = if self.frame.media.coloured == 1 {
            self.lit_ground_of_colours(point)
        } else {
            self.lit_ground(point)
        };
        lit.extend(1.0)
    }

    /// Radiance of the ground at a point.
    pub(super) fn lit_ground(&self, point: Vec3) -> Vec3 {
        let mut light = light_coordinates(self.frame, point);
        light.z = surface_depth(self.frame, light);
        ground_radiance(self.frame, point, self.lookup(light))
    }

    /// [`View::lit_ground`] in each channel.
    fn lit_ground_of_colours(&self, point: Vec3) -> Vec3 {
        let mut light = light_coordinates(self.frame, point);
        light.z = surface_depth(self.frame, light);
        let transmittances = self.colours_at(light);
        let dark = ground_radiance(self.frame, point, 0.0);
        dark + transmittances * (ground_radiance(self.frame, point, 1.0) - dark)
    }
}
