//! The parameters of one picture in f32, which both backends use, in the layout that the shaders
//! read (`shaders/kernel/frame.wgsl`). They are computed once from a scene in f64, so that a
//! difference between backends cannot come from the set-up. Knows no backend.
//!
//! Positions are in *frame space*. That is world space moved so that the volume's centre is the
//! origin, which keeps f32 accurate for volumes far from the world's origin. Its unit is
//! [`crate::scene::Media::unit`], which differs from a world length for tiny or huge media. Lengths
//! and depths in this module have that unit.

mod fill;
mod lattice;
mod looks;
mod mixture;
mod parts;
mod pixels;
mod seen;
mod steps;
mod surfaces;

use bytemuck::{Pod, Zeroable};

use crate::error::{Error, Result};
use crate::scene::{Beam, Casters, Media};
use crate::settings::{Settings, Shading};
use fill::{Space, tolerance};
pub use looks::{FrameCoat, FrameLooks};
pub use mixture::{
    FARTHEST_CELL, Field, LEAST_CELLS, MOST_FIELDS, MOST_PARTS, Mixture, Part, TABLE_CELLS,
};
pub use parts::{FrameGround, FrameLight, FrameMap, FrameMedia, FrameView, Marching};
pub use pixels::{CELLS, cells_around, pixel_offset};
pub use steps::{
    LIGHT_STEPS_LEAST, LIGHT_STEPS_PER_VOXEL, LOOKUP_WEIGHT, SLAB_SAMPLES_PER_VOXEL,
    SLABS_PER_VOXEL, VIEW_STEPS_LEAST, VIEW_STEPS_MOST, VIEW_STEPS_PER_VOXEL,
};
use steps::{UNLIMITED, marching};
pub use surfaces::{FIRST_SEGMENT, FrameSurfaces, LAST_SEGMENT, OPAQUE, SEGMENT_POINT};

/// Largest optical depth over the media's diagonal, so that sums fit f32.
const MOST_OPTICAL_DEPTH: f64 = 1e30;

/// The parameters of a frame, in uniform-buffer layout.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// The media's properties and position.
    pub media: FrameMedia,
    /// The light.
    pub light: FrameLight,
    /// The picture.
    pub view: FrameView,
    /// The shadow map.
    pub map: FrameMap,
}

impl Frame {
    /// Checks that pictures can show surfaces.
    ///
    /// # Errors
    /// If shading is the paper's, which has no place for them.
    pub fn check_surfaces(&self) -> Result<()> {
        if self.view.shading == 1 {
            let why = "the paper's shading shows no meshes and no hair";
            return Err(Error::value("shadow.shading", why));
        }
        Ok(())
    }

    /// Whether pictures need only parallel light, the default lookup, the bilinear filter, exact
    /// shadow tests and single scattering.
    pub fn is_usual(&self) -> bool {
        let (view, map) = (&self.view, &self.map);
        map.lookup == 0
            && map.window == 0
            && view.shading == 0
            && map.sharpness == 0.0
            && view.octaves == 0
            && map.surface_reach == 0.0
            && self.light.spread == 0
    }

    /// The frame of `beam` under `settings`.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if a scene is too large or too far
    /// away for f32, or if the paper's shading is requested for a light among the media.
    pub fn new(beam: &Beam, settings: &Settings) -> Result<Self> {
        settings.check()?;
        let media = &beam.media;
        if settings.view.shading == Shading::Paper && beam.view.face.is_some() {
            let why = "the paper's shading does not support lights in the volume or next to it";
            return Err(Error::value("light", why));
        }
        let space = Space::of(beam.casters());
        // Steps are short enough for the channel with the most extinction.
        let thickest = beam.thickest();
        let [rays, slabs, march] = marching(&thickest, settings, tolerance(settings));
        let mut frame = Self {
            media: space.media(media, beam.ratios),
            light: space.light(&beam.light, &beam.view),
            view: space.view(beam, &thickest, settings, march),
            map: space.map(&thickest, settings, &beam.view, [rays, slabs]),
        };
        frame.divide_limits(beam.ratios.max_element() as f32);
        frame.checked(&thickest)
    }

    /// Divides limits on optical depth and transmittance, so that the channel that has `ratio`
    /// times the extinction keeps them: d(T^r) is at most r dT.
    fn divide_limits(&mut self, ratio: f32) {
        let (map, view) = (&mut self.map, &mut self.view);
        for limit in [
            &mut map.rays.limit,
            &mut map.slabs.limit,
            &mut map.tolerance,
            &mut map.truncation,
            &mut view.march.limit,
            &mut view.shared_weight,
        ] {
            *limit /= ratio;
        }
    }

    /// The same frame, if its numbers fit f32.
    fn checked(self, media: &Media) -> Result<Self> {
        // Read as floats, integers up to some millions are tiny numbers, so they pass.
        let numbers: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&self));
        let finite = numbers.iter().all(|number| number.is_finite());
        if !finite {
            return Err(Error::value("scene", "a length or factor in it does not fit in f32"));
        }
        let thickest = media.densest() * media.world_bounds().size().length();
        if thickest <= MOST_OPTICAL_DEPTH {
            Ok(self)
        } else {
            let why = format!("an optical depth of up to {thickest:e} does not fit in f32");
            Err(Error::value("density scale", why))
        }
    }

    /// The same frame with a domain that holds the surfaces of `casters` too that cast shadows: between its ends along
    /// a ray lies all that casts a shadow on it. Media are marched within their own domain.
    #[must_use]
    pub fn around(mut self, casters: Casters<'_>) -> Self {
        if let Some(surfaces) = casters.surfaces.casting().world_bounds() {
            let own = surfaces.transformed(&casters.media.world_from_index().inverse());
            // Rounding must not leave out what touches the box.
            let slack = (1e-5 * own.size().max_element()) as f32;
            let (min, max) = (own.min.as_vec3() - slack, own.max.as_vec3() + slack);
            let media = &mut self.media;
            if casters.media_count() {
                (media.domain_min, media.domain_max) =
                    (media.domain_min.min(min), media.domain_max.max(max));
            } else {
                (media.domain_min, media.domain_max) = (min, max);
            }
        }
        self
    }

    /// The same frame with slabs of their shortest length, all of which are kept.
    #[must_use]
    pub fn with_all_slabs(mut self) -> Self {
        (self.map.tolerance, self.map.truncation) = (0.0, 0.0);
        // Quality determines the number of samples instead.
        let slabs = &mut self.map.slabs;
        let quality = slabs.samples / SLAB_SAMPLES_PER_VOXEL;
        (slabs.per_voxel, slabs.rough) = (quality * SLABS_PER_VOXEL, 0.0);
        self
    }

    /// Makes light rays take exactly `count` steps of equal length.
    pub fn take_light_steps(&mut self, count: u32) {
        self.map.rays.take(count);
        self.map.slabs.take(count);
    }

    /// Makes camera rays take exactly `count` steps of equal length.
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
