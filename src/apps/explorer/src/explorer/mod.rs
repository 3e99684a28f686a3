//! The window's contents and their state. It neither blocks nor draws pictures: it asks the engine
//! for them and shows what has come.

mod bars;
mod documents;
mod events;
mod input;
mod wishes;

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use deepshadow::Settings;
use deepshadow::glam::DVec3;
use deepshadow::math::Aabb;
use deepshadow::scene::SceneFile;
use eframe::egui::{self, Ui};
use web_time::Instant;

pub use documents::Opening;
use documents::Openings;
pub use events::Texture;

use crate::document::Document;
use crate::engine::{Device, Doing, Motion, Picture, Seen, Wish};
use crate::host::{self, Engine, Screen, Truth};
use crate::output::{Found, Output};
use crate::panels::{self, Looking, OfDensities, TransferEditor};

/// How long a message is shown.
const MESSAGE: Duration = Duration::from_secs(12);
/// A window narrower than this begins without panels.
const NARROW: f32 = 620.0;
/// Size of the picture before the window has said its own.
const FIRST_SIZE: [u32; 2] = [640, 360];

/// A picture in the window.
pub struct Shown {
    /// The picture.
    pub picture: Picture,
    /// What shows it.
    pub texture: Texture,
    /// Since when it is seen, if that is known before the window is drawn.
    pub since: Option<Instant>,
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

/// A dialog, and what it has found.
type Answered = (Dialog, Found);

/// The window. Its switches have nothing to do with each other.
#[allow(clippy::struct_excessive_bools)]
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
    /// The window's device.
    screen: Option<Screen>,
    /// Whether processors draw the window itself.
    is_software: bool,
    engine: Engine,
    truth: Truth,
    motion: Motion,
    moved: Option<Instant>,
    /// The scene file, and the frame, of the last look at the document.
    last: Option<SceneFile>,
    /// The number of the document, which panels take out while they change it.
    id: Option<u64>,
    /// The document as it was last drawn, to go back to if it cannot be drawn.
    good: Option<Document>,
    /// Documents that pictures were asked for, with the numbers of the wishes.
    asked: VecDeque<(u64, Document)>,
    /// The latest wish, and one that was given up.
    wished: Option<Wish>,
    cancelled: Option<Wish>,
    /// The number of a wish that cannot be fulfilled.
    failed: Option<u64>,
    /// The name of what is being opened.
    opening: Option<String>,
    openings: Openings,
    /// The names of the grids in each volume's file.
    pub grids: Vec<Vec<String>>,
    scales: HashMap<&'static str, f64>,
    dialogs: (Sender<Answered>, Receiver<Answered>),
    /// What is asked for where the system has no dialogs, and what was typed so far.
    pub typed: Option<(Dialog, String)>,
    context: egui::Context,
    arrived: Vec<Instant>,
    played: Instant,
    /// How often the window was drawn.
    frames: u64,
}

impl Explorer {
    /// Width of the panels in points: that of the widest row.
    pub const PANELS: f32 = 396.0;

