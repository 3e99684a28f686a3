//! The window's contents and their state. It neither blocks nor draws pictures: it asks the engine
//! for them and shows what has come.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use deepshadow::glam::DVec3;
use deepshadow::math::Aabb;
use deepshadow::scene::{SceneFile, TransferFunction};
use deepshadow::volume::Volume;
use deepshadow::volume::presets::Preset;
use deepshadow::{Scene, Settings};
use eframe::egui::{self, Key, Modifiers, Ui};
use eframe::egui_wgpu::RenderState;

use crate::document::Document;
use crate::engine::truth::{Answer, Truth};
use crate::engine::{Device, Engine, Event, Motion, Picture, Wish};
use crate::output::Output;
use crate::panels::{self, Looking, OfDensities, TransferEditor};

/// How long after a change a picture counts as one at rest.
const REST: Duration = Duration::from_millis(150);
/// How long a message is shown.
const MESSAGE: Duration = Duration::from_secs(12);
/// Pictures a second of a sequence that is played.
const PLAYED: f64 = 12.0;
/// Size of the picture before the window has said its own.
const FIRST_SIZE: [u32; 2] = [640, 360];
/// The largest picture that is drawn for a window.
const LARGEST: u32 = 8192;

/// A picture in the window.
pub struct Shown {
    /// The picture.
    pub picture: Picture,
    /// It on the screen.
    pub texture: egui::TextureHandle,
}

/// A line for people.
pub struct Message {
    /// The line.
    pub text: String,
    /// Whether something went wrong.
    pub is_error: bool,
    since: Instant,
}

/// A file dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialog {
    /// A file to explore.
    Open,
    /// A transfer function to read.
    ImportTransfer,
    /// A transfer function to write.
    ExportTransfer,
    /// The picture.
    Picture,
    /// The scene.
    Scene,
    /// The numbered pictures of a turntable or of a light that goes round.
    Frames,
}

/// What a dialog has found.
type Found = (Dialog, Option<PathBuf>);

/// The window.
pub struct Explorer {
    /// What is open.
    pub document: Option<Document>,
    /// The latest pictures: of the document, and of the settings beside.
    pub pictures: [Option<Shown>; 2],
    /// Settings to compare with.
    pub beside: Option<SceneFile>,
    /// Where the wiper stands, 0..1: the settings beside are on its left.
    pub wiper: f32,
    /// What draws.
    pub device: Device,
    /// How long a picture may take while something moves.
    pub budget: Duration,
    /// The size of the picture's place in pixels.
    pub size: [u32; 2],
    /// Whether hands hold the light instead of the camera.
    pub holds_light: bool,
    /// The light that hands hold.
    pub light: usize,
    /// The volume that the panel shows.
    pub volume: usize,
    /// Whether a sequence is played.
    pub playing: bool,
    /// The transfer function's editor.
    pub transfer: TransferEditor,
    /// What is looked into.
    pub looking: Looking,
    /// Whether the camera goes where the light is.
    pub look_from_light: bool,
    /// Pictures a second while something moves.
    pub rate: Option<f64>,
    /// What is written.
    pub output: Output,
    /// What there is to say.
    pub messages: Vec<Message>,
    /// Whether panels are shown.
    pub panels: bool,
    /// Whether the list of keys is shown.
    pub help: bool,
    /// Sections of the panels that are to be opened or closed.
    pub toggled: Vec<String>,
    /// Sections of the panels and whether they are open.
    pub opened: HashMap<String, bool>,
    engine: Engine,
    truth: Truth,
    motion: Motion,
    moved: Option<Instant>,
    /// The scene file, and the frame, of the last look at the document.
    last: Option<SceneFile>,
    /// The document as it was last drawn, to go back to if it cannot be drawn.
    good: Option<Document>,
    /// The names of the grids in each volume's file.
    pub grids: Vec<Vec<String>>,
    histograms: HashMap<usize, panels::Known>,
    scales: HashMap<&'static str, f64>,
    dialogs: (std::sync::mpsc::Sender<Found>, std::sync::mpsc::Receiver<Found>),
    context: egui::Context,
    arrived: Vec<Instant>,
    played: Instant,
    size_since: Instant,
}

