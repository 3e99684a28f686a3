//! The bar above, and the status line below.

use std::time::Duration;

use deepshadow::volume::presets::Preset;
use eframe::egui::{self, Ui};

use super::{Dialog, Explorer};
use crate::engine::Picture;

impl Explorer {
    pub(super) fn bar(&mut self, ui: &mut Ui) {
        egui::Panel::top("bar").show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                if ui.button("Open…").on_hover_text("Ctrl+O, or drop a file").clicked() {
                    self.ask(Dialog::Open);
                }
                ui.menu_button("Examples", |ui| {
                    for preset in Preset::ALL {
                        if ui.button(preset.name()).clicked() {
                            self.open(preset.name());
                            ui.close();
                        }
                    }
                });
                ui.separator();
                let open = self.document.is_some();
                let frame = egui::Button::new("Frame");
                if ui.add_enabled(open, frame).on_hover_text("F, or double-click").clicked() {
                    self.frame();
                }
                ui.selectable_value(&mut self.holds_light, false, "Camera")
                    .on_hover_text("drag turns the camera (L)");
                ui.selectable_value(&mut self.holds_light, true, "Light")
                    .on_hover_text("drag turns the light (L; or hold Shift)");
                ui.separator();
                let save = egui::Button::new("Save picture…");
                if ui.add_enabled(open, save).on_hover_text("Ctrl+S").clicked() {
                    self.ask(Dialog::Picture);
                }
                ui.toggle_value(&mut self.panels, "Panels").on_hover_text("P");
                ui.menu_button("Theme", |ui| {
                    for (name, theme) in [
                        ("as the system", egui::ThemePreference::System),
                        ("dark", egui::ThemePreference::Dark),
                        ("light", egui::ThemePreference::Light),
                    ] {
                        if ui.button(name).clicked() {
                            ui.ctx().set_theme(theme);
                            ui.close();
                        }
                    }
                });
                ui.toggle_value(&mut self.help, "?").on_hover_text("keys");
            });
        });
    }

    pub(super) fn status(&mut self, ui: &mut Ui) {
        egui::Panel::bottom("status").exact_size(30.0).show(ui, |ui| {
            ui.horizontal_centered(|ui| match self.doing() {
                Some(doing) => {
                    let bar = match doing.share {
                        Some(share) => egui::ProgressBar::new(share),
                        None => egui::ProgressBar::new(0.0).animate(true),
                    };
                    ui.add(bar.desired_width(180.0).text(doing.what));
                    if ui.button("cancel").on_hover_text("Esc").clicked() {
                        self.cancel();
                    }
                    ui.ctx().request_repaint_after(Duration::from_millis(60));
                }
                None => self.at_rest(ui),
            });
        });
    }

    /// What there is to say, over the picture, whose size does not change by it.
    pub(super) fn messages(&mut self, context: &egui::Context, place: egui::Rect) {
        if self.messages.is_empty() {
            return;
        }
        let mut gone = None;
        let corner = place.left_bottom() + egui::vec2(8.0, -8.0);
        let area = egui::Area::new(egui::Id::unique("messages")).pivot(egui::Align2::LEFT_BOTTOM);
        area.fixed_pos(corner).show(context, |ui| {
            ui.set_max_width((place.width() - 120.0).max(160.0));
            for (index, message) in self.messages.iter().enumerate().rev().take(4).rev() {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.horizontal_wrapped(|ui| {
                        if !message.is_error {
                            ui.label(&message.text);
                            return;
                        }
                        ui.colored_label(ui.visuals().error_fg_color, &message.text);
                        if ui.small_button("dismiss").clicked() {
                            gone = Some(index);
                        }
                    });
                });
            }
        });
        if let Some(index) = gone {
            self.messages.remove(index);
        }
    }

    /// What the status line says when nothing is being done.
    pub(super) fn at_rest(&self, ui: &mut Ui) {
        let Some(shown) = self.shown() else {
            ui.weak("Open a file, drop one here, or take an example.");
            return;
        };
        let Picture { times, device, whole, size: [width, height], .. } = &shown.picture;
        let state = match (self.is_drawn(), *whole) {
            (true, _) => "as render draws it",
            (false, false) if self.is_at_rest() => "given up until something changes",
            (false, true) => "not drawn yet",
            (false, false) => "moving",
        };
        let rate = self.rate.map_or(String::new(), |rate| format!(", {rate:.0} pictures a second"));
        let time = times.total * 1e3;
        ui.weak(format!("{state}: {width} x {height} in {time:.0} ms{rate}, {device}"));
    }
}
