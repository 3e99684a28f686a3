//! The picture, and the hands on it.

use eframe::egui::{
    self, Color32, PointerButton, Pos2, Rect, Response, Sense, Stroke, Ui, pos2, vec2,
};

use crate::explorer::Explorer;
use crate::hands;
use crate::host;
use crate::panels::Look;

/// Radius of the ball on which the light is dragged.
const BALL: f32 = 34.0;

/// What is around a picture that does not fill its place.
const SURROUNDINGS: Color32 = Color32::from_gray(24);

/// Shows the picture.
pub fn show(explorer: &mut Explorer, ui: &mut Ui) {
    let place = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(place, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "picture"));
    let scale = ui.ctx().pixels_per_point();
    let pixels = [place.width(), place.height()].map(|n| ((n * scale).round() as u32).max(1));
    explorer.resize(pixels);
    if explorer.document.is_none() && explorer.pictures[0].is_none() {
        ui.painter().rect_filled(place, 0.0, SURROUNDINGS);
        welcome(explorer, place, ui);
        return;
    }
    let Some(rect) = picture(explorer, place, ui) else {
        ui.painter().rect_filled(place, 0.0, SURROUNDINGS);
        return;
    };
    heat(explorer, rect, ui);
    clip_boxes(explorer, rect, ui);
    let ball = light_ball(explorer, place, ui);
    if !ball {
        hold(explorer, &response, rect, ui);
    }
}

/// Where the picture is: as large as its place allows.
fn fitted(place: Rect, [width, height]: [u32; 2]) -> Rect {
    let aspect = width as f32 / height as f32;
    let size = if place.width() / place.height() > aspect {
        vec2(place.height() * aspect, place.height())
    } else {
        vec2(place.width(), place.width() / aspect)
    };
    Rect::from_center_size(place.center(), size)
}

fn picture(explorer: &mut Explorer, place: Rect, ui: &mut Ui) -> Option<Rect> {
    let shown = explorer.pictures[0].as_ref()?;
    let rect = fitted(place, shown.picture.settings.image.size);
    // Not below the picture: processors that draw windows have enough to do.
    let [above, below] = [(place.min, rect.right_top()), (rect.left_bottom(), place.max)];
    let [before, behind] = [(place.min, rect.left_bottom()), (rect.right_top(), place.max)];
    for (from, to) in [above, below, before, behind] {
        let bar = Rect::from_min_max(from, to);
        if bar.is_positive() {
            ui.painter().rect_filled(bar, 0.0, SURROUNDINGS);
        }
    }
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    match shown.texture.id() {
        Some(texture) => _ = ui.painter().image(texture, rect, whole, Color32::WHITE),
        None => host::place_below(rect, ui.ctx()),
    }
    if let Some(beside) = &explorer.pictures[1]
        && explorer.beside.is_some()
    {
        let share = explorer.wiper;
        let x = rect.min.x + share * rect.width();
        let left = Rect::from_min_max(rect.min, pos2(x, rect.max.y));
        let part = Rect::from_min_max(whole.min, pos2(share, 1.0));
        if let Some(texture) = beside.texture.id() {
            ui.painter().image(texture, left, part, Color32::WHITE);
        }
        let line = Stroke::new(1.5, Color32::WHITE);
        ui.painter().vline(x, rect.y_range(), line);
        let above = pos2(x, rect.min.y + 8.0);
        label(ui, above - vec2(12.0, 0.0), egui::Align2::RIGHT_TOP, "kept");
        label(ui, above + vec2(12.0, 0.0), egui::Align2::LEFT_TOP, "now");
        let grip = Rect::from_center_size(pos2(x, rect.center().y), vec2(14.0, 48.0));
        let grip_response = ui.interact(grip, ui.scope_id().with("wiper"), Sense::drag());
        ui.painter().rect_filled(grip.shrink2(vec2(4.0, 8.0)), 3.0, Color32::WHITE);
        if let Some(pointer) = grip_response.interact_pointer_pos() {
            explorer.wiper = ((pointer.x - rect.min.x) / rect.width()).clamp(0.0, 1.0);
        }
    }
    Some(rect)
}

