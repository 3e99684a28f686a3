//! Looking into it: maps, curves, another setting beside, and how wrong the picture is.

use deepshadow::settings::MapKind;
use eframe::egui::{self, Ui};
use egui_plot::{Line, Plot, PlotPoints, VLine};

use crate::document::Document;
use crate::engine::truth::{Channel, Curves, Difference, Drawn, Question};
use crate::explorer::Explorer;

/// What is shown of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// The difference of the picture.
    Difference,
    /// Curves of maps under the pointer.
    Curves,
}

/// What is looked into.
#[derive(Default)]
pub struct Looking {
    /// What is shown of the truth.
    pub look: Option<Look>,
    /// Whether all kinds are shown, or the one that is drawn alone.
    pub all: bool,
    /// What the picture of the map shows.
    pub channel: Channel,
    /// The place in the picture whose light ray is shown, 0..1.
    pub at: Option<[f64; 2]>,
    /// The latest difference, and its texture.
    pub difference: Option<(Difference, egui::TextureHandle)>,
    /// The latest curves, and the map's texture.
    pub drawn: Option<(Drawn, egui::TextureHandle)>,
    /// Why there is no answer.
    pub refusal: Option<String>,
    /// The picture and the question that was asked last.
    pub asked: Option<(u64, String)>,
    /// Whether its answer is not complete.
    pub pending: bool,
}

pub(super) fn show(explorer: &mut Explorer, document: &Document, ui: &mut Ui) {
    times(explorer, ui);
    beside(explorer, document, ui);
    // Above what grows while it is computed: a button stays where it is.
    if ui.button("look from the light").clicked() {
        explorer.look_from_light = true;
    }
    let mut looking = std::mem::take(&mut explorer.looking);
    let hover = "the picture against one through exact transmittances, as a share of the brightest";
    look(&mut looking, Look::Difference, "difference to the truth", hover, ui);
    if looking.look == Some(Look::Difference) {
        heat(&looking, ui);
    }
    let hover = "transmittance along the light ray to what is under the pointer";
    look(&mut looking, Look::Curves, "map and curves", hover, ui);
    if looking.look == Some(Look::Curves) {
        ui.checkbox(&mut looking.all, "all kinds of map");
        channel(&mut looking, ui);
        curves(&looking, ui);
    }
    if let Some(why) = &looking.refusal {
        ui.colored_label(ui.visuals().warn_fg_color, why);
    }
    explorer.looking = looking;
}

/// Shows something of the truth, or nothing any more.
fn look(looking: &mut Looking, what: Look, label: &str, hover: &str, ui: &mut Ui) {
    let mut is = looking.look == Some(what);
    if ui.checkbox(&mut is, label).on_hover_text(hover).changed() {
        looking.look = is.then_some(what);
    }
}

fn times(explorer: &Explorer, ui: &mut Ui) {
    let Some(shown) = explorer.shown() else { return };
    let times = shown.picture.times;
    let ms = |seconds: f64| format!("{:.1}", seconds * 1e3);
    egui::Grid::new("times").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        let rate = explorer.rate.map_or("at rest".to_owned(), |rate| format!("{rate:.0} / s"));
        let bytes: u64 = shown.picture.scene.bodies.iter().map(|body| body.bytes).sum();
        let [width, height] = shown.picture.size;
        let map = if times.map > 0.0 { format!("{} ms", ms(times.map)) } else { "kept".to_owned() };
        for (what, value) in [
            ("pictures", rate),
            ("picture", format!("{width} x {height}, {} ms", ms(times.view))),
            ("shadow map", format!("{0} x {0}, {map}", shown.picture.map_size)),
            ("scene, tone", format!("{}, {} ms", ms(times.scene), ms(times.tone))),
            ("voxels", format!("{:.1} MB", bytes as f64 / 1e6)),
            ("drawn by", shown.picture.device.clone()),
        ] {
            ui.weak(what);
            ui.label(value);
            ui.end_row();
        }
    });
}

/// Another setting beside this one.
fn beside(explorer: &mut Explorer, document: &Document, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let is = explorer.beside.is_some();
        let text = if is { "keep these on the left" } else { "compare with these settings" };
        let hover = "the settings of now stay on the left of the wiper";
        if ui.button(text).on_hover_text(hover).clicked() {
            explorer.compare(document);
        }
        if is && ui.button("end").on_hover_text("end the comparison").clicked() {
            explorer.end_comparison();
        }
    });
    if explorer.beside.is_some() {
        ui.add(egui::Slider::new(&mut explorer.wiper, 0.0..=1.0).text("wiper"));
    }
}

fn heat(looking: &Looking, ui: &mut Ui) {
    let Some((difference, _)) = &looking.difference else {
        ui.weak("computing");
        return;
    };
    ui.label(format!(
        "RMS {:.5}, largest {:.4} of the brightest",
        difference.rms, difference.largest
    ));
    let done = if difference.share >= 1.0 {
        format!("pixels {} apart were compared", difference.spacing)
    } else {
        let share = difference.share * 100.0;
        format!("{share:.0} % done, pixels {} apart", difference.spacing)
    };
    ui.weak(format!("{done}; bright is {:.4} and more", difference.scale));
}

