//! Draws what is wished for, on a thread of its own: the latest wish counts, and whatever it replaces
//! is given up. The window only asks ([`Engine::wish`]) and looks what has come ([`Engine::events`]).

mod devices;
mod loading;
mod pace;
mod progress;
mod side;
mod texture;
pub mod truth;
mod worker;

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use deepshadow::image::{Image, Tone};
use deepshadow::scene::automatic::{Choice, Densities, Surroundings};
use deepshadow::scene::{SceneFile, TransferFunction};
use deepshadow::{Scene, Settings, wgpu};
use eframe::egui;
use eframe::egui_wgpu::RenderState;

pub use devices::{Device, Devices, is_hardware};
pub use pace::{Motion, Times};
pub use progress::Doing;
use progress::Shared;
pub use side::of_map;
use worker::Worker;

use crate::panels::OfDensities;

/// What is to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// The number of the document. What was loaded for another one is not taken for this.
    pub document: u64,
    /// The scene.
    pub file: SceneFile,
    /// What surrounds it where that is left out.
    pub surroundings: Surroundings,
    /// Another scene to be drawn beside it, with the same camera.
    pub beside: Option<SceneFile>,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// What moves.
    pub motion: Motion,
    /// How long a picture may take while something moves.
    pub budget: Duration,
    /// What draws.
    pub device: Device,
}

impl Wish {
    /// The scenes that are drawn: its own, and the one beside.
    pub fn files(&self) -> [Option<&SceneFile>; 2] {
        [Some(&self.file), self.beside.as_ref()]
    }

    /// Whether a window may be chosen for its volumes, as for scans.
    pub fn scans(&self) -> bool {
        self.surroundings == Surroundings::Studio
    }

    /// Whether it wants the same at rest.
    pub fn is_of_same_scene(&self, other: &Self) -> bool {
        let (motion, budget) = (self.motion, self.budget);
        *self == Self { motion, budget, ..other.clone() }
    }
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Which scene of a wish: 0, or 1 for the one beside.
    pub side: usize,
    /// The number of the wish ([`Engine::wish`]).
    pub serial: u64,
    /// The number of its document.
    pub document: u64,
    /// What a screen shows.
    pub face: Face,
    /// Linear radiance; a picture that was drawn while something moved may have stayed on a device.
    pub image: Option<Arc<Image>>,
    /// Its width and height in pixels.
    pub size: [u32; 2],
    /// Whether it is what `render` draws; else it was drawn while something moved.
    pub whole: bool,
    /// The completed scene.
    pub scene: Arc<Scene>,
    /// How it is computed when nothing moves.
    pub settings: Arc<Settings>,
    /// What was chosen for it.
    pub choices: Arc<Vec<Choice>>,
    /// What else there is to know of its volumes.
    pub volumes: Arc<Vec<OfVolume>>,
    /// How radiance becomes what is shown.
    pub tone: Tone,
    /// How long its parts took.
    pub times: Times,
    /// What drew it.
    pub device: String,
    /// Texels along each edge of its maps.
    pub map_size: u32,
}

/// What a screen shows, sRGB-encoded.
#[derive(Clone, Debug)]
pub enum Face {
    /// Pixels.
    Pixels(egui::ColorImage),
    /// A texture on the window's device.
    Texture(wgpu::TextureView),
}

/// What there is to know of a loaded volume besides its medium.
#[derive(Clone, Debug)]
pub struct OfVolume {
    /// The window that was chosen for it.
    pub window: Option<[f32; 2]>,
    /// Its transfer function, over densities.
    pub function: Option<Arc<TransferFunction>>,
    /// The map between densities and what it holds.
    pub densities: Densities,
    /// Its histogram, as soon as it is known.
    pub histogram: Option<Arc<OfDensities>>,
}

/// Something that has happened.
#[derive(Clone, Debug)]
pub enum Event {
    /// A picture was drawn.
    Picture(Box<Picture>),
    /// Something was loaded.
    Loaded {
        /// The number of its document.
        document: u64,
        /// What there is to say of it, one line each.
        notes: Vec<String>,
        /// The names of the grids in each volume's file.
        grids: Vec<Vec<String>>,
    },
    /// The wish with this number cannot be fulfilled. Files were not loaded if the flag says so.
    Failed {
        /// The number of the wish.
        serial: u64,
        /// Why, in one line.
        why: String,
        /// Whether a file could not be loaded.
        loading: bool,
    },
    /// The GPU failed, and the processor draws from now on.
    FellBack(String),
}

/// The thread that draws, and the way to it.
pub struct Engine {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
    last: Option<Wish>,
}

impl Engine {
    /// Starts it. Passes run on the device of `screen` if that is hardware; `context` is asked to
    /// repaint when something has happened.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(screen: Option<&RenderState>, context: &egui::Context) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (sender, events) = channel();
        let devices = Devices::of(screen);
        let repaint = context.clone();
        let tell = move |event: Event| {
            // Nobody listens any more when the window has closed.
            let _ = sender.send(event);
            repaint.request_repaint();
        };
        let own = shared.clone();
        let thread = std::thread::Builder::new().name("engine".to_owned());
        let thread = thread.spawn(move || Worker::new(own, devices, Box::new(tell)).run())?;
        Ok(Self { shared, events, thread: Some(thread), last: None })
    }

    /// Asks for a picture; returns the number of the wish. The same wish again is the same wish.
    pub fn wish(&mut self, wish: Wish) -> u64 {
        if self.last.as_ref() == Some(&wish) {
            return self.shared.serial.load(Ordering::Relaxed);
        }
        self.last = Some(wish.clone());
        self.shared.ask(wish)
    }

    /// The number of the latest wish.
    pub fn last_wish(&self) -> u64 {
        self.shared.serial.load(Ordering::Relaxed)
    }

    /// Gives up what is being drawn or loaded.
    pub fn cancel(&mut self) {
        self.last = None;
        self.shared.give_up();
    }

    /// The next wish counts as a new one, whatever it is.
    pub fn ask_again(&mut self) {
        self.last = None;
    }

    /// Whether something is being loaded.
    pub fn is_loading(&self) -> bool {
        self.doing().is_some_and(|doing| doing.share.is_none())
    }

    /// What has happened since the last call.
    pub fn events(&self) -> Vec<Event> {
        self.events.try_iter().collect()
    }

    /// What happens until there is a picture of the wish with this number, or until too much time
    /// has passed.
    pub fn wait_for(&self, serial: u64, most: Duration) -> Vec<Event> {
        let until = Instant::now() + most;
        let mut events = Vec::new();
        while let Ok(event) =
            self.events.recv_timeout(until.saturating_duration_since(Instant::now()))
        {
            let is_last = match &event {
                Event::Picture(picture) => picture.serial >= serial,
                _ => true,
            };
            events.push(event);
            if is_last {
                break;
            }
        }
        events
    }

    /// What is being done.
    pub fn doing(&self) -> Option<Doing> {
        self.shared.doing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether everything that was wished for is done.
    pub fn is_idle(&self) -> bool {
        self.shared.is_idle()
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        self.shared.quit();
        if let Some(thread) = self.thread.take() {
            // Drivers do not bear that a process ends while they work.
            let _ = thread.join();
        }
    }
}
