//! What a renderer does: the passes both backends implement, their inputs and outputs.

use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{LightView, Scene};
use crate::settings::Settings;
use crate::shadow::ThresholdMap;
use crate::volume::Volume;

/// A renderer. The passes have the same names in every backend and in `shaders/`.
pub trait Backend {
    /// What does the work, for people: the processor or the graphics adapter.
    fn description(&self) -> String;

    /// Pass `trace_threshold`: marches from the light through every texel of a map. Texels are
    /// `size * size`, row 0 at v = 0.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn trace_threshold(
        &self,
        volume: &Volume,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>>;

    /// Pass `march_view`: marches every camera ray through the volume, lit through `map`.
    ///
    /// # Errors
    /// If the device fails or runs out of memory.
    fn march_view(
        &self,
        volume: &Volume,
        frame: &Frame,
        map: &ThresholdMap,
        progress: &dyn Progress,
    ) -> Result<Image>;

    /// The threshold map of `scene`.
    ///
    /// # Errors
    /// As [`Backend::trace_threshold`], and if the light cannot be fitted to the volume.
    fn map(
        &self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<ThresholdMap> {
        let view = LightView::fit(&scene.light, &scene.volume)?;
        let frame = Frame::with_light_view(scene, settings, &view)?;
        let texels = self.trace_threshold(&scene.volume, &frame, progress)?;
        Ok(ThresholdMap::new(texels, settings, view, &frame))
    }

    /// A picture of `scene`: its map, then the camera march.
    ///
    /// # Errors
    /// As the two passes.
    fn render(
        &self,
        scene: &Scene,
        settings: &Settings,
        progress: &dyn Progress,
    ) -> Result<(Image, ThresholdMap)> {
        let map = self.map(scene, settings, progress)?;
        let frame = Frame::with_light_view(scene, settings, map.view())?;
        let image = self.march_view(&scene.volume, &frame, &map, progress)?;
        Ok((image, map))
    }
}
