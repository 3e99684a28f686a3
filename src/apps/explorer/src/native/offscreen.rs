//! A window that nobody sees: the same contents, drawn into a texture.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use deepshadow::gpu::GpuBackend;
use deepshadow::image::{Image, ToneMap, linear_from_srgb};
use deepshadow::io::{Inputs, PendingFile, PictureFormat, PictureOptions};
use deepshadow::wgpu::{self, TextureFormat};
use deepshadow::{Error, Result};
use eframe::egui::{self, FullOutput, RawInput, Ui};
use eframe::egui_wgpu::{
    RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup,
    WgpuSetupCreateNew,
};

/// How a window's device is made: with everything that the passes use.
pub fn setup(display: Option<WgpuSetup>) -> WgpuSetup {
    let setup = display
        .unwrap_or_else(|| WgpuSetup::CreateNew(WgpuSetupCreateNew::without_display_handle()));
    match setup {
        WgpuSetup::CreateNew(mut new) => {
            let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
            new.instance_descriptor.backends = backends;
            new.power_preference = wgpu::PowerPreference::HighPerformance;
            new.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
                label: Some("deepshadow explorer"),
                required_features: GpuBackend::features(adapter),
                required_limits: GpuBackend::limits(adapter),
                ..Default::default()
            });
            WgpuSetup::CreateNew(new)
        }
        existing @ WgpuSetup::Existing(_) => existing,
    }
}

/// A window that nobody sees.
pub struct OffScreen {
    /// The device on which it is drawn.
    pub screen: RenderState,
    /// Its egui context.
    pub context: egui::Context,
    size: [f32; 2],
    scale: f32,
    frames: u64,
}

impl OffScreen {
    /// One of a size in points, with `scale` pixels for each.
    ///
    /// # Errors
    /// If there is no graphics adapter; software is enough.
    pub fn new(size: [f32; 2], scale: f32) -> Result<Self> {
        let setup = setup(None);
        let instance = pollster::block_on(setup.new_instance());
        let configuration = WgpuConfiguration { wgpu_setup: setup, ..Default::default() };
        let made = RenderState::create(&configuration, &instance, None, RendererOptions::default());
        let screen = pollster::block_on(made).map_err(|error| Error::gpu(error.to_string()))?;
        let context = egui::Context::default();
        // Nobody is there to watch things move.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        Ok(Self { screen, context, size, scale, frames: 0 })
    }

    /// Its size in points.
    pub fn resize(&mut self, size: [f32; 2]) {
        self.size = size;
    }

    /// Runs one frame of `contents`, with what hands do.
    pub fn frame(&mut self, events: Vec<egui::Event>, contents: impl FnMut(&mut Ui)) -> FullOutput {
        self.frames += 1;
        let rect = egui::Rect::from_min_size(egui::Pos2::ZERO, self.size.into());
        let mut input = RawInput {
            screen_rect: Some(rect),
            time: Some(self.frames as f64 / 60.0),
            events,
            focused: true,
            ..RawInput::default()
        };
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let mut output = self.context.run_ui(input, contents);
        let mut renderer = self.screen.renderer.write();
        for (id, images) in output.textures_delta.set.drain() {
            for image in images {
                renderer.update_texture(&self.screen.device, &self.screen.queue, id, &image);
            }
        }
        for id in output.textures_delta.free.drain() {
            renderer.free_texture(&id);
        }
        drop(renderer);
        output
    }

    /// What is seen after a frame.
    ///
    /// # Errors
    /// If the device fails.
    pub fn seen(&self, output: FullOutput) -> Result<egui::ColorImage> {
        let RenderState { device, queue, renderer, .. } = &self.screen;
        let [width, height] = self.size.map(|n| (n * self.scale).round().max(1.0) as u32);
        let screen =
            ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point: self.scale };
        let primitives = self.context.tessellate(output.shapes, self.scale);
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut renderer = renderer.write();
        let more = renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("off screen"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.screen.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("off screen"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
                depth_slice: None,
            })],
            ..Default::default()
        });
        let mut pass = pass.forget_lifetime();
        renderer.render(&mut pass, &primitives, &screen);
        drop(pass);
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("screenshot"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: Some(height),
        };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        queue.submit(more.into_iter().chain([encoder.finish()]));
        let failed = |why: String| Error::gpu(format!("screenshot: {why}"));
        let (sender, receiver) = channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
            let _ = sender.send(mapped);
        });
        let waited = device.poll(wgpu::PollType::wait_indefinitely());
        waited.map_err(|error| failed(error.to_string()))?;
        let mapped = receiver.recv_timeout(Duration::from_mins(1));
        mapped.map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let bytes = buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))?;
        let swapped = matches!(
            self.screen.target_format,
            TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb
        );
        let rows = bytes.chunks_exact(row as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].chunks_exact(4)).map(|p| {
            if swapped {
                egui::Color32::from_rgb(p[2], p[1], p[0])
            } else {
                egui::Color32::from_rgb(p[0], p[1], p[2])
            }
        });
        Ok(egui::ColorImage::new([width as usize, height as usize], pixels.collect()))
    }
}

/// Writes what was seen of a window as a PNG.
///
/// # Errors
/// If the file cannot be written, or if it is one of `inputs`.
pub fn save_screenshot(seen: &egui::ColorImage, path: &Path, inputs: &Inputs) -> Result<()> {
    let linear = |byte: u8| linear_from_srgb(f64::from(byte) / 255.0) as f32;
    let pixels = seen.pixels.iter().map(|pixel| {
        let [r, g, b, _] = pixel.to_array();
        [linear(r), linear(g), linear(b), 1.0]
    });
    let [width, height] = seen.size.map(|n| n as u32);
    let image = Image { width, height, pixels: pixels.collect() };
    let file = PendingFile::create(path, inputs)?;
    let options = PictureOptions::new(PictureFormat::Png)
        .with(|options| options.tone = deepshadow::image::Tone::new(1.0, ToneMap::None));
    file.finish_with(&options.encode(&image)?)
}
