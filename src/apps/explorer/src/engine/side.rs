//! One of the scenes that are drawn side by side: what was loaded for it, its stages, and what was
//! drawn last.

use std::sync::Arc;
use std::time::Duration;

use deepshadow::backend::Stage;
use deepshadow::gpu::GpuStage;
use deepshadow::image::{Exposure, Image, Tone, ToneMap};
use deepshadow::io::SceneLoader;
use deepshadow::scene::automatic::{Loaded, Surroundings, complete};
use deepshadow::scene::{Media, SceneFile};
use deepshadow::{Result, Scene, Settings};
use eframe::egui;
use web_time::Instant;

use super::devices::Devices;
use super::pace::{Motion, Pace, Times};
use super::progress::Watch;
use super::{OfVolume, Seen};
use crate::host::Faces;
use crate::panels::{Known, known, points_of};

/// A scene that is drawn again and again.
pub struct Side {
    /// The number of the document.
    pub document: Option<u64>,
    pub loader: SceneLoader,
    pub cpu: Box<dyn Stage>,
    pub gpu: Option<GpuStage<'static>>,
    /// What is shown of pictures that stay on the device.
    pub faces: Faces,
    pub pace: Pace,
    /// The scene file for which the last map was made, with the map's size and quality.
    pub map_of: Option<(SceneFile, u32, f64)>,
    /// The last whole picture and what it is of.
    pub whole: Option<Whole>,
    /// The file for which any picture was drawn last.
    pub drawn: Option<Key>,
    /// How the last picture was shown.
    pub tone: Tone,
    /// Whether that is how a whole picture was shown, so that it stays while something moves.
    pub steady: bool,
    last_media: Option<Media>,
    /// The histograms of volumes.
    pub histograms: Vec<Known>,
}

impl Side {
    /// Takes what was loaded for a document. Of another one nothing is kept.
    pub fn take(&mut self, document: u64, loader: SceneLoader, histograms: Vec<Known>) {
        if self.document != Some(document) {
            (self.map_of, self.whole, self.drawn) = (None, None, None);
            self.steady = false;
            self.document = Some(document);
        }
        (self.loader, self.histograms) = (loader, histograms);
    }
}

/// A whole picture.
#[derive(Clone)]
pub struct Whole {
    pub key: Key,
    pub image: Arc<Image>,
    /// What drew it.
    pub device: String,
    /// Texels along the edge of its maps.
    pub map_size: u32,
}

/// What pixels of a picture depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    file: SceneFile,
    surroundings: Surroundings,
    size: [u32; 2],
    device: super::Device,
}

impl Key {
    /// Of a scene file; how radiance is shown is no part of it.
    pub fn of(file: &SceneFile, wish: &super::Wish) -> Self {
        let mut file = file.clone();
        (file.image.exposure, file.image.tonemap) = (None, None);
        let super::Wish { surroundings, size, device, .. } = *wish;
        Self { file, surroundings, size, device }
    }
}

/// A scene with everything that was left out.
#[derive(Clone)]
pub struct Completed {
    pub seen: Arc<Seen>,
    pub scene: Arc<Scene>,
    pub settings: Arc<Settings>,
    pub volumes: Arc<Vec<OfVolume>>,
}

impl Side {
    pub fn new() -> Self {
        Self {
            document: None,
            histograms: Vec::new(),
            loader: SceneLoader::default(),
            cpu: Devices::cpu().stage(),
            gpu: None,
            faces: Faces::default(),
            pace: Pace::default(),
            map_of: None,
            whole: None,
            drawn: None,
            tone: Tone::new(1.0, ToneMap::None),
            steady: false,
            last_media: None,
        }
    }