    /// An explorer in which nothing is open. Passes run on the device of `screen` if it is hardware.
    ///
    /// # Errors
    /// If the system starts no threads.
    pub fn new(context: &egui::Context, screen: Option<&Screen>) -> std::io::Result<Self> {
        let engine = Engine::start(screen, context)?;
        let truth = Truth::start(&engine, context)?;
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
            screen: screen.cloned(),
            is_software: screen.is_some_and(Screen::is_software),
            engine,
            truth,
            motion: Motion::Rest,
            moved: None,
            last: None,
            id: None,
            good: None,
            asked: VecDeque::new(),
            wished: None,
            cancelled: None,
            failed: None,
            opening: None,
            openings: Openings::new(context),
            grids: Vec::new(),
            scales: HashMap::new(),
            dialogs: channel(),
            typed: None,
            context: context.clone(),
            arrived: Vec::new(),
            played: Instant::now(),
            frames: 0,
        })
    }

    /// The latest picture of the document.
    pub fn shown(&self) -> Option<&Shown> {
        self.pictures[0].as_ref().filter(|shown| Some(shown.picture.document) == self.id)
    }

    /// Tells people something.
    pub fn say(&mut self, text: &str) {
        // Keys are marked where programs look for them.
        let text = text.replace('`', "");
        self.messages.retain(|message| message.text != text);
        let message = Message { text, is_error: false, since: Instant::now() };
        self.messages.push(message);
    }

    /// Tells people that something went wrong.
    pub fn complain(&mut self, text: &str) {
        self.messages.retain(|message| message.text != text);
        let message = Message { text: text.to_owned(), is_error: true, since: Instant::now() };
        self.messages.push(message);
    }

    /// The scene of the latest picture.
    pub fn scene(&self) -> Option<Arc<Seen>> {
        self.shown().map(|shown| shown.picture.scene.clone())
    }

    /// The settings of the latest picture, as they are at rest.
    pub fn settings(&self) -> Option<Arc<Settings>> {
        self.shown().map(|shown| shown.picture.settings.clone())
    }

    /// The box around everything.
    pub fn bounds(&self) -> Aabb {
        let none = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        self.scene().and_then(|scene| scene.bounds).unwrap_or(none)
    }

    /// The middle of everything.
    pub fn middle(&self) -> DVec3 {
        self.bounds().center()
    }

    /// The points of a volume's transfer function, over densities.
    pub fn function(&self, index: usize) -> Option<Vec<[f64; 5]>> {
        self.shown()?.picture.volumes.get(index)?.points.clone()
    }

    /// The histogram of a volume, as soon as it is known.
    pub fn histogram(&self, index: usize) -> Option<Arc<OfDensities>> {
        self.shown()?.picture.volumes.get(index)?.histogram.clone()
    }

    /// The first value that was seen under a name, so that a slider's ends do not move with it.
    pub fn steady(&mut self, name: &'static str, now: f64) -> f64 {
        *self.scales.entry(name).or_insert(now)
    }

    /// Whether everything is drawn as `render` draws it, or cannot be drawn.
    pub fn is_at_rest(&self) -> bool {
        let still = self.opening.is_none() && self.engine.is_idle();
        let latest = self.engine.last_wish();
        let drawn =
            self.shown().is_some_and(|shown| shown.picture.whole && shown.picture.serial == latest);
        let nothing = self.document.is_none() && self.id.is_none();
        let given_up = self.cancelled.is_some() || self.failed == Some(latest);
        still && self.motion == Motion::Rest && (drawn || nothing || given_up)
    }

    /// Whether the picture is that of the document.
    pub fn is_drawn(&self) -> bool {
        self.is_at_rest() && self.cancelled.is_none() && self.failed != Some(self.last_wish())
    }

    /// What is being done.
    pub fn doing(&self) -> Option<Doing> {
        let opening = self.opening.as_ref().map(|name| format!("opening {name}"));
        opening.map(|what| Doing { what, share: None }).or_else(|| self.engine.doing())
    }

    /// Whether something is being opened.
    pub fn is_opening(&self) -> bool {
        self.opening.is_some()
    }

    /// The number of the latest wish.
    pub fn last_wish(&self) -> u64 {
        self.engine.last_wish()
    }

    /// Whether an answer about what is looked into is still missing.
    pub fn looks_into_something(&self) -> bool {
        let beside = self.beside.is_some()
            && !self.pictures[1].as_ref().is_some_and(|shown| shown.picture.whole);
        beside || (self.looking.look.is_some() && self.looking.pending)
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
        host::dropped(self, ui);
        self.bar(ui);
        self.status(ui);
        if self.frames == 0 && ui.available_width() < NARROW {
            self.panels = false;
        }
        self.frames += 1;
        if self.panels {
            // Its width does not follow its contents: the picture would be drawn anew.
            egui::Panel::left("panels").resizable(false).exact_size(Self::PANELS).show(ui, |ui| {
                panels::show(self, ui);
            });
        }
        let place = ui.available_rect_before_wrap();
        egui::CentralPanel::no_frame().show(ui, |ui| crate::view::show(self, ui));
        self.messages(ui.ctx(), place);
        crate::view::help(self, ui.ctx());
        self.show_typed(ui.ctx());
        self.advance();
        self.ask_for_pictures();
    }

    /// Shows everything again.
    pub fn frame(&mut self) {
        if let Some(document) = &mut self.document {
            document.frame_camera();
        }
    }

    /// The place where dialogs leave what they have found.
    pub fn found(&self) -> Sender<Answered> {
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
            self.moved = Some(Instant::now());
            if self.motion == Motion::Rest {
                self.motion = Motion::Camera;
            }
        }
    }
}
