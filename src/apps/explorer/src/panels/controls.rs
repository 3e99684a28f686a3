//! Controls of keys of a scene file. A key that is left out shows the value that was chosen; a key
//! that was set can be left to choice again.

use eframe::egui::{self, Slider, Ui};

/// Marks a key that was set, and lets it be chosen again.
fn reset<T>(ui: &mut Ui, key: &mut Option<T>, label: &str) {
    if key.is_some() {
        let text = format!("{label}: the value of the file's or of the program's choice");
        let button = ui.small_button("auto").on_hover_text(text);
        button.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, format!("reset {label}"))
        });
        if button.clicked() {
            *key = None;
        }
    }
}

/// How a number is shown.
#[derive(Clone)]
pub struct Scale {
    /// Smallest and largest value of the slider.
    pub range: std::ops::RangeInclusive<f64>,
    /// Whether the slider is logarithmic.
    pub logarithmic: bool,
    /// Its unit, with a space in front.
    pub unit: &'static str,
    /// Whether values beyond the range can be typed.
    pub open: bool,
}

impl Scale {
    /// A linear scale.
    pub fn linear(range: std::ops::RangeInclusive<f64>) -> Self {
        Self { range, logarithmic: false, unit: "", open: false }
    }

    /// A logarithmic one, beyond which values can be typed.
    pub fn logarithmic(range: std::ops::RangeInclusive<f64>) -> Self {
        Self { range, logarithmic: true, unit: "", open: true }
    }

    /// The same with a unit.
    pub fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }
}

/// Gives a control that has no text of its own a name for those who cannot see where it stands.
pub fn named(ui: &Ui, control: &egui::Response, name: &str) {
    ui.ctx().accesskit_node_builder(control.id, |node| node.set_label(name));
}

/// A number.
pub fn number(ui: &mut Ui, label: &str, key: &mut Option<f64>, now: f64, scale: &Scale) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.unwrap_or(now);
        let clamping =
            if scale.open { egui::SliderClamping::Never } else { egui::SliderClamping::Always };
        let slider = Slider::new(&mut value, scale.range.clone())
            .logarithmic(scale.logarithmic)
            .clamping(clamping)
            .suffix(scale.unit)
            .text(label);
        if ui.add(slider).changed() && value.is_finite() {
            *key = Some(value);
        }
        reset(ui, key, label);
    });
}

/// A whole number.
pub fn count(
    ui: &mut Ui,
    label: &str,
    key: &mut Option<u32>,
    now: u32,
    range: std::ops::RangeInclusive<u32>,
) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.unwrap_or(now);
        let wide = range.end() / range.start().max(&1) > 100;
        let slider = Slider::new(&mut value, range).logarithmic(wide).text(label);
        if ui.add(slider).changed() {
            *key = Some(value);
        }
        reset(ui, key, label);
    });
}

/// One of several names.
pub fn choice(ui: &mut Ui, label: &str, key: &mut Option<String>, now: &str, names: &[&str]) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.clone().unwrap_or_else(|| now.to_owned());
        egui::ComboBox::from_label(label).selected_text(value.clone()).show_ui(ui, |ui| {
            for &name in names {
                if ui.selectable_value(&mut value, name.to_owned(), name).clicked() {
                    *key = Some(name.to_owned());
                }
            }
        });
        reset(ui, key, label);
    });
}

/// Yes or no.
pub fn switch(ui: &mut Ui, label: &str, key: &mut Option<bool>, now: bool) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.unwrap_or(now);
        if ui.checkbox(&mut value, label).changed() {
            *key = Some(value);
        }
        reset(ui, key, label);
    });
}

/// A colour within 0..1, linear.
pub fn colour(ui: &mut Ui, label: &str, key: &mut Option<[f64; 3]>, now: [f64; 3]) {
    ui.horizontal_wrapped(|ui| {
        let value = key.unwrap_or(now);
        let mut shown = value.map(|c| c as f32);
        let button = ui.color_edit_button_rgb(&mut shown);
        named(ui, &button, label);
        if button.changed() {
            *key = Some(shown.map(f64::from));
        }
        ui.label(label);
        reset(ui, key, label);
    });
}

/// A colour and a strength, which is its largest channel as a multiple of `unit`.
pub fn strength(ui: &mut Ui, label: &str, key: &mut Option<[f64; 3]>, now: [f64; 3], unit: f64) {
    let value = key.unwrap_or(now);
    let largest = value.into_iter().fold(0.0, f64::max);
    let mut bright = largest / unit;
    let mut hue = value.map(|c| if largest > 0.0 { (c / largest) as f32 } else { 1.0 });
    ui.horizontal_wrapped(|ui| {
        let button = ui.color_edit_button_rgb(&mut hue);
        named(ui, &button, &format!("{label} colour"));
        let coloured = button.changed();
        let slider =
            Slider::new(&mut bright, 0.0..=8.0).clamping(egui::SliderClamping::Never).text(label);
        if (ui.add(slider).changed() || coloured) && bright.is_finite() {
            *key = Some(hue.map(|c| f64::from(c) * bright.max(0.0) * unit));
        }
        reset(ui, key, label);
    });
}

/// Three numbers, such as a position.
pub fn vector(ui: &mut Ui, label: &str, key: &mut Option<[f64; 3]>, now: [f64; 3]) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.unwrap_or(now);
        let speed = value.into_iter().fold(0.0, |a: f64, b| a.max(b.abs())) * 0.01 + 0.001;
        let mut changed = false;
        for (at, axis) in value.iter_mut().zip(["x", "y", "z"]) {
            let drag = egui::DragValue::new(at).speed(speed).max_decimals(3).prefix(axis);
            let drag = ui.add(drag).on_hover_text(format!("{label} {axis}"));
            named(ui, &drag, &format!("{label} {axis}"));
            changed |= drag.changed();
        }
        if changed && value.iter().all(|c| c.is_finite()) {
            *key = Some(value);
        }
        ui.label(label);
        reset(ui, key, label);
    });
}

/// Two numbers, the lower one first.
pub fn range(
    ui: &mut Ui,
    label: &str,
    key: &mut Option<[f64; 2]>,
    now: [f64; 2],
    within: [f64; 2],
) {
    ui.horizontal_wrapped(|ui| {
        let mut value = key.unwrap_or(now);
        let speed = ((within[1] - within[0]).abs() * 0.004).max(1e-6);
        let mut changed = false;
        for (end, name) in value.iter_mut().zip(["from ", "to "]) {
            let drag = egui::DragValue::new(end).speed(speed).max_decimals(4).prefix(name);
            let drag = ui.add(drag);
            named(ui, &drag, &format!("{label} {}", name.trim()));
            changed |= drag.changed();
        }
        if changed && value[0] < value[1] && value.iter().all(|c| c.is_finite()) {
            *key = Some(value);
        }
        ui.label(label);
        reset(ui, key, label);
    });
}
