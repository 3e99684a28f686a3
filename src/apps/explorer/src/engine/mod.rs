//! Draws what is wished for beside the window, on a thread of its own: the latest wish counts, and
//! whatever it replaces is given up. The window only asks ([`Engine::wish`](crate::host::Engine::wish)) and looks what has come
//! ([`Engine::events`](crate::host::Engine::events)).

pub mod as_text;
pub mod devices;
mod loading;
mod pace;
pub mod progress;
mod seen;
mod side;
pub mod truth;
pub mod worker;

use std::sync::Arc;
use std::time::Duration;

use deepshadow::image::{Image, Tone};
use deepshadow::scene::SceneFile;
use deepshadow::scene::automatic::Surroundings;
use deepshadow::{Scene, Settings, wgpu};
use eframe::egui;
use serde::{Deserialize, Serialize};

pub use devices::Device;
pub use pace::{Motion, Times};
pub use progress::Doing;
pub use seen::{Seen, SeenBody};
pub use side::of_map;

use crate::panels::OfDensities;

/// What is to be drawn.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Wish {
    /// The number of the document. What was loaded for another one is not taken for this.
    pub document: u64,
    /// The scene.
    #[serde(with = "as_text")]
    pub file: SceneFile,
    /// What surrounds it where that is left out.
    pub surroundings: Surroundings,
    /// Another scene to be drawn beside it, with the same camera.
    #[serde(with = "as_text::optional")]
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
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Picture {
    /// Which scene of a wish: 0, or 1 for the one beside.
    pub side: usize,
    /// The number of the wish ([`Engine::wish`](crate::host::Engine::wish)).
    pub serial: u64,
    /// The number of its document.
    pub document: u64,
    /// What a screen shows.
    #[serde(skip)]
    pub face: Face,
    /// Linear radiance; a picture that was drawn while something moved may have stayed on a device.
    #[serde(skip)]
    pub image: Option<Arc<Image>>,
    /// What it was made of, where the window shares that with what draws.
    #[serde(skip)]
    pub made: Option<Arc<Made>>,
    /// Its width and height in pixels.
    pub size: [u32; 2],
    /// Whether it is what `render` draws; else it was drawn while something moved.
    pub whole: bool,
    /// The completed scene.
    pub scene: Arc<Seen>,
    /// How it is computed when nothing moves.
    pub settings: Arc<Settings>,
    /// What else there is to know of its volumes.
    pub volumes: Arc<Vec<OfVolume>>,
    /// The text of the scene file that repeats it, if it is whole, or why there is none.
    pub saved: Option<Result<String, String>>,
    /// How radiance becomes what is shown.
    pub tone: Tone,
    /// How long its parts took.
    pub times: Times,
    /// What drew it.
    pub device: String,
    /// Texels along each edge of its maps.
    pub map_size: u32,
}

/// What a picture was made of.
#[derive(Clone, Debug)]
pub struct Made {
    /// The completed scene.
    pub scene: Arc<Scene>,
    /// How it is computed when nothing moves.
    pub settings: Arc<Settings>,
    /// Its linear radiance, if it was read back.
    pub image: Option<Arc<Image>>,
}

/// What a screen shows, sRGB-encoded.
#[derive(Clone, Debug)]
pub enum Face {
    /// Pixels.
    Pixels(egui::ColorImage),
    /// A texture on the window's device.
    Texture(wgpu::TextureView),
}

impl Default for Face {
    fn default() -> Self {
        Self::Pixels(egui::ColorImage::default())
    }
}

/// What there is to know of a loaded volume besides its medium.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct OfVolume {
    /// The window that was chosen for it.
    pub window: Option<[f32; 2]>,
    /// The points of its transfer function, over densities.
    pub points: Option<Vec<[f64; 5]>>,
    /// Its histogram, as soon as it is known.
    pub histogram: Option<Arc<OfDensities>>,
}

/// Something that has happened.
#[derive(Clone, Debug, Deserialize, Serialize)]
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
