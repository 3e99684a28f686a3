//! Hair and meshes.

use eframe::egui::Ui;

use super::controls::{Scale, colour, number, switch};
use crate::document::Document;
use crate::explorer::Explorer;

pub(super) fn show(_explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    let (meshes, hair) = (document.file.mesh.len(), document.file.hair.len());
    for (index, table) in document.file.surfaces_mut().enumerate() {
        let is_hair = index >= meshes;
        let (what, count) = if is_hair { ("hair", hair) } else { ("mesh", meshes) };
        let own = if is_hair { index - meshes } else { index };
        let number_of = if count > 1 { format!(" {}", own + 1) } else { String::new() };
        let label = |name: &str| format!("{what}{number_of} {name}");
        ui.push_id(index, |ui| {
            colour(ui, &label("colour"), &mut table.albedo, [0.5; 3]);
            number(ui, &label("opacity"), &mut table.opacity, 1.0, &Scale::linear(0.0..=1.0));
            if is_hair {
                let scale = Scale::logarithmic(0.001..=10.0);
                number(ui, &label("thickness"), &mut table.thickness, 0.1, &scale);
                let share = Scale::linear(0.0..=1.0);
                number(ui, &label("highlight"), &mut table.specular, 0.1, &share);
                let scale = Scale::logarithmic(1.0..=500.0);
                number(ui, &label("shininess"), &mut table.shininess, 40.0, &scale);
            }
            switch(ui, &label("casts shadows"), &mut table.casts, true);
            switch(ui, &label("receives shadows"), &mut table.receives, true);
        });
    }
}
