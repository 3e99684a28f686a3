//! The panels beside the picture. Each shows and changes one part of the scene file.

mod controls;
mod light;
mod looking;
mod picture;
mod shadow;
mod surfaces;
mod transfer;
mod volume;

use eframe::egui::{self, Ui};

use crate::explorer::Explorer;
pub use controls::named;
pub use looking::{Look, Looking};
pub use transfer::{Known, OfDensities, TransferEditor, exported, known, on_screen, points_of};

/// The titles of the sections.
pub const SECTIONS: [&str; 7] =
    ["Volume", "Surfaces", "Light", "Shadow", "Picture", "Looking into it", "Out"];

/// Draws all panels, one below the other.
pub fn show(explorer: &mut Explorer, ui: &mut Ui) {
    egui::ScrollArea::vertical().auto_shrink([false; 2]).show(ui, |ui| {
        ui.spacing_mut().slider_width = 110.0;
        // Nothing lies below the bar.
        ui.set_max_width(ui.available_width() - 10.0);
        let Some(mut document) = explorer.document.take() else {
            ui.label("Nothing is open.");
            return;
        };
        if !document.file.volume.is_empty() {
            section(explorer, ui, ("Volume", true), |explorer, ui| {
                volume::show(explorer, &mut document, ui);
            });
        }
        if document.file.has_surfaces() {
            section(explorer, ui, ("Surfaces", true), |explorer, ui| {
                surfaces::show(explorer, &mut document, ui);
            });
        }
        section(explorer, ui, ("Light", true), |explorer, ui| {
            light::show(explorer, &mut document, ui);
        });
        section(explorer, ui, ("Shadow", true), |explorer, ui| {
            shadow::show(explorer, &mut document, ui);
        });
        section(explorer, ui, ("Picture", false), |explorer, ui| {
            picture::show(explorer, &mut document, ui);
        });
        section(explorer, ui, ("Looking into it", false), |explorer, ui| {
            looking::show(explorer, &document, ui);
        });
        section(explorer, ui, ("Out", false), |explorer, ui| {
            crate::output::show(explorer, &mut document, ui);
        });
        explorer.document = Some(document);
    });
}

fn section(
    explorer: &mut Explorer,
    ui: &mut Ui,
    (title, open): (&str, bool),
    contents: impl FnOnce(&mut Explorer, &mut Ui),
) {
    let toggled = explorer.toggled.iter().position(|name| name == title);
    let mut header = egui::CollapsingHeader::new(title).default_open(open);
    if let Some(at) = toggled {
        explorer.toggled.remove(at);
        let now = explorer.opened.get(title).copied().unwrap_or(open);
        header = header.open(Some(!now));
    }
    let shown = header.show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        contents(explorer, ui);
        ui.add_space(4.0);
    });
    explorer.opened.insert(title.to_owned(), shown.openness > 0.0);
}
