//! Keys, and files that are dropped.

use eframe::egui::{self, Key, Modifiers, Ui};

use super::{Dialog, Explorer};

impl Explorer {
    pub(super) fn keys(&mut self, ui: &Ui) {
        if ui.ctx().egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key: Key| ui.input(|input| input.key_pressed(key));
        let command = |key: Key| ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, key));
        if command(Key::O) {
            self.ask(Dialog::Open);
        }
        if command(Key::S) {
            self.ask(Dialog::Picture);
        }
        if ui.input(|input| input.modifiers.any()) && !pressed(Key::Questionmark) {
            return;
        }
        if pressed(Key::F) {
            self.frame();
        }
        if pressed(Key::L) {
            self.holds_light = !self.holds_light;
        }
        if pressed(Key::P) {
            self.panels = !self.panels;
        }
        if pressed(Key::Questionmark) || pressed(Key::F1) {
            self.help = !self.help;
        }
        if pressed(Key::Escape) {
            self.help = false;
            self.cancel();
        }
        if pressed(Key::F11) {
            let full = ui.input(|input| input.viewport().fullscreen.unwrap_or(false));
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
        }
        if pressed(Key::Space)
            && let Some(mut document) = self.document.take()
        {
            self.play(&mut document);
            self.document = Some(document);
        }
        if pressed(Key::C) {
            if self.beside.is_some() {
                self.end_comparison();
            } else if let Some(document) = self.document.take() {
                self.compare(&document);
                self.document = Some(document);
            }
        }
    }
}
