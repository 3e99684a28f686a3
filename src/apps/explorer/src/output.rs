//! What is written: pictures, the scene, numbered pictures, transfer functions; and the command that
//! makes the same picture.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use deepshadow::image::{Image, Tone};
use deepshadow::io::{
    Inputs, PendingFile, PictureFormat, PictureOptions, is_scene_file, source_files, surface_files,
};
use deepshadow::scene::file::{ExposureValue, TransferRange, TransferTable};
use deepshadow::scene::{Camera, Light, NumberedName, SceneFile};
use deepshadow::{Error, Result};
use eframe::egui::{self, Ui};

use crate::document::Document;
use crate::explorer::{Dialog, Explorer};
use crate::hands;

/// What is being written.
pub struct Output {
    /// A picture that waits for rest.
    waiting: Option<PathBuf>,
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

/// What was written, or why it was not.
type Line = std::result::Result<String, String>;

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
            waiting: None,
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
        Some(command) => {
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
        ui.add(egui::DragValue::new(&mut output.count).range(2..=9999));
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
    /// Asks for a file; the answer comes later ([`Explorer::chosen`]).
    pub fn ask(&mut self, dialog: Dialog) {
        let mut files = rfd::AsyncFileDialog::new();
        let stem = |ending: &str| {
            let path = self.document.as_ref().map(|document| document.default_output(ending));
            path.unwrap_or_default().to_string_lossy().into_owned()
        };
        files = match dialog {
            Dialog::Open => files.set_title("Open a volume, hair, a mesh or a scene"),
            Dialog::ImportTransfer => files.set_title("Import a transfer function"),
            Dialog::ExportTransfer => files.set_title("Export the transfer function"),
            Dialog::Picture => files.set_title("Save the picture").set_file_name(stem("png")),
            Dialog::Scene => files.set_title("Save the scene").set_file_name(stem("toml")),
            Dialog::Frames => {
                files.set_title("Name of the pictures").set_file_name(stem("####.png"))
            }
        };
        let (sender, context) = (self.found(), self.context().clone());
        let is_read = matches!(dialog, Dialog::Open | Dialog::ImportTransfer);
        let work = move || {
            let asked =
                async { if is_read { files.pick_file().await } else { files.save_file().await } };
            let path = pollster::block_on(asked).map(|file| file.path().to_owned());
            let _ = sender.send((dialog, path));
            context.request_repaint();
        };
        // The window goes on while the dialog is open.
        if std::thread::Builder::new().name("dialog".to_owned()).spawn(work).is_err() {
            self.complain("the system starts no thread for a dialog");
        }
    }

    /// Takes the answer of a dialog.
    pub fn chosen(&mut self, dialog: Dialog, path: PathBuf) {
        match dialog {
            Dialog::Open => self.open(&path.to_string_lossy()),
            Dialog::Picture => self.save_picture(path),
            Dialog::Scene => self.save_scene(path),
            Dialog::Frames => self.begin_round(&path),
            Dialog::ImportTransfer => {
                let index = self.volume;
                let table = self.document.as_mut().and_then(|own| own.file.volume.get_mut(index));
                if let Some(table) = table {
                    let gradient = table.transfer.take().and_then(|own| own.gradient);
                    let file = Some(path);
                    table.transfer =
                        Some(TransferTable { file, gradient, ..TransferTable::default() });
                }
            }
            Dialog::ExportTransfer => {
                let table = self.document.as_ref().and_then(|own| own.file.volume.get(self.volume));
                let table = table.and_then(|table| table.transfer.as_ref());
                if let Some(table) = table {
                    let text = crate::panels::exported(table);
                    self.write(path, move || Ok(text.into_bytes()));
                }
            }
        }
    }

    /// Writes the picture as soon as nothing moves.
    pub fn save_picture(&mut self, path: PathBuf) {
        self.output.waiting = Some(path);
    }

    /// Writes a scene file that repeats the picture.
    pub fn save_scene(&mut self, path: PathBuf) {
        if !is_scene_file(&path) {
            let path = path.display();
            return self.complain(&format!("'{path}' does not end in .toml, as scene files do"));
        }
        match self.scene_text() {
            Ok(Some(text)) => self.write(path, move || Ok(text.into_bytes())),
            Ok(None) => self.complain("nothing was drawn yet"),
            Err(error) => self.complain(&error.to_string()),
        }
    }

    /// The text of that scene file; `None` as long as nothing was drawn.
    ///
    /// # Errors
    /// If it cannot be written as text.
    pub fn scene_text(&self) -> Result<Option<String>> {
        let (Some(document), Some(shown)) = (&self.document, &self.pictures[0]) else {
            return Ok(None);
        };
        let picture = &shown.picture;
        let windows: Vec<_> = picture.volumes.iter().map(|volume| volume.window).collect();
        let saved = document.now()?.saved(&windows, &picture.scene, &picture.settings)?;
        saved.to_text().map(Some)
    }

    /// Writes a file on a thread of its own, whole or not at all.
    fn write(&mut self, path: PathBuf, make: impl FnOnce() -> Result<Vec<u8>> + Send + 'static) {
        let inputs = self.document.as_ref().map(|document| document.file.clone());
        let scene = self.document.as_ref().map(|document| PathBuf::from(&document.input));
        let (sender, context) = (self.output.lines.0.clone(), self.context().clone());
        let work = move || {
            let written = make().and_then(|contents| {
                let inputs = inputs_of(inputs.as_ref(), scene);
                PendingFile::create(&path, &inputs)?.finish_with(&contents)
            });
            let line = match written {
                Ok(()) => Ok(format!("wrote {}", path.display())),
                Err(error) => Err(error.to_string()),
            };
            let _ = sender.send(line);
            context.request_repaint();
        };
        self.output.pending += 1;
        if std::thread::Builder::new().name("writing".to_owned()).spawn(work).is_err() {
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
        self.output.pending > 0 || self.output.waiting.is_some() || self.output.round.is_some()
    }
}

impl Explorer {
    /// Goes on with what waits to be written.
    pub fn advance_output(&mut self) {
        while let Ok(line) = self.output.lines.1.try_recv() {
            self.output.pending = self.output.pending.saturating_sub(1);
            match line {
                Ok(line) => self.say(&line),
                Err(line) => {
                    self.complain(&line);
                    // The next pictures would fail too.
                    if let Some(round) = self.output.round.take() {
                        self.document = Some(round.before);
                    }
                }
            }
        }
        if !self.is_at_rest() || (self.output.waiting.is_none() && self.output.round.is_none()) {
            return;
        }
        let Some(shown) = &self.pictures[0] else { return };
        let picture = &shown.picture;
        let (image, tone, camera) = (picture.image.clone(), picture.tone, picture.scene.camera);
        if let Some(path) = self.output.waiting.take() {
            self.write_picture(path, image.clone(), tone, camera);
        }
        let Some(mut round) = self.output.round.take() else { return };
        if round.turned {
            let path = round.name.at(i64::from(round.next) + 1);
            self.write_picture(path, image, tone, camera);
            round.next += 1;
        }
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

/// The command that makes the picture of `document`, of a size in pixels; `None` if not all of it
/// can be said by options.
pub fn command(document: &Document, size: Option<[u32; 2]>) -> Option<String> {
    let (now, opened) = (&document.file, &document.opened);
    let mut said = opened.clone();
    let mut words = vec!["deepshadow".to_owned(), "render".to_owned(), quoted(&document.input)];
    let mut say =
        |option: &str, value: String| words.push(format!("--{option} {}", quoted(&value)));
    if document.frames.is_some() {
        say("frames", format!("{0}-{0}", document.frame));
    }
    // One volume and one light are what options speak of.
    if let ([table], [own]) = (&now.volume[..], &mut said.volume[..]) {
        set(&table.density_scale, &mut own.density_scale, |x| say("density-scale", real(*x)));
        set(&table.phase_g, &mut own.phase_g, |x| say("phase", real(*x)));
        set(&table.albedo, &mut own.albedo, |x| say("albedo", list(x)));
        set(&table.grid, &mut own.grid, |x| say("grid", x.clone()));
        set(&table.window, &mut own.window, |x| say("window", list(&x.map(f64::from))));
        set(&table.up, &mut own.up, |x| say("up", x.clone()));
        transfer(table.transfer.as_ref(), &mut own.transfer, &mut say);
    }
    let light = now.light.first();
    if let (Some(light), 1) = (light, now.light.len()) {
        let is_parallel = light.kind.as_deref().is_none_or(|kind| kind == "directional");
        let own = said.light.one_mut();
        if is_parallel && light.direction.is_some() {
            set(&light.direction, &mut own.direction, |x| say("light", list(x)));
            own.kind.clone_from(&light.kind);
        }
        if let Some(irradiance) = light.irradiance.filter(|_| light.irradiance != own.irradiance) {
            let colour = irradiance.map(|c| c / Light::UNIT_IRRADIANCE);
            if colour.map(|c| c * Light::UNIT_IRRADIANCE) == irradiance {
                say("light-color", list(&colour));
                own.irradiance = Some(irradiance);
            }
        }
    }
    camera(now, &mut said, &mut say);
    shadow(now, &mut said, &mut say);
    let (image, own) = (&now.image, &mut said.image);
    let [width, height] = size.unwrap_or([512, 512]);
    say("size", format!("{width}x{height}"));
    (own.width, own.height) = (image.width, image.height);
    set(&image.samples, &mut own.samples, |x| say("samples", x.to_string()));
    set(&image.tolerance, &mut own.tolerance, |x| say("picture-tolerance", real(*x)));
    set(&image.tonemap, &mut own.tonemap, |x| say("tonemap", x.clone()));
    set(&image.exposure, &mut own.exposure, |x| match x {
        ExposureValue::Factor(x) => say("exposure", real(*x)),
        ExposureValue::Text(text) => say("exposure", text.clone()),
    });
    let ground = &now.ground;
    if ground.enabled != said.ground.enabled && ground.enabled == Some(false) {
        say("ground", "none".to_owned());
        said.ground.enabled = Some(false);
    }
    set(&ground.height, &mut said.ground.height, |x| say("ground", real(*x)));
    set(&now.background.radiance, &mut said.background.radiance, |x| {
        say("background", list(x));
    });
    if *now != said {
        return None;
    }
    let out = document.default_output("png");
    Some(format!("{} -o {}", words.join(" "), quoted(&out.display().to_string())))
}

/// Says a key if it differs and was not left out.
fn set<T: Clone + PartialEq>(now: &Option<T>, own: &mut Option<T>, say: impl FnOnce(&T)) {
    if let Some(value) = now.as_ref().filter(|_| now != own) {
        say(value);
        *own = Some(value.clone());
    }
}

fn transfer(
    now: Option<&TransferTable>,
    own: &mut Option<TransferTable>,
    say: &mut impl FnMut(&str, String),
) {
    let Some(table) = now.filter(|_| now != own.as_ref()) else { return };
    let plain = TransferTable { name: None, file: None, range: None, ..table.clone() };
    if plain != TransferTable::default() {
        return;
    }
    match (&table.name, &table.file) {
        (Some(name), None) => say("transfer", name.clone()),
        (None, Some(file)) => say("transfer", file.display().to_string()),
        _ => return,
    }
    match table.range {
        Some(TransferRange::Values(range)) => say("transfer-range", list(&range)),
        Some(TransferRange::Word(_)) => say("transfer-range", "data".to_owned()),
        None => {}
    }
    *own = Some(table.clone());
}

fn camera(now: &SceneFile, said: &mut SceneFile, say: &mut impl FnMut(&str, String)) {
    let (table, own) = (&now.camera, &mut said.camera);
    if table.position.is_some() && table.position != own.position {
        // They are left out where a position stands.
        (own.azimuth_degrees, own.elevation_degrees, own.distance) = (None, None, None);
        (own.zoom, own.fit, own.keyframes) = (None, None, None);
    }
    set(&table.position, &mut own.position, |x| say("camera", list(x)));
    set(&table.target, &mut own.target, |x| say("target", list(x)));
    set(&table.up, &mut own.up, |x| say("up-vector", list(x)));
    set(&table.fov_y_degrees, &mut own.fov_y_degrees, |x| say("fov", real(*x)));
}

fn shadow(now: &SceneFile, said: &mut SceneFile, say: &mut impl FnMut(&str, String)) {
    let (table, own) = (&now.shadow, &mut said.shadow);
    set(&table.map, &mut own.map, |x| say("map", x.clone()));
    set(&table.size, &mut own.size, |x| say("map-size", x.to_string()));
    set(&table.filter, &mut own.filter, |x| say("filter", x.clone()));
    set(&table.quality, &mut own.quality, |x| say("quality", real(*x)));
    set(&table.steps, &mut own.steps, |x| say("steps", x.to_string()));
    set(&table.view_steps, &mut own.view_steps, |x| say("view-steps", x.to_string()));
    set(&table.lookup, &mut own.lookup, |x| say("lookup", x.clone()));
    set(&table.crossing, &mut own.crossing, |x| say("crossing", x.clone()));
    set(&table.thresholds, &mut own.thresholds, |x| say("thresholds", list(x)));
    set(&table.slices, &mut own.slices, |x| say("slices", x.clone()));
    set(&table.tolerance, &mut own.tolerance, |x| say("tolerance", real(*x)));
    set(&table.truncation, &mut own.truncation, |x| say("truncation", real(*x)));
    set(&table.shading, &mut own.shading, |x| say("shading", x.clone()));
    set(&table.light_samples, &mut own.light_samples, |x| say("light-samples", x.to_string()));
    set(&table.octaves, &mut own.octaves, |x| say("octaves", x.to_string()));
}

/// A number that is read as the same one.
fn real(x: f64) -> String {
    format!("{x}")
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|x| real(*x)).collect::<Vec<_>>().join(",")
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
