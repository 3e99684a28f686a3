//! The transfer function, edited on the histogram of what it is a function of.

use std::sync::Arc;

use deepshadow::io::Histogram;
use deepshadow::scene::automatic::Densities;
use deepshadow::scene::file::TransferTable;
use deepshadow::scene::{TransferFunction, transfer};
use deepshadow::volume::Volume;
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

use crate::document::Document;
use crate::explorer::{Dialog, Explorer};

/// Bins of a histogram.
const BINS: usize = 160;
const HEIGHT: f32 = 110.0;
/// How near to a point a pointer takes hold of it, in points of the screen.
const REACH: f32 = 9.0;

/// The histogram of a volume, over densities as transfer functions have them.
#[derive(Clone, Debug, serde::Deserialize, serde::Serialize)]
pub struct OfDensities {
    /// The smallest and the largest density that is shown.
    pub range: [f64; 2],
    /// The smallest and the largest stored value.
    pub ends: [f64; 2],
    /// Heights of the bins, 0..1, logarithmic.
    pub heights: Vec<f32>,
}

impl OfDensities {
    /// Counts the voxels of a volume. Empty space, of which there may be any amount, is left out.
    pub fn of(volume: &Volume, densities: &Densities) -> Self {
        let [low, high] = volume.voxels().range().map(f64::from);
        let high = high.min(f64::from(volume.typical_largest()) * 1.2).max(low + 1e-30);
        let mut histogram = Histogram::new([low, high], BINS);
        volume.voxels().for_each_held(|part, value| {
            if value > 0.0 {
                histogram.add(value, part.voxels() as u64);
            }
        });
        let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1);
        let log = |count: u64| (count as f32).ln_1p() / (most as f32).ln_1p();
        let density = |held: f64| (held - densities.offset) / densities.scale;
        let by = f64::from(volume.moved_by());
        Self {
            range: [density(low), density(high)],
            ends: [low - by, high - by],
            heights: histogram.counts.into_iter().map(log).collect(),
        }
    }
}

/// What is being edited.
#[derive(Clone, Debug, Default)]
pub struct TransferEditor {
    /// The point that is selected.
    selected: Option<usize>,
    /// The points while the pointer holds one of them.
    held: Option<Vec<[f64; 5]>>,
}

/// The points of a function, as scene files have them.
pub fn points_of(function: &TransferFunction) -> Vec<[f64; 5]> {
    let points = function.points().iter();
    points.map(|p| [p.value, p.color.x, p.color.y, p.color.z, p.opacity]).collect()
}

pub(super) fn show(explorer: &mut Explorer, document: &mut Document, index: usize, ui: &mut Ui) {
    let function = explorer.function(index);
    let histogram = explorer.histogram(index);
    let Some(table) = document.file.volume.get_mut(index) else { return };
    presets(explorer, &mut table.transfer, ui);
    let Some(histogram) = histogram else { return };
    let mut editor = std::mem::take(&mut explorer.transfer);
    let given = table.transfer.as_ref().and_then(|transfer| transfer.points.clone());
    let shown = editor.held.clone().or(given).or(function);
    if let Some(points) = edit(&mut editor, &histogram, shown, ui) {
        let gradient = table.transfer.as_ref().and_then(|transfer| transfer.gradient.clone());
        table.transfer =
            Some(TransferTable { points: Some(points), gradient, ..TransferTable::default() });
    }
    explorer.transfer = editor;
    gradient(&mut table.transfer, ui);
}

/// Names to choose from, import and export.
fn presets(explorer: &mut Explorer, table: &mut Option<TransferTable>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let now = match table.as_ref() {
            None => "none".to_owned(),
            Some(table) => match (&table.name, &table.file) {
                (Some(name), _) => name.clone(),
                (None, Some(file)) => file.display().to_string(),
                (None, None) => "own points".to_owned(),
            },
        };
        egui::ComboBox::from_label("transfer function").selected_text(now).height(420.0).show_ui(
            ui,
            |ui| {
                if ui.selectable_label(table.is_none(), "none").clicked() {
                    *table = None;
                }
                let names = transfer::PRESETS.iter().copied();
                let auto = ("auto", "chosen by the histogram");
                for (name, what) in std::iter::once(auto).chain(names) {
                    let is = table.as_ref().is_some_and(|own| own.name.as_deref() == Some(name));
                    if ui.selectable_label(is, name).on_hover_text(what).clicked() {
                        let gradient = table.as_ref().and_then(|own| own.gradient.clone());
                        *table = Some(TransferTable {
                            name: Some(name.to_owned()),
                            gradient,
                            ..TransferTable::default()
                        });
                    }
                }
            },
        );
    });
    ui.horizontal(|ui| {
        let hover = "a colour map of ParaView, or lines of 'value r g b opacity'";
        if ui.button("import…").on_hover_text(hover).clicked() {
            explorer.ask(Dialog::ImportTransfer);
        }
        let points = table.as_ref().is_some_and(|own| own.points.is_some());
        let export = ui.add_enabled(points, egui::Button::new("export…"));
        if export.on_hover_text("as the table of a scene file").clicked() {
            explorer.ask(Dialog::ExportTransfer);
        }
    });
}

