//! Pictures by a GPU, for the thread that draws, which may wait for them.

use deepshadow::backend::Stage;
use deepshadow::gpu::{GpuBackend, GpuImage, GpuStage};
use deepshadow::image::Image;
use deepshadow::progress::Progress;
use deepshadow::{Backend, Result, Scene, Settings, Silent};

/// The picture of `scene`, read back.
///
/// # Errors
/// As [`Stage::render`].
pub async fn render(
    stage: &mut GpuStage<'static>,
    scene: &Scene,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Image> {
    stage.render(scene, settings, progress)
}

/// The picture of `scene` on the device.
///
/// # Errors
/// As [`Stage::render`].
pub async fn draw(
    stage: &mut GpuStage<'static>,
    scene: &Scene,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<GpuImage> {
    stage.draw(scene, settings, progress)
}

/// Draws a picture of some pixels, so that the driver compiles what a larger one needs.
///
/// # Errors
/// As a picture.
pub fn warm_up(gpu: &GpuBackend, scene: &Scene, settings: &Settings) -> Result<()> {
    // Moving pictures have one ray a pixel.
    for samples in [settings.image.samples, 1] {
        let small = settings.with(|settings| {
            (settings.image.size, settings.image.samples) = ([16, 8], samples);
            settings.map.size = settings.map.size.min(16);
        });
        gpu.render(scene, &small, &Silent)?;
    }
    Ok(())
}
