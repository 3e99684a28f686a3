//! What is in the volumes and how it meets light.

use deepshadow::scene::file::EmissionTable;
use deepshadow::volume::presets::Preset;
use eframe::egui::{self, Ui};

use super::controls::{Scale, choice, colour, count, number, range};
use super::transfer;
use crate::document::Document;
use crate::engine::SeenBody;
use crate::explorer::Explorer;

pub(super) fn show(explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    let several = document.file.volume.len();
    if several > 1 {
        ui.horizontal(|ui| {
            ui.label("volume");
            for index in 0..several {
                ui.selectable_value(&mut explorer.volume, index, format!("{}", index + 1));
            }
        });
    }
    explorer.volume = explorer.volume.min(several.saturating_sub(1));
    let index = explorer.volume;
    frames(document, explorer, ui);
    let shown = explorer.scene();
    let body = shown.as_ref().and_then(|scene| scene.bodies.get(index).cloned());
    let Some(body) = body else {
        ui.weak("loading");
        return;
    };
    let [x, y, z] = body.dims;
    ui.weak(format!("{}: {x} x {y} x {z} voxels", body.name));
    let grids = explorer.grids.get(index).cloned().unwrap_or_default();
    let Some(table) = document.file.volume.get_mut(index) else { return };
    if grids.len() > 1 {
        let names: Vec<&str> = grids.iter().map(String::as_str).collect();
        choice(ui, "grid", &mut table.grid, &body.name, &names);
    }
    if table.preset.is_some() {
        let names = Preset::ALL.map(Preset::name);
        // It is no choice of the program's.
        let (mut preset, now) = (None, table.preset.clone().unwrap_or_default());
        choice(ui, "preset", &mut preset, &now, &names);
        if preset.is_some() && preset != table.preset {
            table.preset = preset;
            (table.density_scale, table.up, table.transfer) = (None, None, None);
            // What the preset says of itself; its name is one of those above.
            let _ = table.take_presets();
        }
    }
    let before = (table.density_scale, table.albedo, table.phase_g);
    let usual = body.density_scale.max(1e-9);
    let scale = Scale::logarithmic(usual / 50.0..=usual * 50.0).unit(" / length");
    let steady = explorer.steady("density scale", usual);
    let scale = Scale { range: steady / 50.0..=steady * 50.0, ..scale };
    number(ui, "density scale", &mut table.density_scale, body.density_scale, &scale);
    let held = explorer.histogram(index).map(|histogram| histogram.ends);
    if let Some([least, most]) = held {
        let chosen = explorer.shown().and_then(|shown| shown.picture.volumes.get(index)?.window);
        let now = chosen.map_or([least, most], |window| window.map(f64::from));
        let mut window = table.window.map(|window| window.map(f64::from));
        range(ui, "window", &mut window, now, [least, most]);
        table.window = window.map(|window| window.map(|end| end as f32));
    }
    colour(ui, "albedo", &mut table.albedo, body.albedo.to_array());
    let phase = Scale::linear(-0.95..=0.95);
    number(ui, "phase (g)", &mut table.phase_g, body.phase_g, &phase);
    clip_box(&mut table.clip, ui);
    if (table.density_scale, table.albedo, table.phase_g) != before {
        // What was set by hand does not move.
        for one in table.keyframes.iter_mut().flatten() {
            (one.density_scale, one.albedo, one.phase_g) = (None, None, None);
        }
    }
    let octaves = explorer.settings().map_or(0, |settings| settings.view.octaves);
    count(ui, "octaves", &mut document.file.shadow.octaves, octaves, 0..=16);
    transfer::show(explorer, document, index, ui);
    emission(document, index, &body, ui);
}

/// The part of the volume that is kept.
fn clip_box(key: &mut Option<[[f64; 3]; 2]>, ui: &mut Ui) {
    /// Thinnest part, as a share.
    const THIN: f64 = 0.005;
    let mut is = key.is_some();
    let hover = "keeps a box of the volume, along the axes of its voxels";
    if ui.checkbox(&mut is, "clip box").on_hover_text(hover).changed() {
        *key = is.then_some([[0.0; 3], [1.0; 3]]);
    }
    let Some([low, high]) = key else { return };
    ui.indent("clip", |ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let (least, most) = (low[axis], high[axis]);
            let from = egui::Slider::new(&mut low[axis], 0.0..=most - THIN);
            ui.add(from.text(format!("clip {name} from")));
            let to = egui::Slider::new(&mut high[axis], least + THIN..=1.0);
            ui.add(to.text(format!("clip {name} to")));
        }
    });
}

/// The frame of a sequence.
fn frames(document: &mut Document, explorer: &mut Explorer, ui: &mut Ui) {
    let Some(frames) = document.frames.clone() else { return };
    ui.horizontal(|ui| {
        let label = if explorer.playing { "pause" } else { "play" };
        if ui.button(label).clicked() {
            explorer.play(document);
        }
        ui.add(egui::Slider::new(&mut document.frame, frames).text("frame"));
    });
}

fn emission(document: &mut Document, index: usize, body: &SeenBody, ui: &mut Ui) {
    let Some(table) = document.file.volume.get_mut(index) else { return };
    let mut glows = table.emission.is_some();
    if ui.checkbox(&mut glows, "emission").changed() {
        table.emission = glows.then(EmissionTable::default);
    }
    let Some(emission) = &mut table.emission else { return };
    ui.indent("emission", |ui| {
        let names = ["blackbody", "fire", "viridis", "plasma", "inferno", "magma", "turbo"];
        choice(ui, "emission colours", &mut emission.colors, "blackbody", &names);
        let scale = Scale::logarithmic(0.01..=50.0);
        let now = emission.radiance.unwrap_or(0.6);
        number(ui, "emission radiance", &mut emission.radiance, now, &scale);
        if emission.radiance.is_some() {
            emission.scale = None;
        }
        if let Some(scale) = body.emission_scale {
            ui.weak(format!("{scale:.4} / length where it is brightest"));
        }
    });
}
