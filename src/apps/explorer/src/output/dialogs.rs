//! File dialogs, which the window does not wait for.

use std::path::PathBuf;

use deepshadow::scene::file::TransferTable;

use crate::explorer::{Dialog, Explorer};

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
            let path = pollster::block_on(asked).map(|file| file.path().to_owned());
            let _ = sender.send((dialog, path));
            context.request_repaint();
        };
        // The window goes on while the dialog is open.
        if std::thread::Builder::new().name("dialog".to_owned()).spawn(work).is_err() {
            self.complain("the system starts no thread for a dialog");
        }
    }

    /// Takes the answer of a dialog.
    pub fn chosen(&mut self, dialog: Dialog, path: PathBuf) {
        match dialog {
            Dialog::Open => self.open(&path.to_string_lossy()),
            Dialog::Picture => self.save_picture(path),
            Dialog::Scene => self.save_scene(path),
            Dialog::Frames => self.begin_round(&path),
            Dialog::ImportTransfer => {
                let index = self.volume;
                let table = self.document.as_mut().and_then(|own| own.file.volume.get_mut(index));
                if let Some(table) = table {
                    let gradient = table.transfer.take().and_then(|own| own.gradient);
                    let file = Some(path);
                    table.transfer =
                        Some(TransferTable { file, gradient, ..TransferTable::default() });
                }
            }
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
