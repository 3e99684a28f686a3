//! Lights.

use deepshadow::glam::DVec3;
use deepshadow::scene::file::LightTable;
use deepshadow::scene::{Light, LightKind};
use eframe::egui::Ui;

use super::controls::{Scale, choice, number, strength, vector};
use crate::document::{Document, place_light};
use crate::explorer::Explorer;
use crate::hands;

/// Most lights that can be added.
const MOST: usize = 8;

pub(super) fn show(explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    let Some(scene) = explorer.scene() else {
        ui.weak("loading");
        return;
    };
    lights(explorer, document, &scene.lights, ui);
    let index = explorer.light;
    let Some(light) = scene.lights.get(index).copied() else { return };
    // One that was chosen has no table yet.
    let before = document.file.light.get(index).cloned().unwrap_or_default();
    let mut table = before.clone();
    place(&mut table, &light, explorer, ui);
    if table != before {
        // What was set by hand does not move.
        table.keyframes = None;
        match document.file.light.get_mut(index) {
            Some(own) => *own = table,
            None => *document.file.light.one_mut() = table,
        }
    }
    let now = scene.ambient.to_array();
    strength(ui, "ambient", &mut document.file.ambient.radiance, now, 1.0);
}

/// What a light is and where it is.
fn place(table: &mut LightTable, light: &Light, explorer: &Explorer, ui: &mut Ui) {
    let kind = match light.kind {
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
        _ => "directional",
    };
    let mut wanted = table.kind.clone();
    choice(ui, "light kind", &mut wanted, kind, &["directional", "point", "spot"]);
    if wanted != table.kind {
        let name = wanted.clone().unwrap_or_else(|| "directional".to_owned());
        let kind = hands::light_of_kind(light, &name, &explorer.bounds());
        *table = LightTable { kind: wanted, ..LightTable::default() };
        let mut other = *light;
        other.kind = kind;
        place_light(table, Some(&other));
        return;
    }
    // What a fully lit white medium needs for radiance 1.
    let away = light.position().map_or(1.0, |at| (at - explorer.middle()).length_squared());
    let unit = Light::UNIT_IRRADIANCE * away.max(1e-12);
    strength(ui, "light strength", &mut table.irradiance, light.irradiance.to_array(), unit);
    // A light of these kinds cannot be without its position.
    let mut position = |table: &mut LightTable, at: DVec3| {
        vector(ui, "light position", &mut table.position, at.to_array());
        table.position.get_or_insert(at.to_array());
    };
    match light.kind {
        LightKind::Directional { direction } => {
            vector(ui, "light direction", &mut table.direction, direction.to_array());
        }
        LightKind::Point { position: at } => position(table, at),
        LightKind::Spot { position: at, direction, cone_degrees, cone_softness } => {
            position(table, at);
            vector(ui, "light direction", &mut table.direction, direction.to_array());
            let cone = Scale::linear(1.0..=89.0).unit("°");
            number(ui, "cone", &mut table.cone_degrees, cone_degrees, &cone);
            let soft = Scale::linear(0.0..=1.0);
            number(ui, "cone softness", &mut table.cone_softness, cone_softness, &soft);
        }
        _ => {}
    }
}

/// Adds, removes and selects lights.
fn lights(explorer: &mut Explorer, document: &mut Document, now: &[Light], ui: &mut Ui) {
    // More may have been added than were drawn.
    let count = document.file.light.len().max(1);
    explorer.light = explorer.light.min(count.saturating_sub(1));
    ui.horizontal(|ui| {
        ui.label("light");
        for index in 0..count {
            ui.selectable_value(&mut explorer.light, index, format!("{}", index + 1));
        }
        if count < MOST && ui.button("add").on_hover_text("add a light").clicked() {
            document.light_tables(now);
            // A third of a turn on from the last one that was drawn.
            if let Some(mut light) = now.last().copied() {
                let middle = explorer.middle();
                hands::turn_light(&mut light, middle, [2.0 / 3.0, 0.0]);
                let mut tables = document.file.light.to_vec();
                let kind = tables.get(now.len() - 1).and_then(|table| table.kind.clone());
                tables.push(LightTable { kind, ..LightTable::default() });
                document.file.light = tables.into();
                let index = document.file.light.len() - 1;
                document.place_light(index, &light);
                explorer.light = index;
            }
        }
        if count > 1 && ui.button("remove").on_hover_text("remove this light").clicked() {
            let mut tables = document.file.light.to_vec();
            if explorer.light < tables.len() {
                tables.remove(explorer.light);
            }
            document.file.light = tables.into();
        }
    });
}
