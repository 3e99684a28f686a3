//! Pictures one after another: a light, a camera or a volume changes, and everything else is kept.

use glam::DVec3;

use super::Passes;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::{Progress, Silent};
use crate::scene::{Beam, LightView, Media, Scene, Surfaces};
use crate::settings::{MapSettings, Settings, Shading};
use crate::shadow::{Map, Shadow};

/// Makes pictures one after another. Between two of them it keeps what does not change: the shadow
/// maps, as long as media, lights and map settings stay the same, and the media on a device, as
/// long as they do. Scenes share their volumes ([`std::sync::Arc`]), so equal volumes are
/// recognised by their address.
pub trait Stage {
    /// The picture of `scene` in linear radiance: for each of its beams the map, unless that of the
    /// previous picture still applies, then the camera march. Progress is reported for each "shadow
    /// map" and "picture".
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if a light cannot be fitted to the
    /// volume, if a radiance does not fit f32, or if the device fails or runs out of memory.
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image>;

    /// Pixels (x, y) of that picture, each with all of its rays, where the picture may have got
    /// fewer, or none of its own. `None` if no pixel of the picture has, or if the stage cannot
    /// tell. Maps that were not kept are built again.
    ///
    /// # Errors
    /// As [`Stage::render`].
    fn pixels(
        &mut self,
        _scene: &Scene,
        _settings: &Settings,
        _pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        Ok(None)
    }
}

/// Everything that a shadow map depends on.
#[derive(Clone, Debug)]
pub struct Cause {
    media: Media,
    surfaces: Surfaces,
    view: LightView,
    /// Tolerances depend on it.
    ratios: DVec3,
    map: MapSettings,
    /// The paper's shading uses other steps.
    shading: Shading,
    quality: f64,
}

impl Cause {
    /// The cause of `beam`'s map.
    pub fn of(beam: &Beam, settings: &Settings) -> Self {
        let mut map = settings.map.clone();
        map.kind.get_or_insert_default();
        let (shading, quality) = (settings.view.shading, settings.quality);
        let (media, surfaces) = (beam.media.clone(), beam.surfaces.clone());
        let (view, ratios) = (beam.view, beam.ratios);
        Self { media, surfaces, view, ratios, map, shading, quality }
    }

    /// Whether `other` results in the same map.
    pub fn same(&self, other: &Self) -> bool {
        (self.view, self.ratios) == (other.view, other.ratios)
            && (&self.map, self.shading, self.quality) == (&other.map, other.shading, other.quality)
            && self.media.same(&other.media)
            && self.surfaces.same(&other.surfaces)
    }
}

/// Makes pictures by passes with input and output in the host's memory.
pub struct HostStage<'a> {
    passes: &'a dyn Passes,
    /// The maps of the last picture's beams, as far as they are small enough to be kept.
    maps: Vec<Option<(Cause, Map)>>,
}

impl<'a> HostStage<'a> {
    /// A stage that holds no maps yet.
    pub fn new(passes: &'a dyn Passes) -> Self {
        Self { passes, maps: Vec::new() }
    }

    /// The map of a beam, which is the `index`th of its scene, and its cause.
    fn map(
        &mut self,
        index: usize,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<(Cause, Map)> {
        let cause = Cause::of(beam, settings);
        let known = self.maps.get_mut(index).and_then(Option::take);
        match known.filter(|(known, _)| known.same(&cause)) {
            Some(known) => Ok(known),
            None => {
                // Avoids holding both maps at once.
                self.maps.truncate(index);
                Ok((cause, self.passes.map(beam, settings, progress)?))
            }
        }
    }

    /// Does `work` through the map of a beam, which is the `index`th of its scene, and keeps the map,
    /// which is as good after work that was cancelled.
    fn through<T>(
        &mut self,
        (index, beam): (usize, &Beam),
        settings: &Settings,
        progress: &dyn Progress,
        work: impl FnOnce(&Map) -> Result<T>,
    ) -> Result<T> {
        let known = self.map(index, beam, settings, progress)?;
        let done = work(&known.1);
        self.keep(index, known);
        done
    }

    /// Keeps a beam's map for the next picture, unless maps would take more bytes
    /// ([`Shadow::bytes`], without what lookups share) than lists may.
    fn keep(&mut self, index: usize, known: (Cause, Map)) {
        let held: u64 = self.maps.iter().flatten().map(|(_, map)| map.bytes()).sum();
        let most = known.0.map.fragments.memory;
        self.maps.resize_with(self.maps.len().max(index + 1), || None);
        self.maps[index] = (held + known.1.bytes() <= most).then_some(known);
    }
}

impl Stage for HostStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        settings.check()?;
        let [width, height] = settings.image.size;
        let mut image = Image::filled(width, height, [0.0; 4]);
        let passes = self.passes;
        for (index, beam) in scene.beams_for(settings)?.iter().enumerate() {
            let view = |map: &Map| passes.view(beam, settings, map, progress);
            beam.add(&self.through((index, beam), settings, progress, view)?, &mut image);
        }
        scene.check_radiance(&image)?;
        Ok(image)
    }

    fn pixels(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        pixels: &[[u32; 2]],
    ) -> Result<Option<Vec<[f32; 4]>>> {
        let beams = scene.beams_for(settings)?;
        let frames = beams.iter().map(|beam| Frame::new(beam, settings));
        let frames: Vec<Frame> = frames.collect::<Result<_>>()?;
        if !frames.iter().any(|frame| frame.view.refines()) {
            return Ok(None);
        }
        let passes = self.passes;
        let mut sum = Image::filled(pixels.len() as u32, 1, [0.0; 4]);
        for (index, (beam, frame)) in beams.iter().zip(&frames).enumerate() {
            let march = |map: &Map| passes.march_pixels(beam.casters(), frame, map, pixels);
            let marched = self.through((index, beam), settings, &Silent, march)?;
            let Some(pixels) = marched else { return Ok(None) };
            beam.add(&Image { pixels, width: sum.width, height: 1 }, &mut sum);
        }
        Ok(Some(sum.pixels))
    }
}
