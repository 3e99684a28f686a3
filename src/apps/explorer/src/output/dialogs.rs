//! File dialogs, which the window does not wait for.

use std::path::PathBuf;

use deepshadow::io::is_scene_file;
use deepshadow::scene::SceneFile;
use deepshadow::scene::file::TransferTable;
use deepshadow::{Error, Result};
use eframe::egui;

use crate::explorer::{Dialog, Explorer};
use crate::host;

/// What a dialog has found.
pub enum Found {
    /// A file, or nothing if it was closed.
    Path(Option<PathBuf>),
    /// The system has no dialogs.
    NoDialog,
}

impl Explorer {
    /// Asks for a file; the answer comes later ([`Explorer::chosen`]).
    pub fn ask(&mut self, dialog: Dialog) {
        if let Err(why) = host::ask(self, dialog) {
            self.complain(&why);
        }
    }

    /// A name to begin with, for what a dialog writes; empty for what one reads.
    pub fn usual_name(&self, dialog: Dialog) -> String {
        let ending = match dialog {
            Dialog::Picture => "png",
            Dialog::Scene => "toml",
            Dialog::Frames => "####.png",
            Dialog::ExportTransfer => "transfer.toml",
            Dialog::Open | Dialog::ImportTransfer => return String::new(),
        };
        let name = self.document.as_ref().map(|document| document.default_output(ending));
        name.unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Takes what a dialog has found.
    pub fn hear_of_dialog(&mut self, dialog: Dialog, found: Found) {
        match found {
            Found::Path(Some(path)) => self.chosen(dialog, path),
            Found::Path(None) => {}
            Found::NoDialog => self.typed = Some((dialog, self.usual_name(dialog))),
        }
    }

    /// Asks for a name where the system has no dialogs.
    pub fn show_typed(&mut self, context: &egui::Context) {
        let Some((dialog, mut text)) = self.typed.take() else { return };
        let title = match dialog {
            Dialog::Open => "Open",
            Dialog::ImportTransfer => "Import a transfer function",
            Dialog::ExportTransfer => "Export the transfer function",
            Dialog::Picture => "Save the picture",
            Dialog::Scene => "Save the scene",
            Dialog::Frames => "Name of the pictures, with #### for their number",
        };
        let (mut open, mut done) = (true, false);
        let window = egui::Window::new(title).open(&mut open).resizable(false);
        window.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO).show(context, |ui| {
            ui.weak(host::WHERE);
            let field = ui.add(egui::TextEdit::singleline(&mut text).desired_width(360.0));
            let entered =
                field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            done = ui.button("OK").clicked() || entered;
        });
        if done && !text.trim().is_empty() {
            self.chosen(dialog, PathBuf::from(text.trim()));
        } else if open && !done {
            self.typed = Some((dialog, text));
        }
    }

    /// Takes the answer of a dialog.
    pub fn chosen(&mut self, dialog: Dialog, path: PathBuf) {
        match dialog {
            Dialog::Open => self.open(&path.to_string_lossy()),
            Dialog::Picture => self.save_picture(path),
            Dialog::Scene => self.save_scene(path),
            Dialog::Frames => self.begin_round(&path),
            Dialog::ImportTransfer => match imported(path) {
                Ok(imported) => {
                    let index = self.volume;
                    let document = self.document.as_mut();
                    let table = document.and_then(|own| own.file.volume.get_mut(index));
                    if let Some(table) = table {
                        let gradient = table.transfer.take().and_then(|own| own.gradient);
                        table.transfer = Some(TransferTable {
                            gradient: imported.gradient.or(gradient),
                            ..imported
                        });
                    }
                }
                Err(error) => self.complain(&error.to_string()),
            },
            Dialog::ExportTransfer => {
                let table = self.document.as_ref().and_then(|own| own.file.volume.get(self.volume));
                let table = table.and_then(|table| table.transfer.as_ref());
                if let Some(table) = table {
                    let text = crate::panels::exported(table);
                    self.write(path, move || Ok(text.into_bytes()));
                }
            }
        }
    }
}

/// The transfer function in a file: that of a scene file, else what the file itself is.
fn imported(path: PathBuf) -> Result<TransferTable> {
    if !is_scene_file(&path) {
        return Ok(TransferTable { file: Some(path), ..TransferTable::default() });
    }
    let file = SceneFile::parse(&host::read_text(&path)?, &path)?;
    let table = file.volume.iter().find_map(|table| table.transfer.clone());
    table.ok_or_else(|| Error::contents(&path, "has no transfer function"))
}