impl Explorer {
    /// An explorer in which nothing is open. Passes run on the device of `screen` if it is hardware.
    ///
    /// # Errors
    /// If the system starts no threads.
    pub fn new(context: &egui::Context, screen: Option<&RenderState>) -> std::io::Result<Self> {
        let engine = Engine::start(screen, context)?;
        let truth = Truth::start(context)?;
        Ok(Self {
            document: None,
            pictures: [None, None],
            beside: None,
            wiper: 0.5,
            device: Device::Auto,
            budget: Duration::from_millis(33),
            size: FIRST_SIZE,
            holds_light: false,
            light: 0,
            volume: 0,
            playing: false,
            transfer: TransferEditor::default(),
            looking: Looking::default(),
            look_from_light: false,
            rate: None,
            output: Output::default(),
            messages: Vec::new(),
            panels: true,
            help: false,
            toggled: Vec::new(),
            opened: HashMap::new(),
            engine,
            truth,
            motion: Motion::Rest,
            moved: None,
            last: None,
            good: None,
            grids: Vec::new(),
            histograms: HashMap::new(),
            scales: HashMap::new(),
            dialogs: std::sync::mpsc::channel(),
            context: context.clone(),
            arrived: Vec::new(),
            played: Instant::now(),
            size_since: Instant::now(),
        })
    }

    /// Opens a preset, a scene file, or a file of a volume, of hair or of a mesh. If it cannot be
    /// opened, what was open before stays.
    pub fn open(&mut self, input: &str) {
        match Document::open(input) {
            Ok(document) => {
                self.messages.retain(|message| !message.is_error);
                for note in &document.notes {
                    self.say(note);
                }
                self.document = Some(document);
                (self.beside, self.pictures[1]) = (None, None);
                (self.light, self.volume, self.playing) = (0, 0, false);
                (self.transfer, self.histograms) = (TransferEditor::default(), HashMap::new());
                self.looking.at = None;
                self.scales.clear();
                self.last = None;
                let title = self.document.as_ref().map(Document::title).unwrap_or_default();
                let title = format!("{title} - deepshadow");
                self.context.send_viewport_cmd(egui::ViewportCommand::Title(title));
            }
            Err(error) => self.complain(&error.to_string()),
        }
    }

    /// Tells people something.
    pub fn say(&mut self, text: &str) {
        let message = Message { text: text.to_owned(), is_error: false, since: Instant::now() };
        self.messages.push(message);
    }

    /// Tells people that something went wrong.
    pub fn complain(&mut self, text: &str) {
        self.messages.retain(|message| message.text != text);
        let message = Message { text: text.to_owned(), is_error: true, since: Instant::now() };
        self.messages.push(message);
    }

    /// The scene of the latest picture.
    pub fn scene(&self) -> Option<Arc<Scene>> {
        self.pictures[0].as_ref().map(|shown| shown.picture.scene.clone())
    }

    /// The settings of the latest picture, as they are at rest.
    pub fn settings(&self) -> Option<Arc<Settings>> {
        self.pictures[0].as_ref().map(|shown| shown.picture.settings.clone())
    }

