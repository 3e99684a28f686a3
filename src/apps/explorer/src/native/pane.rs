//! Nothing is below a program's window: it draws pictures itself.

use std::time::Instant;

use eframe::egui;

use crate::engine::Picture;

/// Nothing.
pub fn show_below(_picture: &Picture) -> Option<Instant> {
    None
}

/// Nothing.
pub fn place_below(_rect: egui::Rect, _context: &egui::Context) {}