/// The difference to the truth, over the picture.
fn heat(explorer: &Explorer, rect: Rect, ui: &Ui) {
    if explorer.looking.look != Some(Look::Difference) {
        return;
    }
    let at_rest = explorer.is_drawn();
    if let (Some((difference, texture)), true) = (&explorer.looking.difference, at_rest) {
        let part = Rect::from_min_max(pos2(0.0, 0.0), difference.part.into());
        ui.painter().image(texture.id(), rect, part, Color32::WHITE);
        let text = format!(
            "difference to the truth: RMS {:.5}, largest {:.4}; bright is {:.4} and more",
            difference.rms, difference.largest, difference.scale
        );
        label(ui, rect.left_top() + vec2(8.0, 8.0), egui::Align2::LEFT_TOP, &text);
    }
}

/// A text over the picture.
fn label(ui: &Ui, at: Pos2, align: egui::Align2, text: &str) {
    let font = egui::FontId::proportional(13.0);
    let painter = ui.painter();
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let place = align.anchor_size(at, galley.size());
    painter.rect_filled(place.expand(4.0), 3.0, Color32::from_black_alpha(150));
    painter.galley(place.min, galley, Color32::WHITE);
}

/// The edges of what is kept of volumes, where something is clipped.
fn clip_boxes(explorer: &Explorer, rect: Rect, ui: &Ui) {
    let (Some(document), Some(scene)) = (&explorer.document, explorer.scene()) else { return };
    if document.file.volume.iter().all(|table| table.clip.is_none()) {
        return;
    }
    let seen = scene.camera.picture_from_world(f64::from(rect.width() / rect.height()));
    let painter = ui.painter().with_clip_rect(rect);
    let line = Stroke::new(1.0, Color32::from_rgb(255, 200, 60).gamma_multiply(0.6));
    let clipped = document.file.volume.iter().zip(&scene.bodies);
    for (_, body) in clipped.filter(|(table, _)| table.clip.is_some()) {
        let corners = body.corners.map(|corner| {
            let place = seen * corner.extend(1.0);
            // Behind the camera there is no place.
            (place.w > 1e-9).then(|| {
                let [x, y] = [place.x, place.y].map(|c| (c / place.w) as f32);
                rect.min + vec2(x * rect.width(), y * rect.height())
            })
        });
        // Corners whose numbers differ in one bit share an edge.
        for (from, bit) in (0..8).flat_map(|from| [1, 2, 4].map(|bit| (from, bit))) {
            if let (0, Some(from), Some(to)) = (from & bit, corners[from], corners[from | bit]) {
                painter.line_segment([from, to], line);
            }
        }
    }
}

