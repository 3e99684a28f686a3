//! File dialogs, which the window does not wait for.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use deepshadow::io::is_scene_file;
use deepshadow::scene::SceneFile;
use deepshadow::scene::file::TransferTable;
use deepshadow::{Error, Result};
use eframe::egui;

use crate::explorer::{Dialog, Explorer};

/// The least time in which people close a dialog.
const FASTEST: Duration = Duration::from_millis(300);

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
        let mut files = rfd::AsyncFileDialog::new();
        let stem = |ending: &str| {
            let path = self.document.as_ref().map(|document| document.default_output(ending));
            path.unwrap_or_default().to_string_lossy().into_owned()
        };
        files = match dialog {
            Dialog::Open => files.set_title("Open a volume, hair, a mesh or a scene"),
            Dialog::ImportTransfer => files.set_title("Import a transfer function"),
            Dialog::ExportTransfer => files.set_title("Export the transfer function"),
            Dialog::Picture => files.set_title("Save the picture").set_file_name(stem("png")),
            Dialog::Scene => files.set_title("Save the scene").set_file_name(stem("toml")),
            Dialog::Frames => {
                files.set_title("Name of the pictures").set_file_name(stem("####.png"))
            }
        };
        let (sender, context) = (self.found(), self.context().clone());
        let is_read = matches!(dialog, Dialog::Open | Dialog::ImportTransfer);
        let work = move || {
            let asked =
                async { if is_read { files.pick_file().await } else { files.save_file().await } };
            let begun = Instant::now();
            let path = pollster::block_on(asked).map(|file| file.path().to_owned());
            // Nobody closes a dialog as fast as a system says that it has none.
            let is_missing = path.is_none() && begun.elapsed() < FASTEST;
            let found = if is_missing { Found::NoDialog } else { Found::Path(path) };
            let _ = sender.send((dialog, found));
            context.request_repaint();
        };
        // The window goes on while the dialog is open.
        if std::thread::Builder::new().name("dialog".to_owned()).spawn(work).is_err() {
            self.complain("the system starts no thread for a dialog");
        }
    }

    /// Takes what a dialog has found.
    pub fn hear_of_dialog(&mut self, dialog: Dialog, found: Found) {
        match found {
            Found::Path(Some(path)) => self.chosen(dialog, path),
            Found::Path(None) => {}
            Found::NoDialog => {
                let ending = match dialog {
                    Dialog::Picture => "png",
                    Dialog::Scene => "toml",
                    Dialog::Frames => "####.png",
                    Dialog::ExportTransfer => "transfer.toml",
                    Dialog::Open | Dialog::ImportTransfer => "",
                };
                let document = self.document.as_ref().filter(|_| !ending.is_empty());
                let name = document.map(|document| document.default_output(ending));
                let text = name.unwrap_or_default().to_string_lossy().into_owned();
                self.typed = Some((dialog, text));
            }
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
            ui.weak("This system has no file dialogs; type the name of a file.");
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

/// Bytes that a scene file with a transfer function may have.
const MOST_BYTES: u64 = 16 << 20;

/// The transfer function in a file: that of a scene file, else what the file itself is.
fn imported(path: PathBuf) -> Result<TransferTable> {
    if !is_scene_file(&path) {
        return Ok(TransferTable { file: Some(path), ..TransferTable::default() });
    }
    let failed = |error| Error::file(&path, error);
    let found = std::fs::metadata(&path).map_err(failed)?;
    if !found.is_file() || found.len() > MOST_BYTES {
        return Err(Error::contents(&path, "is no scene file, or too large for one"));
    }
    let text = std::fs::read_to_string(&path).map_err(failed)?;
    let file = SceneFile::parse(&text, &path)?;
    let table = file.volume.iter().find_map(|table| table.transfer.clone());
    table.ok_or_else(|| Error::contents(&path, "has no transfer function"))
}