    /// Completes `file` for a picture of `size`.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn complete(
        &mut self,
        file: &SceneFile,
        loaded: Loaded,
        (size, surroundings): ([u32; 2], Surroundings),
    ) -> Result<Completed> {
        let volumes = loaded.volumes.iter().map(|own| OfVolume {
            window: own.window,
            points: own.function.as_ref().map(points_of),
            histogram: known(&self.histograms, &own.volume),
        });
        let volumes = volumes.collect();
        let mut sized = file.clone();
        (sized.image.width, sized.image.height) = (Some(size[0]), Some(size[1]));
        let (mut scene, settings, _) = complete(&sized, loaded, surroundings)?;
        // What is known of equal media, such as where they are empty, is kept.
        match &self.last_media {
            Some(known) if known.same(&scene.media) => scene.media = known.clone(),
            _ => self.last_media = Some(scene.media.clone()),
        }
        Ok(Completed {
            seen: Arc::new(Seen::of(&scene)),
            scene: Arc::new(scene),
            settings: Arc::new(settings),
            volumes: Arc::new(volumes),
        })
    }

    /// The settings of a picture that is drawn while something moves. A map that still applies is
    /// kept, however fine it is.
    pub fn hurried(&self, file: &SceneFile, settings: &Settings, motion: Motion) -> Settings {
        let [picture, map] = self.pace.shares();
        let mut hurried = settings.clone();
        hurried.image.size = settings.image.size.map(|n| part(n, picture, 8));
        hurried.image.samples = 1;
        hurried.image.tolerance = settings.image.tolerance.max(0.02);
        match &self.map_of {
            Some((of, size, quality)) if motion == Motion::Camera && *of == of_map(file) => {
                (hurried.map.size, hurried.quality) = (*size, *quality);
            }
            _ => {
                hurried.map.size = part(settings.map.size, map, 32);
                if map < 0.7 {
                    hurried.quality = (0.5 * settings.quality).max(0.125);
                }
            }
        }
        hurried
    }

    /// How `image` is shown. While something moves the last choices stay, so that nothing flickers.
    ///
    /// # Errors
    /// If the file has no such exposure or curve.
    pub fn tone_of(&self, file: &SceneFile, image: &Image, whole: bool) -> Result<Tone> {
        if !whole && self.steady {
            return self.same_tone(file);
        }
        Ok(Tone::for_picture(image, file.image.exposure()?, file.image.tone_map()?))
    }

    /// How a picture is shown whose pixels are not known: as the last one, unless the file says how.
    ///
    /// # Errors
    /// If the file has no such exposure or curve.
    pub fn same_tone(&self, file: &SceneFile) -> Result<Tone> {
        let exposure = match file.image.exposure()? {
            Exposure::Factor(factor) => factor as f32,
            _ => self.tone.exposure,
        };
        Ok(Tone::new(exposure, file.image.tone_map()?.unwrap_or(self.tone.map)))
    }
}

/// A share of a number of pixels or texels, but no fewer than `least` of them.
fn part(n: u32, share: f64, least: u32) -> u32 {
    ((f64::from(n) * share).round() as u32).max(least.min(n)).max(1)
}

/// What of a scene file maps depend on.
pub fn of_map(file: &SceneFile) -> SceneFile {
    let mut file = file.clone();
    file.camera = Default::default();
    file.image = Default::default();
    (file.background, file.ambient) = (Default::default(), Default::default());
    file.ground = Default::default();
    file
}

/// How long the parts of a picture took.
pub fn times_of(watch: &Watch<'_>) -> Times {
    let [map, grid, view] =
        ["shadow map", "shadow grid", "picture"].map(|what| watch.seconds(what));
    Times { map: map + grid, view, ..Times::default() }
}

/// What a screen shows of `image`, and how long that took.
pub fn on_screen(image: &Image, tone: Tone) -> (egui::ColorImage, Duration) {
    let begun = Instant::now();
    let size = [image.width as usize, image.height as usize];
    let bytes = image.to_srgb8(tone);
    (egui::ColorImage::from_rgba_unmultiplied(size, &bytes), begun.elapsed())
}
