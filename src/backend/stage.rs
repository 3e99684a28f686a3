//! Pictures one after another: a light, a camera or a volume changes, and the rest stays.

use super::Passes;
use crate::error::Result;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, LightView, Media, Scene};
use crate::settings::{MapKind, MapSettings, Settings};
use crate::shadow::Map;

/// What makes pictures one after another. Between two of them it keeps what does not change: the shadow maps while
/// media, lights and how maps are built stay the same, and media on a device while they do. Scenes share their
/// volumes ([`std::sync::Arc`]), so the same volume is known by where it is.
pub trait Stage {
    /// A picture of `scene`: for each of its beams the map, unless it is that of the picture before, then the camera
    /// march. Progress is told where a "shadow map" and a "picture" begin.
    ///
    /// # Errors
    /// If a light cannot be fitted to the volume, if a radiance does not fit f32, or if the device fails or runs out
    /// of memory.
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image>;
}

/// All that a shadow map follows from.
#[derive(Clone, Debug)]
pub struct Cause {
    media: Media,
    view: LightView,
    map: MapSettings,
    quality: f64,
}

impl Cause {
    /// Of the map of `beam`; `kind` is built where `settings` ask for none.
    pub fn of(beam: &Beam, settings: &Settings, kind: MapKind) -> Self {
        let mut map = settings.map.clone();
        map.kind.get_or_insert(kind);
        Self { media: beam.media.clone(), view: beam.view, map, quality: settings.quality }
    }

    /// Whether the same map follows from `other`.
    pub fn same(&self, other: &Self) -> bool {
        self.view == other.view
            && (&self.map, self.quality) == (&other.map, other.quality)
            && self.media.same(&other.media)
    }
}

/// Pictures by passes from and to memory of the host.
pub struct HostStage<'a> {
    passes: &'a dyn Passes,
    /// The maps of the last picture's beams.
    maps: Vec<(Cause, Map)>,
}

impl<'a> HostStage<'a> {
    /// With nothing kept yet.
    pub fn new(passes: &'a dyn Passes) -> Self {
        Self { passes, maps: Vec::new() }
    }

    /// The map of a beam, the `index`th of its scene.
    fn map(
        &mut self,
        index: usize,
        beam: &Beam,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<&Map> {
        let cause = Cause::of(beam, settings, self.passes.default_map());
        if !self.maps.get(index).is_some_and(|(known, _)| known.same(&cause)) {
            // Rather not two at once.
            self.maps.truncate(index);
            let map = self.passes.map(beam, settings, progress)?;
            self.maps.push((cause, map));
        }
        Ok(&self.maps[index].1)
    }
}

impl Stage for HostStage<'_> {
    fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<Image> {
        let [width, height] = settings.image.size;
        let mut image = Image::filled(width, height, [0.0; 4]);
        for (index, beam) in scene.beams()?.iter().enumerate() {
            let passes = self.passes;
            let map = self.map(index, beam, settings, progress)?;
            beam.add(&passes.view(beam, settings, map, progress)?, &mut image);
        }
        scene.check_radiance(&image)?;
        Ok(image)
    }
}
