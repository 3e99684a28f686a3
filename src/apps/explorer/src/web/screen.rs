//! The device of a page's window, of which nothing is known: workers draw on devices of their own.

use deepshadow::wgpu;
use eframe::egui;

/// There is none.
#[derive(Clone, Copy)]
pub enum Screen {}

impl Screen {
    /// Whether processors draw the window.
    pub fn is_software(&self) -> bool {
        match *self {}
    }

    /// Gives up a texture.
    pub fn forget(&self, _texture: egui::TextureId) {
        match *self {}
    }

    /// What egui calls a texture of this device.
    pub fn texture(
        &self,
        _view: &wgpu::TextureView,
        _known: Option<egui::TextureId>,
    ) -> egui::TextureId {
        match *self {}
    }
}
