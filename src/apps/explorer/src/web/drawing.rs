//! Pictures by a GPU, for a worker, which must not wait for them.

use deepshadow::gpu::{GpuBackend, GpuImage, GpuStage};
use deepshadow::image::{Image, Tone};
use deepshadow::progress::Progress;
use deepshadow::{Result, Scene, Settings};
use eframe::egui;

use crate::engine::Face;

/// What is shown of pictures; nothing of it stays on the device, which is not the window's.
#[derive(Default)]
pub struct Faces;

impl Faces {
    /// What a screen shows of a picture on the device.
    ///
    /// # Errors
    /// If the device rejects the pass or fails.
    pub async fn show(&mut self, gpu: &GpuBackend, image: &GpuImage, tone: Tone) -> Result<Face> {
        let size = image.size().map(|n| n as usize);
        let bytes = gpu.renderer().shown_async(image, tone).await?;
        Ok(Face::Pixels(egui::ColorImage::from_rgba_unmultiplied(size, &bytes)))
    }
}

/// The picture of `scene`, read back.
///
/// # Errors
/// As [`GpuStage::render_async`].
pub async fn render(
    stage: &mut GpuStage<'static>,
    scene: &Scene,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Image> {
    stage.render_async(scene, settings, progress).await
}

/// The picture of `scene` on the device.
///
/// # Errors
/// As [`GpuStage::draw_async`].
pub async fn draw(
    stage: &mut GpuStage<'static>,
    scene: &Scene,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<GpuImage> {
    stage.draw_async(scene, settings, progress).await
}

/// Nothing: a browser compiles while its worker goes on.
///
/// # Errors
/// None.
pub fn warm_up(_gpu: &GpuBackend, _scene: &Scene, _settings: &Settings) -> Result<()> {
    Ok(())
}
