//! What a screen shows of pictures that stay on the window's device.

use deepshadow::Result;
use deepshadow::gpu::{GpuBackend, GpuImage};
use deepshadow::image::Tone;
use deepshadow::wgpu;

use crate::engine::Face;

/// Textures that are filled one after the other, so that the one that is on the screen is not
/// written to.
#[derive(Default)]
pub struct Faces {
    all: Vec<(wgpu::Texture, wgpu::TextureView)>,
    next: usize,
}

/// How many there are: one on the screen, one that is on its way there, and one to be filled.
const COUNT: usize = 3;

impl Faces {
    /// What a screen shows of a picture on the device.
    ///
    /// # Errors
    /// If the device rejects the pass.
    pub async fn show(&mut self, gpu: &GpuBackend, image: &GpuImage, tone: Tone) -> Result<Face> {
        let [width, height] = image.size();
        let device = gpu.renderer().device();
        let index = self.next % COUNT;
        self.next += 1;
        let fits = |(texture, _): &&(wgpu::Texture, wgpu::TextureView)| {
            [texture.width(), texture.height()] == [width, height]
        };
        let view = match self.all.get(index).filter(fits) {
            Some((_, view)) => view.clone(),
            None => {
                let texture = device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("shown"),
                    size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: wgpu::TextureFormat::Rgba8Unorm,
                    usage: wgpu::TextureUsages::STORAGE_BINDING
                        | wgpu::TextureUsages::TEXTURE_BINDING,
                    view_formats: &[],
                });
                let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
                self.all.truncate(COUNT);
                if index < self.all.len() {
                    self.all[index] = (texture, view.clone());
                } else {
                    self.all.push((texture, view.clone()));
                }
                view
            }
        };
        let renderer = gpu.renderer();
        renderer.submit(|encoder| renderer.show_image(encoder, image, tone, &view))?;
        Ok(Face::Texture(view))
    }
}