fn channel(looking: &mut Looking, ui: &mut Ui) {
    let name = |channel: Channel| match channel {
        Channel::Opacity => "largest opacity".to_owned(),
        Channel::Depth(lost) => format!("depth at {:.0} %", lost * 100.0),
        Channel::Transmittance(_) => "transmittance at a depth".to_owned(),
    };
    egui::ComboBox::from_label("map shows").selected_text(name(looking.channel)).show_ui(
        ui,
        |ui| {
            for one in [
                Channel::Opacity,
                Channel::Depth(0.1),
                Channel::Depth(0.5),
                Channel::Depth(0.9),
                Channel::Transmittance(0.5),
            ] {
                ui.selectable_value(&mut looking.channel, one, name(one));
            }
        },
    );
    if let Channel::Transmittance(share) = &mut looking.channel {
        ui.add(egui::Slider::new(share, 0.0..=1.0).text("share of the depth"));
    }
}

fn curves(looking: &Looking, ui: &mut Ui) {
    let Some((drawn, texture)) = &looking.drawn else {
        ui.weak("point at something in the picture");
        return;
    };
    let width = ui.available_width().min(170.0);
    let image = egui::Image::new(texture).fit_to_exact_size(egui::vec2(width, width));
    let place = ui.add(image).rect;
    let at = place.min + egui::vec2(drawn.at[0] as f32, drawn.at[1] as f32) * place.width();
    let ring = egui::Stroke::new(1.5, egui::Color32::WHITE);
    ui.painter().circle_stroke(at, 5.0, ring);
    Plot::new("curves")
        .height(190.0)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .include_y(0.0)
        .include_y(1.0)
        .x_axis_label("depth from the light")
        .show(ui, |plot| {
            let text = plot_colour(0);
            plot.line(
                Line::new("truth", PlotPoints::from(drawn.truth.clone())).width(3.0).color(text),
            );
            for (index, (kind, curve, _, _)) in drawn.kinds.iter().enumerate() {
                let points = PlotPoints::from(curve.clone());
                plot.line(
                    Line::new(kind.to_string(), points).width(1.5).color(plot_colour(index + 1)),
                );
            }
            plot.vline(VLine::new("seen", drawn.seen).color(egui::Color32::GRAY));
        });
    egui::Grid::new("kinds").num_columns(3).spacing([12.0, 2.0]).show(ui, |ui| {
        ui.colored_label(plot_colour(0), "truth");
        for name in ["megabytes", "largest error here"] {
            ui.weak(name);
        }
        ui.end_row();
        for (index, (kind, _, bytes, off)) in drawn.kinds.iter().enumerate() {
            ui.colored_label(plot_colour(index + 1), kind.to_string());
            ui.label(format!("{:.2}", *bytes as f64 / 1e6));
            ui.label(format!("{off:.4}"));
            ui.end_row();
        }
    });
    if drawn.missing > 0 {
        ui.weak(format!("{} more are being built", drawn.missing));
    }
}

/// Colours that can be told apart on light and dark.
fn plot_colour(index: usize) -> egui::Color32 {
    if index == 0 {
        return egui::Color32::from_gray(128);
    }
    let hue = (index - 1) as f32 * 0.381_966;
    egui::ecolor::Hsva::new(hue.fract(), 0.75, 0.85, 1.0).into()
}

impl Looking {
    /// What is to be asked now, of the picture `serial`; `None` if it was asked already.
    pub fn question(&mut self, picture: &crate::engine::Picture, light: usize) -> Option<Question> {
        let kind = picture.settings.map.kind.unwrap_or_default();
        let (question, name) = if self.look == Some(Look::Difference) && picture.whole {
            (Question::Difference, "difference".to_owned())
        } else if self.look == Some(Look::Curves) && picture.whole {
            let mut kinds = vec![kind];
            if self.all {
                let surfaces = picture.scene.has_surfaces;
                let all =
                    MapKind::all().filter(|kind| !(surfaces && matches!(kind, MapKind::Grid(_))));
                kinds.extend(all.filter(|other| *other != kind));
            }
            let name = format!("{:?} {kinds:?} {:?} {light}", self.at, self.channel);
            let (at, channel) = (self.at, self.channel);
            (Question::Curves(Curves { light, at, kinds, channel }), name)
        } else {
            self.asked = None;
            return None;
        };
        let asked = Some((picture.serial, name));
        if self.asked == asked {
            return None;
        }
        self.asked = asked;
        if self.look == Some(Look::Difference) {
            // It is of another picture.
            self.difference = None;
        }
        (self.refusal, self.pending) = (None, true);
        Some(question)
    }
}