/// The text of a scene file with this function alone.
pub fn exported(table: &TransferTable) -> String {
    let mut text = "[volume.transfer]\npoints = [\n".to_owned();
    for point in table.points.iter().flatten() {
        let numbers = point.map(|number| format!("{number:?}")).join(", ");
        text.extend(["  [", &numbers, "],\n"]);
    }
    text + "]\n"
}

/// How steep the density must be.
fn gradient(table: &mut Option<TransferTable>, ui: &mut Ui) {
    let Some(table) = table else { return };
    let mut steep = table.gradient.is_some();
    let hover = "opacity only where the density changes: surfaces stand out";
    if ui.checkbox(&mut steep, "steep places only").on_hover_text(hover).changed() {
        table.gradient = steep.then(|| vec![[0.0, 0.0], [0.2, 1.0]]);
    }
    if let Some([_, [length, _]]) = table.gradient.as_deref_mut() {
        ui.add(egui::Slider::new(length, 0.01..=1.0).text("steepness"));
    }
}

/// The editor itself; returns the points if they have changed.
fn edit(
    editor: &mut TransferEditor,
    histogram: &OfDensities,
    shown: Option<Vec<[f64; 5]>>,
    ui: &mut Ui,
) -> Option<Vec<[f64; 5]>> {
    let width = ui.available_width().clamp(120.0, 420.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::click_and_drag());
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Canvas, true, "transfer function editor")
    });
    let own = shown.clone().unwrap_or_default();
    let ends = own.iter().map(|point| point[0]);
    let [low, high] = histogram.range;
    let low = ends.clone().fold(low, f64::min);
    let high = ends.fold(high, f64::max).max(low + 1e-12);
    let place = Place { rect: rect.shrink(6.0), low, high };
    draw_histogram(&place, histogram, ui);
    // Without a function opacity rises with the density.
    let mut points = shown.unwrap_or_else(|| vec![[low, 1., 1., 1., 0.], [high, 1., 1., 1., 1.]]);
    draw_function(&place, &points, editor.selected, ui);
    let changed = handle(editor, &response, &place, &mut points);
    let hint = "drag points; double-click to add one, right-click to remove one";
    let response = response.on_hover_text(hint);
    let coloured = selected(editor, &mut points, ui);
    if response.dragged() && editor.held.is_some() {
        editor.held = Some(points.clone());
    } else {
        editor.held = None;
    }
    (changed || coloured).then_some(points)
}

/// Where values are on the screen.
struct Place {
    rect: Rect,
    low: f64,
    high: f64,
}

impl Place {
    fn at(&self, value: f64, opacity: f64) -> Pos2 {
        let x = ((value - self.low) / (self.high - self.low)) as f32;
        let Rect { min, max } = self.rect;
        pos2(min.x + x * (max.x - min.x), max.y + opacity as f32 * (min.y - max.y))
    }

    fn value(&self, at: Pos2) -> [f64; 2] {
        let Rect { min, max } = self.rect;
        let x = f64::from(((at.x - min.x) / (max.x - min.x)).clamp(0.0, 1.0));
        let y = f64::from(((at.y - max.y) / (min.y - max.y)).clamp(0.0, 1.0));
        [self.low + x * (self.high - self.low), y]
    }
}

fn draw_histogram(place: &Place, histogram: &OfDensities, ui: &Ui) {
    let painter = ui.painter();
    let visuals = ui.visuals();
    painter.rect(
        place.rect.expand(6.0),
        3.0,
        visuals.extreme_bg_color,
        visuals.widgets.noninteractive.bg_stroke,
        StrokeKind::Inside,
    );
    let [low, high] = histogram.range;
    let step = (high - low) / histogram.heights.len() as f64;
    let colour = visuals.weak_text_color().gamma_multiply(0.5);
    for (bin, &height) in histogram.heights.iter().enumerate() {
        let [left, right] = [bin, bin + 1].map(|i| low + i as f64 * step);
        let bar = Rect::from_two_pos(place.at(left, 0.0), place.at(right, f64::from(height)));
        painter.rect_filled(bar, 0.0, colour);
    }
}

/// A linear colour on the screen.
pub fn on_screen(colour: [f64; 3]) -> Color32 {
    let [r, g, b] = colour.map(|c| c.clamp(0.0, 1.0) as f32);
    egui::Rgba::from_rgb(r, g, b).into()
}

