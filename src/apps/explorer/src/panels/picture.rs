//! How the picture is taken and shown.

use deepshadow::image::ToneMap;
use deepshadow::scene::file::ExposureValue;
use eframe::egui::{self, Ui};

use super::controls::{Scale, choice, count, named, number, strength, switch};
use crate::document::Document;
use crate::engine::{Device, Seen};
use crate::explorer::Explorer;

pub(super) fn show(explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    let (Some(scene), Some(settings)) = (explorer.scene(), explorer.settings()) else {
        ui.weak("loading");
        return;
    };
    exposure(explorer, document, ui);
    let image = &mut document.file.image;
    let names = ToneMap::ALL.map(ToneMap::name);
    let tone = explorer.shown().map_or("none", |shown| shown.picture.tone.map.name());
    choice(ui, "tone curve", &mut image.tonemap, tone, &names);
    count(ui, "samples", &mut image.samples, settings.image.samples, 1..=64);
    let scale = Scale::linear(0.0..=0.02);
    number(ui, "picture tolerance", &mut image.tolerance, settings.image.tolerance, &scale);
    let steps = settings.view.steps.unwrap_or(8192);
    count(ui, "camera steps", &mut document.file.shadow.view_steps, steps, 1..=8192);
    camera(document, &scene, ui);
    let radiance = scene.background.unwrap_or_default().to_array();
    strength(ui, "background", &mut document.file.background.radiance, radiance, 1.0);
    let table = &mut document.file.ground;
    switch(ui, "ground", &mut table.enabled, scene.ground.is_some());
    if let Some(ground) = scene.ground {
        let bounds = explorer.bounds();
        let size = bounds.size().max_element().max(1e-9);
        let [low, high] = [bounds.min.y - size, bounds.max.y];
        let scale = Scale { open: true, ..Scale::linear(low..=high) };
        number(ui, "ground height", &mut table.height, ground.height, &scale);
        number(ui, "ground albedo", &mut table.albedo, ground.albedo, &Scale::linear(0.0..=1.0));
    }
    size(document, &settings, ui);
    device(explorer, ui);
}

fn exposure(explorer: &Explorer, document: &mut Document, ui: &mut Ui) {
    let image = &mut document.file.image;
    let now = explorer.shown().map_or(1.0, |shown| shown.picture.tone.exposure);
    ui.horizontal(|ui| {
        let mut auto = matches!(&image.exposure, Some(ExposureValue::Text(text)) if text == "auto");
        let mut stops = f64::from(now.max(1e-12)).log2();
        let slider = egui::Slider::new(&mut stops, -8.0..=8.0)
            .clamping(egui::SliderClamping::Never)
            .suffix(" ev")
            .text("exposure");
        if ui.add_enabled(!auto, slider).changed() && stops.is_finite() {
            let factor = stops.exp2();
            image.exposure = (factor != 1.0).then_some(ExposureValue::Factor(factor));
        }
        if ui.checkbox(&mut auto, "auto").changed() {
            image.exposure = if auto {
                Some(ExposureValue::Text("auto".to_owned()))
            } else {
                Some(ExposureValue::Factor(now.into()))
            };
        }
    });
}

fn camera(document: &mut Document, scene: &Seen, ui: &mut Ui) {
    use deepshadow::scene::Projection;
    match scene.camera.projection {
        Projection::Perspective { fov_y_degrees } => {
            let scale = Scale::linear(5.0..=120.0).unit("°");
            let table = &mut document.file.camera;
            let before = table.fov_y_degrees;
            number(ui, "field of view", &mut table.fov_y_degrees, fov_y_degrees, &scale);
            if table.fov_y_degrees != before && table.position.is_none() {
                let fov = table.fov_y_degrees;
                document.place_camera(&scene.camera);
                document.file.camera.fov_y_degrees = fov;
            }
        }
        Projection::Orthographic { height } => {
            let scale = Scale::logarithmic(height / 10.0..=height * 10.0);
            number(ui, "view height", &mut document.file.camera.height, height, &scale);
        }
        _ => {}
    }
    let kind = match scene.camera.projection {
        Projection::Perspective { .. } => "perspective",
        _ => "orthographic",
    };
    choice(
        ui,
        "projection",
        &mut document.file.camera.kind,
        kind,
        &["perspective", "orthographic"],
    );
}

/// The size of the picture: that of the window, or one that was given.
fn size(document: &mut Document, settings: &deepshadow::Settings, ui: &mut Ui) {
    let image = &mut document.file.image;
    ui.horizontal(|ui| {
        let mut own = image.width.is_some() && image.height.is_some();
        let [width, height] = settings.image.size;
        if ui.checkbox(&mut own, "own size").changed() {
            (image.width, image.height) = (own.then_some(width), own.then_some(height));
        }
        let sides = [(&mut image.width, width, "width"), (&mut image.height, height, "height")];
        for (side, now, name) in sides {
            let mut value = side.unwrap_or(now);
            let drag = egui::DragValue::new(&mut value).range(16..=8192);
            let drag = ui.add_enabled(own, drag);
            named(ui, &drag, &format!("picture {name}"));
            if drag.changed() {
                *side = Some(value);
            }
        }
    });
}

fn device(explorer: &mut Explorer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let now = explorer.device.name();
        egui::ComboBox::from_label("device").selected_text(now).show_ui(ui, |ui| {
            for one in Device::ALL {
                let text = match one {
                    Device::Auto => "auto: a hardware GPU if there is one",
                    Device::Gpu => "gpu",
                    Device::Cpu => "cpu",
                };
                ui.selectable_value(&mut explorer.device, one, text);
            }
        });
    });
    let mut milliseconds = explorer.budget.as_secs_f64() * 1e3;
    let slider = egui::Slider::new(&mut milliseconds, 4.0..=500.0)
        .logarithmic(true)
        .suffix(" ms")
        .text("moving picture");
    if ui.add(slider).changed() {
        explorer.budget = std::time::Duration::from_secs_f64(milliseconds / 1e3);
    }
}
