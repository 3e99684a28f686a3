//! The shadow map: its kind, and everything that its kind can be told.

use std::str::FromStr;

use deepshadow::settings::{Coding, Crossing, Filter, Lookup, MapKind, Shading, Slices};
use eframe::egui::{self, Ui};

use super::controls::{Scale, choice, count, named, number, switch};
use crate::document::Document;
use crate::explorer::Explorer;

pub(super) fn show(explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    let Some(settings) = explorer.settings() else {
        ui.weak("loading");
        return;
    };
    let now = settings.map.kind.unwrap_or_default();
    kind(document, now, ui);
    let table = &mut document.file.shadow;
    count(ui, "map size", &mut table.size, settings.map.size, 16..=4096);
    let filters: Vec<&str> = Filter::ALL.iter().map(|one| one.name()).collect();
    choice(ui, "filter", &mut table.filter, settings.map.filter.name(), &filters);
    let scale = Scale::logarithmic(0.125..=16.0);
    number(ui, "quality", &mut table.quality, settings.quality, &scale);
    count(ui, "light steps", &mut table.steps, settings.map.steps, 1..=4096);
    match now {
        MapKind::Threshold => threshold(document, &settings, ui),
        MapKind::Fragments | MapKind::Visibility => lists(document, &settings, ui),
        _ => {}
    }
    let table = &mut document.file.shadow;
    if document.file.volume.is_empty() || explorer.scene().is_some_and(|scene| scene.has_surfaces) {
        let size = explorer.bounds().size().max_element();
        let scale = Scale::linear(0.0..=0.1 * size.max(1e-6)).unit(" length");
        number(ui, "bias", &mut table.bias, settings.view.bias, &scale);
    }
}

/// The kind, and the number that may follow it.
fn kind(document: &mut Document, now: MapKind, ui: &mut Ui) {
    let table = &mut document.file.shadow;
    let name = |kind: MapKind| {
        let text = kind.to_string();
        text.split(':').next().unwrap_or_default().to_owned()
    };
    let kinds: Vec<MapKind> = MapKind::all().collect();
    ui.horizontal(|ui| {
        let mut selected = name(now);
        egui::ComboBox::from_label("map").selected_text(selected.clone()).height(420.0).show_ui(
            ui,
            |ui| {
                for kind in kinds {
                    let own = name(kind);
                    let clicked = ui.selectable_value(&mut selected, own.clone(), own).clicked();
                    if clicked {
                        table.map = Some(kind.to_string());
                    }
                }
            },
        );
    });
    ui.add(egui::Label::new(egui::RichText::new(now.description()).weak()).wrap());
    let (number, range) = match now {
        MapKind::Grid(n) => (n, 2..=256),
        MapKind::Coded(Coding::Slices(n) | Coding::FloatSlices(n) | Coding::Occupancy(n)) => {
            (n, 2..=256)
        }
        MapKind::Coded(Coding::Fourier(n)) => (n, 3..=63),
        MapKind::Coded(Coding::Moments(n)) => (n, 4..=6),
        MapKind::Coded(Coding::Trigonometric(n)) => (n, 2..=4),
        MapKind::Coded(
            Coding::Adaptive(n) | Coding::Layers(n) | Coding::Peeling(n) | Coding::Stochastic(n),
        ) => (n, 1..=64),
        _ => return,
    };
    let mut wanted = number;
    if ui.add(egui::Slider::new(&mut wanted, range).text("numbers a texel")).changed() {
        // The nearest number that the kind allows.
        let near = (0..=16_u16).flat_map(|d| [wanted.saturating_sub(d), wanted.saturating_add(d)]);
        let mut allowed =
            near.filter_map(|n| MapKind::from_str(&format!("{}:{n}", name(now))).ok());
        if let Some(kind) = allowed.next() {
            table.map = Some(kind.to_string());
        }
    }
}

fn threshold(document: &mut Document, settings: &deepshadow::Settings, ui: &mut Ui) {
    let table = &mut document.file.shadow;
    let lookups: Vec<&str> = Lookup::ALL.iter().map(|one| one.name()).collect();
    let now = &settings.map.threshold;
    choice(ui, "lookup", &mut table.lookup, now.lookup.name(), &lookups);
    let crossings: Vec<&str> = Crossing::ALL.iter().map(|one| one.name()).collect();
    choice(ui, "crossing", &mut table.crossing, now.crossing.name(), &crossings);
    ui.horizontal(|ui| {
        let mut levels = table.thresholds.unwrap_or(now.levels);
        let mut changed = false;
        for (index, level) in levels.iter_mut().enumerate() {
            let drag = egui::DragValue::new(level).speed(0.005).range(0.001..=0.999);
            let drag = ui.add(drag);
            named(ui, &drag, &format!("threshold {}", index + 1));
            changed |= drag.changed();
        }
        ui.label("thresholds");
        if changed && levels[0] + 1e-3 <= levels[1] && levels[1] + 1e-3 <= levels[2] {
            table.thresholds = Some(levels);
        }
    });
    shading(document, settings, ui);
}

/// The paper's shading is that of threshold maps.
fn shading(document: &mut Document, settings: &deepshadow::Settings, ui: &mut Ui) {
    let table = &mut document.file.shadow;
    let names: Vec<&str> = Shading::ALL.iter().map(|one| one.name()).collect();
    choice(ui, "shading", &mut table.shading, settings.view.shading.name(), &names);
    if settings.view.shading == Shading::Paper {
        count(ui, "light samples", &mut table.light_samples, settings.view.light_samples, 1..=1024);
    }
}

fn lists(document: &mut Document, settings: &deepshadow::Settings, ui: &mut Ui) {
    let table = &mut document.file.shadow;
    let now = &settings.map.fragments;
    let names: Vec<&str> = Slices::ALL.iter().map(|one| one.name()).collect();
    choice(ui, "slices", &mut table.slices, now.slices.name(), &names);
    let scale = Scale::linear(0.0..=0.1);
    number(ui, "tolerance", &mut table.tolerance, now.tolerance, &scale);
    if now.tolerance == 0.0 {
        number(ui, "truncation", &mut table.truncation, now.truncation, &scale);
    }
    if settings.map.filter.window().0 > 1 {
        switch(ui, "links between texels", &mut table.links, now.links.unwrap_or(true));
    }
    if document.file.has_surfaces() {
        switch(ui, "coverage of strands", &mut document.file.shadow.coverage, now.coverage);
    }
}
