//! The GPU backend: the passes as wgpu compute shaders (Vulkan, Metal, DX12), on its own device or on
//! a caller's. Never imports `kernel`, so that a GPU answer cannot come from the CPU.
//!
//! ```text
//! Volume --upload--> GpuVolume ---+
//! Frame  --frame---> GpuFrame ----+--trace_threshold--> GpuMap ---+
//!                                 +-------------------------------+--march_view--> GpuImage
//! ```

mod adapter;
mod link;
mod renderer;
mod volume;

use crate::backend::Backend;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Progress;
use crate::shadow::{ShadowMap, ThresholdMap};
use crate::volume::Volume;
pub use adapter::{AdapterChoice, adapters};
pub use link::{linked, shadow_wgsl};
pub use renderer::{GpuFrame, GpuImage, GpuMap, Renderer};
pub use volume::GpuVolume;

/// Shader roots, one a pass: its name, which is the entry point's, and its source with imports.
pub const PASSES: [(&str, &str); 2] = [
    ("trace_threshold", include_str!("../../shaders/trace_threshold.wgsl")),
    ("march_view", include_str!("../../shaders/march_view.wgsl")),
];

/// Renders on a graphics adapter, from and to memory of the host.
#[derive(Debug)]
pub struct GpuBackend {
    renderer: Renderer,
    description: String,
}

impl GpuBackend {
    /// Opens a device of its own.
    ///
    /// # Errors
    /// If there is no such adapter or it refuses.
    pub fn open(choice: AdapterChoice) -> Result<Self> {
        let (device, queue, description) = adapter::open(choice)?;
        Ok(Self { renderer: Renderer::new(&device, &queue)?, description })
    }

    /// The renderer behind it, which works on textures of the device.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }
}

impl Backend for GpuBackend {
    fn description(&self) -> String {
        self.description.clone()
    }

    fn trace_threshold(
        &self,
        volume: &Volume,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Vec<[f32; 4]>> {
        progress.begin("shadow map", 1);
        let gpu = &self.renderer;
        let volume = gpu.upload(volume)?;
        let frame_buffer = gpu.frame(frame, &volume)?;
        let map = gpu.map(frame.sizes[3])?;
        gpu.submit(|encoder| gpu.trace_threshold(encoder, &volume, &frame_buffer, &map))?;
        let texels = gpu.read(map.texture())?;
        progress.advance(1);
        Ok(texels)
    }

    fn march_view(
        &self,
        volume: &Volume,
        frame: &Frame,
        map: &ThresholdMap,
        progress: &dyn Progress,
    ) -> Result<Image> {
        progress.begin("picture", 1);
        let gpu = &self.renderer;
        let volume = gpu.upload(volume)?;
        let frame_buffer = gpu.frame(frame, &volume)?;
        let gpu_map = gpu.map(map.size())?;
        gpu.write(&gpu_map, map.texels());
        let [width, height, ..] = frame.sizes;
        let image = gpu.image(width, height)?;
        gpu.submit(|encoder| {
            gpu.march_view(encoder, &volume, &frame_buffer, &gpu_map, &image);
        })?;
        let pixels = gpu.read(image.texture())?;
        progress.advance(1);
        Ok(Image { width, height, pixels })
    }
}