    /// The box around everything.
    pub fn bounds(&self) -> Aabb {
        let none = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        let Some(scene) = self.scene() else { return none };
        let media = (!scene.media.bodies().is_empty()).then(|| scene.media.world_bounds());
        let all = media.into_iter().chain(scene.surfaces.world_bounds());
        let all = all.reduce(|a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) });
        all.unwrap_or(none)
    }

    /// The middle of everything.
    pub fn middle(&self) -> DVec3 {
        self.bounds().center()
    }

    /// The transfer function of a volume, over densities.
    pub fn function(&self, index: usize) -> Option<Arc<TransferFunction>> {
        self.pictures[0].as_ref()?.picture.volumes.get(index)?.function.clone()
    }

    /// The histogram of a volume; made once for each.
    pub fn histogram(&mut self, index: usize, volume: &Arc<Volume>) -> Option<Arc<OfDensities>> {
        if let Some((known, histogram)) = self.histograms.get(&index)
            && Arc::ptr_eq(known, volume)
        {
            return Some(histogram.clone());
        }
        let densities = self.pictures[0].as_ref()?.picture.volumes.get(index)?.densities;
        let made = Arc::new(OfDensities::of(volume, &densities));
        self.histograms.insert(index, (volume.clone(), made.clone()));
        Some(made)
    }

    /// The first value that was seen under a name, so that a slider's ends do not move with it.
    pub fn steady(&mut self, name: &'static str, now: f64) -> f64 {
        *self.scales.entry(name).or_insert(now)
    }

    /// Starts or stops a sequence.
    pub fn play(&mut self, document: &mut Document) {
        self.playing = !self.playing && document.frames.is_some();
        self.played = Instant::now();
        if self.playing
            && let Some(scene) = self.scene()
        {
            document.fix(&scene);
        }
    }

    /// Whether everything is drawn as `render` draws it.
    pub fn is_at_rest(&self) -> bool {
        let whole = self.pictures[0].as_ref().is_some_and(|shown| shown.picture.whole);
        let nothing = self.document.is_none();
        self.engine.is_idle() && self.motion == Motion::Rest && (whole || nothing)
    }

    /// The number of the latest wish.
    pub fn last_wish(&self) -> u64 {
        self.engine.last_wish()
    }

    /// Whether an answer about what is looked into is still missing.
    pub fn looks_into_something(&self) -> bool {
        let Looking { heat, curves, difference, drawn, .. } = &self.looking;
        let compared = difference.as_ref().is_some_and(|(difference, _)| difference.share >= 1.0);
        let drawn = drawn.as_ref().is_some_and(|(drawn, _)| drawn.missing == 0);
        let refused = self.looking.refusal.is_some();
        let beside = self.beside.is_some()
            && !self.pictures[1].as_ref().is_some_and(|shown| shown.picture.whole);
        beside || (!refused && ((*heat && !compared) || (*curves && !drawn)))
    }

    /// Counts the hand's last change as over.
    pub fn settle(&mut self) {
        self.moved = None;
        self.motion = Motion::Rest;
    }

    /// Draws the window.
    pub fn show(&mut self, ui: &mut Ui) {
        self.receive();
        self.keys(ui);
        self.dropped(ui);
        self.bar(ui);
        self.status(ui);
        if self.panels {
            egui::Panel::left("panels").resizable(true).default_size(330.0).show(ui, |ui| {
                panels::show(self, ui);
            });
        }
        egui::CentralPanel::no_frame().show(ui, |ui| crate::view::show(self, ui));
        crate::view::help(self, ui.ctx());
        self.advance();
        self.ask_for_pictures();
    }

    /// Takes what the engine has made.
    fn receive(&mut self) {
        for event in self.engine.events() {
            match event {
                Event::Picture(picture) => self.take(*picture),
                Event::Loaded { notes, grids } => {
                    self.grids = grids;
                    notes.iter().for_each(|note| self.say(note));
                }
                Event::FellBack(why) => {
                    self.complain(&format!("{why}; the processor draws from now on"));
                }
                Event::Failed { why, loading, .. } => {
                    self.complain(&why);
                    // What cannot be loaded must not stay: nothing could be drawn any more.
                    if loading || self.pictures[0].is_none() {
                        self.document = self.good.clone();
                        self.last = None;
                    }
                }
            }
        }
        for answer in self.truth.answers() {
            let texture = |image: &egui::ColorImage, name: &str| {
                let options = egui::TextureOptions::NEAREST;
                self.context.load_texture(name, image.clone(), options)
            };
            match answer {
                Answer::Difference(difference) => {
                    let texture = texture(&difference.heat, "difference");
                    self.looking.difference = Some((difference, texture));
                }
                Answer::Curves(drawn) => {
                    let texture = texture(&drawn.map, "map");
                    self.looking.drawn = Some((*drawn, texture));
                }
                Answer::None(why) => self.looking.refusal = Some(why),
            }
        }
        while let Ok((dialog, path)) = self.dialogs.1.try_recv() {
            if let Some(path) = path {
                self.chosen(dialog, path);
            }
        }
    }

    /// Shows a picture.
    fn take(&mut self, picture: Picture) {
        let side = picture.side;
        if side == 0 {
            self.good.clone_from(&self.document);
            self.arrived.push(Instant::now());
        }
        let options = egui::TextureOptions::LINEAR;
        let known = self.pictures[side].take();
        let texture = match known {
            Some(mut known) => {
                known.texture.set(picture.shown.clone(), options);
                known.texture
            }
            None => self.context.load_texture("picture", picture.shown.clone(), options),
        };
        self.pictures[side] = Some(Shown { picture, texture });
        self.arrived.retain(|at| at.elapsed() < Duration::from_secs(1));
    }

    /// Notices changes, and asks for what they need.
    fn ask_for_pictures(&mut self) {
        let Some(document) = &self.document else { return };
        let surroundings = document.surroundings;
        let now = match document.now() {
            Ok(now) => now,
            Err(error) => return self.complain(&error.to_string()),
        };
        if let Some(last) = &self.last {
            if *last != now {
                let light = crate::engine::of_map(last) != crate::engine::of_map(&now);
                let motion = if light { Motion::Light } else { Motion::Camera };
                // A light that was moved is not at rest because the camera moves too.
                if self.motion != Motion::Light || light {
                    self.motion = motion;
                }
                self.moved = Some(Instant::now());
            }
        }
        self.last = Some(now.clone());
        match self.moved {
            Some(moved) if moved.elapsed() < REST => {
                self.context.request_repaint_after(REST.saturating_sub(moved.elapsed()));
            }
            _ => self.settle(),
        }
        let span = self.arrived.len() as f64;
        self.rate = (self.motion != Motion::Rest && span > 1.0).then_some(span);
        let own = now.image.width.zip(now.image.height);
        let size = own.map_or(self.size, |(width, height)| [width, height]);
        let beside = self.beside.clone().map(|mut beside| {
            // It is looked at from the same place, at the same size.
            beside.camera.clone_from(&now.camera);
            beside.image = now.image.clone();
            beside
        });
        let (motion, budget, device) = (self.motion, self.budget, self.device);
        let size = size.map(|n| n.clamp(1, LARGEST));
        self.engine.wish(Wish { file: now, surroundings, beside, size, motion, budget, device });
        self.ask_for_truth();
    }

    fn ask_for_truth(&mut self) {
        let Some(shown) = &self.pictures[0] else { return };
        if self.motion != Motion::Rest {
            self.truth.give_up();
            self.looking.asked = None;
            return;
        }
        if let Some(question) = self.looking.question(&shown.picture, self.light) {
            self.truth.ask(question);
        }
    }

    /// Goes on with what runs by itself.
    fn advance(&mut self) {
        self.messages.retain(|message| message.is_error || message.since.elapsed() < MESSAGE);
        if self.look_from_light {
            self.look_from_light = false;
            self.go_to_light();
        }
        if self.playing
            && let Some(document) = &mut self.document
            && let Some(frames) = document.frames.clone()
        {
            // The next frame waits for the last one.
            let drawn = self.engine.is_idle();
            let due = self.played.elapsed() >= Duration::from_secs_f64(1.0 / PLAYED);
            if drawn && due {
                let next = document.frame + 1;
                document.frame = if next > *frames.end() { *frames.start() } else { next };
                self.played = Instant::now();
            }
            self.context.request_repaint_after(Duration::from_millis(20));
        }
        self.advance_output();
    }

    /// The camera where the light is.
    fn go_to_light(&mut self) {
        let (Some(scene), bounds) = (self.scene(), self.bounds()) else { return };
        let Some(light) = scene.lights.get(self.light) else { return };
        let (middle, size) = (bounds.center(), bounds.size().length().max(1e-9));
        let mut camera = scene.camera;
        let way = light.direction_at(middle).normalize_or(DVec3::NEG_Y);
        camera.target = middle;
        camera.position = light.position().unwrap_or(middle - way * 2.0 * size);
        camera.up = if way.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
        if light.position().is_none() {
            let kind = deepshadow::scene::Projection::Orthographic { height: 1.1 * size };
            camera.projection = kind;
        }
        if let Some(document) = &mut self.document {
            if light.position().is_none() {
                document.file.camera.kind = Some("orthographic".to_owned());
            }
            document.place_camera(&camera);
        }
    }

    fn keys(&mut self, ui: &Ui) {
        if ui.ctx().egui_wants_keyboard_input() {
            return;
        }
        let pressed = |key: Key| ui.input(|input| input.key_pressed(key));
        let command = |key: Key| ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, key));
        if command(Key::O) {
            self.ask(Dialog::Open);
        }
        if command(Key::S) {
            self.ask(Dialog::Picture);
        }
        if ui.input(|input| input.modifiers.any()) && !pressed(Key::Questionmark) {
            return;
        }
        if pressed(Key::F) {
            self.frame();
        }
        if pressed(Key::L) {
            self.holds_light = !self.holds_light;
        }
        if pressed(Key::Tab) {
            self.panels = !self.panels;
        }
        if pressed(Key::Questionmark) || pressed(Key::F1) {
            self.help = !self.help;
        }
        if pressed(Key::Escape) {
            self.help = false;
            self.engine.cancel();
        }
        if pressed(Key::F11) {
            let full = ui.input(|input| input.viewport().fullscreen.unwrap_or(false));
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
        }
        if pressed(Key::Space)
            && let Some(mut document) = self.document.take()
        {
            self.play(&mut document);
            self.document = Some(document);
        }
        if pressed(Key::C) {
            let now = self.document.as_ref().and_then(|document| document.now().ok());
            self.beside = if self.beside.is_some() { None } else { now };
            self.pictures[1] = None;
        }
    }

    /// Shows everything again.
    pub fn frame(&mut self) {
        if let Some(document) = &mut self.document {
            document.frame_camera();
        }
    }

    fn dropped(&mut self, ui: &Ui) {
        let files = ui.input(|input| input.raw.dropped_files.clone());
        for file in files {
            self.open(&file.path().to_string_lossy());
        }
    }

    fn bar(&mut self, ui: &mut Ui) {
        egui::Panel::top("bar").show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                if ui.button("Open…").on_hover_text("Ctrl+O, or drop a file").clicked() {
                    self.ask(Dialog::Open);
                }
                ui.menu_button("Examples", |ui| {
                    for preset in Preset::ALL {
                        if ui.button(preset.name()).clicked() {
                            self.open(preset.name());
                            ui.close();
                        }
                    }
                });
                ui.separator();
                let open = self.document.is_some();
                let frame = egui::Button::new("Frame");
                if ui.add_enabled(open, frame).on_hover_text("F, or double-click").clicked() {
                    self.frame();
                }
                ui.selectable_value(&mut self.holds_light, false, "Camera")
                    .on_hover_text("drag turns the camera (L)");
                ui.selectable_value(&mut self.holds_light, true, "Light")
                    .on_hover_text("drag turns the light (L; or hold Shift)");
                ui.separator();
                let save = egui::Button::new("Save picture…");
                if ui.add_enabled(open, save).on_hover_text("Ctrl+S").clicked() {
                    self.ask(Dialog::Picture);
                }
                ui.toggle_value(&mut self.panels, "Panels").on_hover_text("Tab");
                egui::widgets::global_theme_preference_buttons(ui);
                ui.toggle_value(&mut self.help, "?").on_hover_text("keys");
            });
        });
    }

    fn status(&mut self, ui: &mut Ui) {
        egui::Panel::bottom("status").show(ui, |ui| {
            let mut gone = None;
            for (index, message) in self.messages.iter().enumerate().rev().take(4) {
                ui.horizontal_wrapped(|ui| {
                    if message.is_error {
                        ui.colored_label(ui.visuals().error_fg_color, &message.text);
                        if ui.small_button("dismiss").clicked() {
                            gone = Some(index);
                        }
                    } else {
                        ui.weak(&message.text);
                    }
                });
            }
            if let Some(index) = gone {
                self.messages.remove(index);
            }
            ui.horizontal(|ui| match self.engine.doing() {
                Some(doing) => {
                    let bar = match doing.share {
                        Some(share) => egui::ProgressBar::new(share),
                        None => egui::ProgressBar::new(0.0).animate(true),
                    };
                    ui.add(bar.desired_width(180.0).text(doing.what));
                    if ui.button("cancel").on_hover_text("Esc").clicked() {
                        self.engine.cancel();
                        if self.pictures[0].is_none() {
                            self.document = None;
                        }
                    }
                    ui.ctx().request_repaint_after(Duration::from_millis(60));
                }
                None => self.at_rest(ui),
            });
        });
    }

    /// What the status line says when nothing is being done.
    fn at_rest(&self, ui: &mut Ui) {
        let Some(shown) = &self.pictures[0] else {
            ui.weak("Open a file, drop one here, or take an example.");
            return;
        };
        let Picture { times, device, whole, image, .. } = &shown.picture;
        let state = if *whole { "as render draws it" } else { "moving" };
        let rate = self.rate.map_or(String::new(), |rate| format!(", {rate:.0} pictures a second"));
        let time = times.total * 1e3;
        let [width, height] = [image.width, image.height];
        ui.weak(format!("{state}: {width} x {height} in {time:.0} ms{rate}, {device}"));
    }

    /// The place where dialogs leave what they have found.
    pub fn found(&self) -> std::sync::mpsc::Sender<Found> {
        self.dialogs.0.clone()
    }

    /// The context of the window.
    pub fn context(&self) -> &egui::Context {
        &self.context
    }

    /// The size of the picture's place; a window that is being drawn larger is waited for.
    pub fn resize(&mut self, size: [u32; 2]) {
        if size != self.size {
            self.size = size;
            self.size_since = Instant::now();
            self.moved = Some(Instant::now());
            if self.motion == Motion::Rest {
                self.motion = Motion::Camera;
            }
        }
    }
}
