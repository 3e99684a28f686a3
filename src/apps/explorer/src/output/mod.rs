//! What is written: pictures, the scene, numbered pictures, transfer functions; and the command that
//! makes the same picture.

mod command;
mod dialogs;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use deepshadow::image::{Image, Tone};
use deepshadow::io::{
    Inputs, PictureFormat, PictureOptions, is_scene_file, source_files, surface_files,
};
use deepshadow::scene::{Camera, Light, NumberedName, SceneFile};
use deepshadow::{Error, Result};
use eframe::egui::{self, Ui};

pub use command::command;
pub use dialogs::Found;

use crate::document::Document;
use crate::engine::Device;
use crate::explorer::{Dialog, Explorer};
use crate::{hands, host};

/// Files that are written at a time.
const MOST_PENDING: usize = 2;

/// What is being written.
pub struct Output {
    /// A picture and a scene that wait for rest.
    waiting: [Option<PathBuf>; 2],
    /// A turntable or a light that goes round.
    round: Option<Round>,
    /// The number of pictures of a round.
    pub count: u32,
    /// Whether the light goes round instead of the camera.
    pub of_light: bool,
    /// Lines from what writes.
    lines: (Sender<Line>, Receiver<Line>),
    /// How many pieces of work are not done.
    pending: usize,
}

/// What was written, or why it was not, and whether it was one of a round.
type Line = (std::result::Result<String, String>, bool);

/// Numbered pictures while the camera or the light goes round.
struct Round {
    name: NumberedName,
    next: u32,
    count: u32,
    of_light: bool,
    /// The document as it was.
    before: Document,
    /// The camera and the lights as they were.
    camera: Camera,
    lights: Vec<Light>,
    /// Whether the picture of the last step was asked for.
    turned: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            waiting: [None, None],
            round: None,
            count: 36,
            of_light: false,
            lines: channel(),
            pending: 0,
        }
    }
}

/// The panel.
pub fn show(explorer: &mut Explorer, document: &mut Document, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("picture…").on_hover_text("PNG, EXR and others, as render writes it").clicked()
        {
            explorer.ask(Dialog::Picture);
        }
        let hover = "a scene file that render takes and that can be opened here again";
        if ui.button("scene…").on_hover_text(hover).clicked() {
            explorer.ask(Dialog::Scene);
        }
    });
    let command = command(document, explorer.settings().map(|settings| settings.image.size));
    match command {
        Some(mut command) => {
            if explorer.device != Device::Auto {
                command.extend([" --backend ", explorer.device.name()]);
            }
            ui.horizontal(|ui| {
                let hover = "the command that makes this picture";
                if ui.button("copy command").on_hover_text(hover).clicked() {
                    ui.ctx().copy_text(command.clone());
                    explorer.say("the command is in the clipboard");
                }
            });
            ui.add(egui::Label::new(egui::RichText::new(command).monospace().small()).wrap());
        }
        None => {
            ui.weak("not all of it has options: save the scene, and render that");
        }
    }
    ui.horizontal(|ui| {
        let output = &mut explorer.output;
        let count = ui.add(egui::DragValue::new(&mut output.count).range(2..=9999));
        crate::panels::named(ui, &count, "pictures around");
        ui.label("pictures around");
        ui.selectable_value(&mut output.of_light, false, "the volume");
        ui.selectable_value(&mut output.of_light, true, "by the light");
    });
    let share = explorer.output.round.as_ref().map(|round| round.next as f32 / round.count as f32);
    match share {
        Some(share) => {
            ui.horizontal(|ui| {
                ui.add(egui::ProgressBar::new(share).desired_width(150.0));
                if ui.button("stop").clicked()
                    && let Some(round) = explorer.output.round.take()
                {
                    *document = round.before;
                }
            });
        }
        None => {
            if ui.button("numbered pictures…").clicked() {
                explorer.ask(Dialog::Frames);
            }
        }
    }
}

impl Explorer {
    /// Writes the picture as soon as nothing moves.
    pub fn save_picture(&mut self, path: PathBuf) {
        self.output.waiting[0] = Some(path);
        self.draw_again();
    }

    /// Writes a scene file that repeats the picture, as soon as nothing moves.
    pub fn save_scene(&mut self, path: PathBuf) {
        if !is_scene_file(&path) {
            let path = path.display();
            return self.complain(&format!("'{path}' does not end in .toml, as scene files do"));
        }
        self.output.waiting[1] = Some(path);
        self.draw_again();
    }

    /// The text of that scene file; `None` as long as nothing was drawn.
    ///
    /// # Errors
    /// If it cannot be written as text.
    pub fn scene_text(&self) -> std::result::Result<Option<String>, String> {
        self.shown().and_then(|shown| shown.picture.saved.clone()).transpose()
    }

    /// Writes a file, whole or not at all.
    pub(super) fn write(
        &mut self,
        path: PathBuf,
        make: impl FnOnce() -> Result<Vec<u8>> + Send + 'static,
    ) {
        let inputs = self.document.as_ref().map(|document| document.file.clone());
        let scene = self.document.as_ref().map(|document| PathBuf::from(&document.input));
        let (sender, context) = (self.output.lines.0.clone(), self.context().clone());
        let of_round = self.output.round.is_some();
        let done = move |written: Result<String>| {
            let _ = sender.send((written.map_err(|error| error.to_string()), of_round));
            context.request_repaint();
        };
        self.output.pending += 1;
        let inputs = move || inputs_of(inputs.as_ref(), scene);
        if host::write(path, inputs, make, done).is_err() {
            self.output.pending -= 1;
            self.complain("the system starts no thread to write a file");
        }
    }

