//! The ground as a shadow catcher: it is not seen, and its shadow is opacity.

use glam::{DVec3, Vec3};

use super::{Backend, Stage};
use crate::error::Result;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Ground, Scene};
use crate::settings::Settings;

/// Makes pictures of scenes in front of nothing in which the ground is invisible but for its
/// shadow: black, with the share of the ground's light that is missing as opacity. In front of a
/// picture of the unshadowed ground they show what a picture with the ground shows. Of coloured
/// shadows it is the mean over the channels.
///
/// Each is made of two: one of media and surfaces without ground, and one of a white ground behind
/// the same, all black. Divided by what the ground would be without media, the second
/// one is what of it arrives.
pub struct ShadowCatcher<'a> {
    media: Box<dyn Stage + 'a>,
    ground: Box<dyn Stage + 'a>,
}

impl<'a> ShadowCatcher<'a> {
    /// A catcher whose pictures `backend` makes.
    pub fn new(backend: &'a dyn Backend) -> Self {
        Self { media: backend.stage(), ground: backend.stage() }
    }
}

impl Stage for ShadowCatcher<'_> {
    /// The picture of `scene` without background and with invisible ground.
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let without = Scene { ground: None, background: None, ..scene.clone() };
        let mut picture = self.media.render(&without, settings, progress)?;
        let Some(ground) = scene.ground else { return Ok(picture) };
        let media = scene.media.black();
        let white = Some(Ground { albedo: 1.0, ..ground });
        let surfaces = scene.surfaces.black();
        let of_ground = Scene { media, surfaces, ground: white, background: None, ..scene.clone() };
        let arriving = self.ground.render(&of_ground, settings, progress)?;
        let [width, height] = settings.image.size.map(f64::from);
        let rays = scene.camera.rays(width / height);
        let pixels = picture.pixels.iter_mut().zip(&arriving.pixels).enumerate();
        for (index, (pixel, &[r, g, b, covered])) in pixels {
            let (x, y) = (index as u32 % picture.width, index as u32 / picture.width);
            let (origin, direction) =
                rays.ray((f64::from(x) + 0.5) / width, (f64::from(y) + 0.5) / height);
            let distance = (ground.height - origin.y) / direction.y;
            if !(distance > 0.0 && distance.is_finite()) {
                continue;
            }
            let at = origin + distance * direction;
            let direct = scene.lights.iter().map(|light| light.on_ground_at(at)).sum::<DVec3>();
            let full = (direct + scene.ambient).as_vec3();
            let share = Vec3::new(r, g, b) / full;
            // Light that does not reach the ground at all leaves no shadow on it.
            let of_channels = share.to_array().into_iter().zip(full.to_array());
            let (sum, count) = of_channels
                .filter(|(_, full)| *full > 0.0)
                .fold((0.0, 0), |(sum, count), (share, _)| (sum + share, count + 1));
            if count > 0 {
                pixel[3] = (covered - sum / count as f32).clamp(pixel[3], covered.max(pixel[3]));
            }
        }
        Ok(picture)
    }
}