fn draw_function(place: &Place, points: &[[f64; 5]], selected: Option<usize>, ui: &Ui) {
    let painter = ui.painter();
    let line = Stroke::new(1.5, ui.visuals().text_color());
    let all = points.iter().map(|p| place.at(p[0], p[4]));
    let first = points.first().map(|p| place.at(place.low, p[4]));
    let last = points.last().map(|p| place.at(place.high, p[4]));
    painter.line(first.into_iter().chain(all).chain(last).collect(), line);
    // Colours in a band below.
    let band = Rect::from_min_max(
        pos2(place.rect.min.x, place.rect.max.y),
        pos2(place.rect.max.x, place.rect.max.y + 5.0),
    );
    for pair in points.windows(2) {
        let mut mesh = egui::Mesh::default();
        for (index, point) in pair.iter().enumerate() {
            let x = place.at(point[0], 0.0).x;
            let colour = on_screen([point[1], point[2], point[3]]);
            mesh.colored_vertex(pos2(x, band.min.y), colour);
            mesh.colored_vertex(pos2(x, band.max.y), colour);
            if index == 1 {
                mesh.add_triangle(0, 1, 2);
                mesh.add_triangle(1, 2, 3);
            }
        }
        painter.add(mesh);
    }
    if points.len() > 64 {
        return;
    }
    for (index, point) in points.iter().enumerate() {
        let chosen = selected == Some(index);
        let radius = if chosen { 6.0 } else { 4.5 };
        let colour = on_screen([point[1], point[2], point[3]]);
        let ring =
            if chosen { ui.visuals().strong_text_color() } else { ui.visuals().text_color() };
        painter.circle(place.at(point[0], point[4]), radius, colour, Stroke::new(1.5, ring));
    }
}

/// Moves, adds and removes points. Returns whether that has changed anything.
fn handle(
    editor: &mut TransferEditor,
    response: &egui::Response,
    place: &Place,
    points: &mut Vec<[f64; 5]>,
) -> bool {
    let Some(pointer) = response.interact_pointer_pos() else { return false };
    let near = |points: &[[f64; 5]]| {
        let away = |p: &[f64; 5]| place.at(p[0], p[4]).distance(pointer);
        let nearest = points.iter().enumerate().map(|(index, p)| (index, away(p)));
        let nearest = nearest.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|(_, away)| *away < REACH).map(|(index, _)| index)
    };
    if response.drag_started() || response.clicked() {
        editor.selected = near(points);
        editor.held = editor.selected.map(|_| points.clone());
    }
    if response.double_clicked() && near(points).is_none() {
        let [value, opacity] = place.value(pointer);
        let at = points.partition_point(|point| point[0] <= value);
        // Of the colour of the function there.
        let like = points.get(at.saturating_sub(1)).or(points.first()).copied();
        let [_, r, g, b, _] = like.unwrap_or([0.0, 1.0, 1.0, 1.0, 0.0]);
        points.insert(at, [value, r, g, b, opacity]);
        editor.selected = Some(at);
        return true;
    }
    if response.secondary_clicked()
        && let Some(index) = near(points)
        && points.len() > 1
    {
        points.remove(index);
        editor.selected = None;
        return true;
    }
    if response.dragged()
        && editor.held.is_some()
        && let Some(index) = editor.selected
        && index < points.len()
    {
        let [value, opacity] = place.value(pointer);
        let least = index.checked_sub(1).map_or(place.low, |before| points[before][0]);
        let most = points.get(index + 1).map_or(place.high, |after| after[0]);
        let moved = [value.clamp(least, most), opacity];
        let changed = [points[index][0], points[index][4]] != moved;
        (points[index][0], points[index][4]) = (moved[0], moved[1]);
        return changed;
    }
    false
}

/// Numbers and colour of the selected point.
fn selected(editor: &mut TransferEditor, points: &mut [[f64; 5]], ui: &mut Ui) -> bool {
    let Some(index) = editor.selected.filter(|&index| index < points.len()) else { return false };
    let least = index.checked_sub(1).map_or(f64::MIN, |before| points[before][0]);
    let most = points.get(index + 1).map_or(f64::MAX, |after| after[0]);
    let point = &mut points[index];
    let mut changed = false;
    ui.horizontal(|ui| {
        let mut colour = [point[1], point[2], point[3]].map(|c| c as f32);
        if ui.color_edit_button_rgb(&mut colour).changed() {
            [point[1], point[2], point[3]] = colour.map(f64::from);
            changed = true;
        }
        let value = egui::DragValue::new(&mut point[0]).speed(0.01).prefix("value ");
        changed |= ui.add(value.range(least..=most)).changed();
        let opacity = egui::DragValue::new(&mut point[4]).speed(0.005).prefix("opacity ");
        changed |= ui.add(opacity.range(0.0..=1.0)).changed();
    });
    changed
}

/// A histogram and the volume that it is of.
pub type Known = (Arc<Volume>, Arc<OfDensities>);

/// The histogram of a volume, if it is among those that are known.
pub fn known(all: &[Known], volume: &Arc<Volume>) -> Option<Arc<OfDensities>> {
    let own = all.iter().find(|(known, _)| Arc::ptr_eq(known, volume));
    own.map(|(_, histogram)| histogram.clone())
}