/// What hands do on the picture.
fn hold(explorer: &mut Explorer, response: &Response, rect: Rect, ui: &Ui) {
    let (scroll, pinch, shift) = ui
        .input(|input| (input.smooth_scroll_delta().y, input.zoom_delta(), input.modifiers.shift));
    let Some(scene) = explorer.scene() else { return };
    if response.double_clicked() {
        explorer.frame();
        return;
    }
    let drag = response.drag_delta() / rect.height().max(1.0);
    let moved = [drag.x, drag.y].map(f64::from);
    let hovered = response.hovered();
    if explorer.looking.look == Some(Look::Curves)
        && hovered
        && let Some(pointer) = response.hover_pos()
        && rect.contains(pointer)
    {
        let at = (pointer - rect.min) / rect.size();
        explorer.looking.at = Some([at.x, at.y].map(f64::from));
    }
    let mut camera = scene.camera;
    // What hands have done since the picture was asked for.
    if let Some(document) = &explorer.document {
        let table = &document.file.camera;
        if let (Some(position), Some(target)) = (table.position, table.target) {
            (camera.position, camera.target) = (position.into(), target.into());
            if let deepshadow::scene::Projection::Orthographic { height } = &mut camera.projection {
                *height = table.height.unwrap_or(*height);
            }
        }
    }
    let before = camera;
    let fingers = ui.input(egui::InputState::multi_touch);
    let fingers = fingers.filter(|fingers| rect.contains(fingers.center_pos));
    if let Some(fingers) = fingers {
        let moved = fingers.translation_delta / rect.height().max(1.0);
        hands::pan(&mut camera, [moved.x, moved.y].map(f64::from));
        hands::zoom(&mut camera, f64::from(fingers.zoom_delta));
    } else if response.dragged() && drag != egui::Vec2::ZERO {
        let turns_light = explorer.holds_light != shift;
        let button = |button| response.dragged_by(button);
        if button(PointerButton::Primary) && turns_light {
            turn_light(explorer, moved);
        } else if button(PointerButton::Primary) {
            hands::orbit(&mut camera, moved);
        } else {
            hands::pan(&mut camera, moved);
        }
    }
    if fingers.is_none() && hovered && (scroll != 0.0 || pinch != 1.0) {
        let factor = f64::from((scroll * 0.004).exp() * pinch);
        hands::zoom(&mut camera, factor);
    }
    if camera != before
        && let Some(document) = &mut explorer.document
    {
        document.place_camera(&camera);
    }
}

/// Turns the light that hands hold.
pub fn turn_light(explorer: &mut Explorer, moved: [f64; 2]) {
    let middle = explorer.middle();
    let Some(scene) = explorer.scene() else { return };
    let index = explorer.light.min(scene.lights.len().saturating_sub(1));
    let Some(mut light) = scene.lights.get(index).copied() else { return };
    let Some(document) = &mut explorer.document else { return };
    // The view would follow the shadow otherwise.
    if document.file.camera.position.is_none() && document.file.camera.keyframes.is_none() {
        document.place_camera(&scene.camera);
    }
    // What hands have done since the picture was asked for.
    if let Some(table) = document.file.light.get(index) {
        use deepshadow::scene::LightKind;
        match &mut light.kind {
            LightKind::Directional { direction } => {
                *direction = table.direction.map_or(*direction, Into::into);
            }
            LightKind::Point { position } => {
                *position = table.position.map_or(*position, Into::into);
            }
            LightKind::Spot { position, direction, .. } => {
                *position = table.position.map_or(*position, Into::into);
                *direction = table.direction.map_or(*direction, Into::into);
            }
            _ => {}
        }
    }
    hands::turn_light(&mut light, middle, moved);
    document.light_tables(&scene.lights);
    document.place_light(index, &light);
}

/// A ball in the corner that is lit as the scene is; dragging it turns the light. Returns whether it
/// is being dragged.
fn light_ball(explorer: &mut Explorer, place: Rect, ui: &mut Ui) -> bool {
    let Some(scene) = explorer.scene() else { return false };
    let Some(light) = scene.lights.get(explorer.light) else { return false };
    let middle = place.right_bottom() - vec2(BALL + 14.0, BALL + 14.0);
    let area = Rect::from_center_size(middle, vec2(2.0 * BALL, 2.0 * BALL));
    let response = ui.interact(area, ui.scope_id().with("light ball"), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "light ball"));
    let [forward, right, up] = scene.camera.axes();
    let from = -light.direction_at(explorer.middle());
    let toward = [from.dot(right), from.dot(up), -from.dot(forward)].map(|c| c as f32);
    paint_ball(ui, middle, toward);
    let response = response.on_hover_text("drag: the light goes round");
    let drag = response.drag_delta();
    if response.dragged() && drag != egui::Vec2::ZERO {
        let moved = drag / (4.0 * BALL);
        turn_light(explorer, [moved.x, moved.y].map(f64::from));
    }
    response.dragged()
}

