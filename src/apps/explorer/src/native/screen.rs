//! The device that draws the window, on which passes run too.

use deepshadow::gpu::GpuBackend;
use deepshadow::wgpu::{self, AdapterInfo, DeviceType};
use eframe::egui;
use eframe::egui_wgpu::RenderState;

/// The device of a window.
#[derive(Clone)]
pub struct Screen(pub RenderState);

/// Whether an adapter is more than a processor.
fn is_hardware(adapter: &AdapterInfo) -> bool {
    let kind = adapter.device_type;
    matches!(kind, DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu)
}

impl Screen {
    /// Whether processors draw the window.
    pub fn is_software(&self) -> bool {
        !is_hardware(&self.0.adapter.get_info())
    }

    /// The passes on this device, if it can run them, and whether it is hardware.
    pub fn gpu(&self) -> (Option<GpuBackend>, bool) {
        let info = self.0.adapter.get_info();
        let gpu = GpuBackend::on_device(&info, &self.0.device, &self.0.queue).ok();
        (gpu, is_hardware(&info))
    }

    /// Gives up a texture.
    pub fn forget(&self, texture: egui::TextureId) {
        self.0.renderer.write().free_texture(&texture);
    }

    /// What egui calls a texture of this device; it takes the place of `known`.
    pub fn texture(
        &self,
        view: &wgpu::TextureView,
        known: Option<egui::TextureId>,
    ) -> egui::TextureId {
        let (device, filter) = (&self.0.device, wgpu::FilterMode::Linear);
        let mut renderer = self.0.renderer.write();
        match known {
            Some(id) => {
                renderer.update_egui_texture_from_wgpu_texture(device, view, filter, id);
                id
            }
            None => renderer.register_native_texture(device, view, filter),
        }
    }
}