    /// Writes a picture.
    fn write_picture(&mut self, path: PathBuf, image: Arc<Image>, tone: Tone, camera: Camera) {
        self.write(path.clone(), move || encode(&path, &image, tone, camera));
    }

    /// Begins to write numbered pictures.
    pub fn begin_round(&mut self, path: &Path) {
        let Some(name) = NumberedName::of(path) else {
            let path = path.display();
            return self
                .complain(&format!("'{path}' has no place for a number, such as #### or %04d"));
        };
        let (Some(before), Some(scene)) = (self.document.clone(), self.scene()) else { return };
        let (count, of_light) = (self.output.count, self.output.of_light);
        let (camera, lights) = (scene.camera, scene.lights.clone());
        self.output.round =
            Some(Round { name, next: 0, count, of_light, before, camera, lights, turned: false });
    }

    /// Whether something is still to be written.
    pub fn is_writing(&self) -> bool {
        let waits = self.output.waiting.iter().any(Option::is_some);
        self.output.pending > 0 || waits || self.output.round.is_some()
    }
}

impl Explorer {
    /// Ends a round of pictures, after which everything is as it was.
    pub fn end_round(&mut self) {
        if let Some(round) = self.output.round.take() {
            self.document = Some(round.before);
        }
    }

    /// Goes on with what waits to be written.
    pub fn advance_output(&mut self) {
        while let Ok(line) = self.output.lines.1.try_recv() {
            self.output.pending = self.output.pending.saturating_sub(1);
            match line {
                (Ok(line), _) => self.say(&line),
                (Err(line), of_round) => {
                    self.complain(&line);
                    if of_round {
                        // The next pictures would fail too.
                        self.end_round();
                    }
                }
            }
        }
        let waits = self.output.waiting.iter().any(Option::is_some) || self.output.round.is_some();
        if !waits || !self.is_at_rest() {
            return;
        }
        if !self.is_drawn() || self.shown().is_none() {
            self.output.waiting = [None, None];
            self.end_round();
            return self.complain("nothing was written: there is no whole picture");
        }
        // Disks may be slower than pictures are drawn.
        if self.output.pending > MOST_PENDING {
            return;
        }
        if let Some(path) = self.output.waiting[1].take() {
            match self.scene_text() {
                Ok(Some(text)) => self.write(path, move || Ok(text.into_bytes())),
                Ok(None) => {}
                Err(why) => self.complain(&why),
            }
        }
        let Some(shown) = self.shown() else { return };
        let picture = &shown.picture;
        let (tone, camera) = (picture.tone, picture.scene.camera);
        let Some(image) = picture.image.clone() else { return };
        if let Some(path) = self.output.waiting[0].take() {
            self.write_picture(path, image.clone(), tone, camera);
        }
        let next = self.output.round.as_ref().filter(|round| round.turned);
        if let Some(path) = next.map(|round| round.name.at(i64::from(round.next) + 1)) {
            self.write_picture(path, image, tone, camera);
        }
        let Some(mut round) = self.output.round.take() else { return };
        round.next += u32::from(round.turned);
        if round.next >= round.count {
            self.document = Some(round.before);
            return;
        }
        let turn = 2.0 * f64::from(round.next) / f64::from(round.count);
        round.turn(self, turn);
        round.turned = true;
        self.output.round = Some(round);
    }
}

impl Round {
    /// Turns by a number of half turns.
    fn turn(&self, explorer: &mut Explorer, turn: f64) {
        let middle = explorer.middle();
        let Some(document) = &mut explorer.document else { return };
        let mut camera = self.camera;
        if !self.of_light {
            hands::orbit(&mut camera, [turn, 0.0]);
        }
        document.place_camera(&camera);
        if self.of_light {
            document.light_tables(&self.lights);
            for (index, light) in self.lights.iter().enumerate() {
                let mut light = *light;
                hands::turn_light(&mut light, middle, [turn, 0.0]);
                document.place_light(index, &light);
            }
        }
    }
}

impl Explorer {
    /// All files that what is open was read from, and `more`, which must not be written to.
    pub fn inputs(&self, more: impl IntoIterator<Item = PathBuf>) -> Inputs {
        let scene = self.document.as_ref().map(|document| PathBuf::from(&document.input));
        let mut inputs = inputs_of(self.document.as_ref().map(|document| &document.file), scene);
        inputs.extend(more);
        inputs
    }
}

/// All files from which a scene is read.
fn inputs_of(file: Option<&SceneFile>, scene: Option<PathBuf>) -> Inputs {
    let mut inputs = Inputs::new(scene);
    let Some(file) = file else { return inputs };
    for table in file.volume.iter() {
        inputs.extend(source_files(table).unwrap_or_default());
    }
    for path in file.surfaces().filter_map(|(_, table)| table.path.as_ref()) {
        inputs.extend(surface_files(path).unwrap_or_default());
    }
    inputs
}

/// The bytes of a picture in the format of its name.
fn encode(path: &Path, image: &Image, tone: Tone, camera: Camera) -> Result<Vec<u8>> {
    let Some(format) = PictureFormat::of_path(path) else {
        let names = PictureFormat::ALL.map(|format| format!(".{}", format.name())).join(", ");
        return Err(Error::value(
            "picture",
            format!("'{}' ends in none of {names}", path.display()),
        ));
    };
    let options = PictureOptions::new(format).with(|options| {
        options.tone = tone;
        options.camera = Some(camera);
    });
    options.encode(image)
}