/// A ball lit from a direction (right, up, towards the eye).
fn paint_ball(ui: &Ui, middle: Pos2, toward: [f32; 3]) {
    const RINGS: usize = 14;
    const SECTORS: usize = 48;
    let mut mesh = egui::Mesh::default();
    let shade = |x: f32, y: f32| {
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let lit = (x * toward[0] + y * toward[1] + z * toward[2]).max(0.0);
        let grey = (40.0 + 200.0 * lit.sqrt()) as u8;
        Color32::from_rgba_unmultiplied(grey, grey, grey, 215)
    };
    mesh.colored_vertex(middle, shade(0.0, 0.0));
    for ring in 1..=RINGS {
        let radius = ring as f32 / RINGS as f32;
        for sector in 0..SECTORS {
            let angle = sector as f32 / SECTORS as f32 * std::f32::consts::TAU;
            let (x, y) = (radius * angle.cos(), radius * angle.sin());
            mesh.colored_vertex(middle + vec2(x, -y) * BALL, shade(x, y));
        }
    }
    let at = |ring: usize, sector: usize| {
        if ring == 0 { 0 } else { (1 + (ring - 1) * SECTORS + sector % SECTORS) as u32 }
    };
    for ring in 0..RINGS {
        for sector in 0..SECTORS {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
            mesh.add_triangle(a, c, d);
            if ring > 0 {
                mesh.add_triangle(a, d, b);
            }
        }
    }
    ui.painter().add(mesh);
    ui.painter().circle_stroke(middle, BALL, Stroke::new(1.0, Color32::from_gray(120)));
    // Where it comes from, hollow if from behind.
    let at = middle + vec2(toward[0], -toward[1]) * BALL;
    let sun = Color32::from_rgb(255, 200, 60);
    if toward[2] >= 0.0 {
        ui.painter().circle(at, 5.0, sun, Stroke::new(1.0, Color32::BLACK));
    } else {
        ui.painter().circle_stroke(at, 5.0, Stroke::new(2.0, sun));
    }
}

/// What an empty window says.
fn welcome(explorer: &mut Explorer, place: Rect, ui: &mut Ui) {
    let middle = Rect::from_center_size(place.center(), vec2(place.width().min(420.0), 220.0));
    let mut inner = ui.new_child(egui::UiBuilder::new().max_rect(middle));
    inner.vertical_centered(|ui| {
        ui.visuals_mut().override_text_color = Some(Color32::from_gray(210));
        ui.heading("Drop a volume, hair, a mesh or a scene here");
        ui.label("OpenVDB, NRRD, NIfTI, MetaImage, raw and others");
        ui.add_space(12.0);
        ui.label("or take an example");
        for preset in deepshadow::volume::presets::Preset::ALL {
            if ui.button(preset.name()).clicked() {
                explorer.open(preset.name());
            }
        }
    });
}

/// The list of keys.
pub fn help(explorer: &mut Explorer, context: &egui::Context) {
    let mut open = explorer.help;
    let window = egui::Window::new("Keys and hands").open(&mut open).resizable(false);
    let window = window.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO);
    window.show(context, |ui| {
        egui::Grid::new("keys").num_columns(2).spacing([16.0, 4.0]).show(ui, |ui| {
            for (keys, what) in [
                ("drag", "turn the camera"),
                ("Shift + drag, or the ball", "turn the light"),
                ("right or middle drag", "move the camera"),
                ("wheel, pinch", "nearer and farther"),
                ("two fingers", "move the camera, nearer and farther"),
                ("double-click, F", "show everything"),
                ("L", "let drags turn the light, or the camera"),
                ("C", "compare with the settings of now"),
                ("Space", "play a sequence"),
                ("P", "hide and show the panels"),
                ("F11", "full screen"),
                ("Ctrl + O, Ctrl + S", "open, save the picture"),
                ("Esc", "cancel what is being done"),
                ("?", "this list"),
            ] {
                ui.strong(keys);
                ui.label(what);
                ui.end_row();
            }
        });
    });
    explorer.help = open;
}
