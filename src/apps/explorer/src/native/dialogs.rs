//! The system's file dialogs, which the window does not wait for.

use std::time::{Duration, Instant};

use super::threads;
use crate::explorer::{Dialog, Explorer};
use crate::output::Found;

/// The least time in which people close a dialog.
const FASTEST: Duration = Duration::from_millis(300);

/// What is said where a name is typed.
pub const WHERE: &str = "This system has no file dialogs; type the name of a file.";

/// Asks for a file; the explorer hears the answer later.
///
/// # Errors
/// If the system starts no thread for the dialog.
pub fn ask(explorer: &Explorer, dialog: Dialog) -> Result<(), String> {
    let files = rfd::AsyncFileDialog::new();
    let files = match dialog {
        Dialog::Open => files.set_title("Open a volume, hair, a mesh or a scene"),
        Dialog::ImportTransfer => files.set_title("Import a transfer function"),
        Dialog::ExportTransfer => files.set_title("Export the transfer function"),
        Dialog::Picture => files.set_title("Save the picture"),
        Dialog::Scene => files.set_title("Save the scene"),
        Dialog::Frames => files.set_title("Name of the pictures"),
    };
    let is_read = matches!(dialog, Dialog::Open | Dialog::ImportTransfer);
    let files = if is_read { files } else { files.set_file_name(explorer.usual_name(dialog)) };
    let (sender, context) = (explorer.found(), explorer.context().clone());
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
    let begun = threads::start("dialog", work);
    begun.map_err(|error| format!("the system starts no thread for a dialog: {error}"))
}
