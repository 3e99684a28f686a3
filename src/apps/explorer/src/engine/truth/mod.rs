//! The exact integral beside what is drawn, on a thread of its own: the difference of the picture, and
//! a light ray's transmittance as every kind of map keeps it. The latest question counts.

mod difference;
mod maps;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, LazyLock};

use deepshadow::image::Image;
use deepshadow::progress::Progress;
use deepshadow::scene::transfer::preset;
use deepshadow::settings::MapKind;
use deepshadow::{ErrorKind, Result, Scene, Settings};
use difference::difference;
use eframe::egui;
use maps::Maps;

use crate::panels::on_screen;

/// A question.
#[derive(Clone)]
pub enum Question {
    /// The difference of a picture from the one through exact transmittances.
    Difference {
        /// The scene.
        scene: Arc<Scene>,
        /// How it was drawn.
        settings: Arc<Settings>,
        /// What was drawn.
        image: Arc<Image>,
    },
    /// What maps keep along the light ray of a place in the picture.
    Curves(Box<Curves>),
}

/// The question for curves and the picture of a map.
#[derive(Clone)]
pub struct Curves {
    /// The scene.
    pub scene: Arc<Scene>,
    /// How it is drawn.
    pub settings: Arc<Settings>,
    /// The index of the light.
    pub light: usize,
    /// The place in the picture, 0..1 from the upper left; `None` keeps the last light ray.
    pub at: Option<[f64; 2]>,
    /// The kinds of map, the first of which is pictured.
    pub kinds: Vec<MapKind>,
    /// What the picture of the map shows.
    pub channel: Channel,
}

/// What a picture of a map shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Channel {
    /// The largest opacity.
    #[default]
    Opacity,
    /// The depth where this share of the light is lost.
    Depth(f32),
    /// Transmittance at this share of the depth.
    Transmittance(f32),
}

/// An answer.
#[derive(Clone, Debug)]
pub enum Answer {
    /// Differences so far.
    Difference(Difference),
    /// Curves.
    Curves(Box<Drawn>),
    /// There is none, and why.
    None(String),
}

/// The difference of a picture from the exact one.
#[derive(Clone, Debug)]
pub struct Difference {
    /// A picture of the differences, at the pixels that were compared.
    pub heat: egui::ColorImage,
    /// The share of its width and height that covers the picture; the rest is beyond its edge.
    pub part: [f32; 2],
    /// Root of the mean square of the differences of radiance, as a share of the brightest (the
    /// 99.9th percentile).
    pub rms: f64,
    /// The largest of them.
    pub largest: f64,
    /// The distance of the pixels that were compared.
    pub spacing: usize,
    /// The colour bar's end.
    pub scale: f64,
    /// The share of the work that is done.
    pub share: f32,
}

/// Curves along a light ray.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Where the ray is, (u, v) in the map.
    pub at: [f64; 2],
    /// The depth that is seen at the place in the picture.
    pub seen: f64,
    /// (depth, transmittance), exact.
    pub truth: Vec<[f64; 2]>,
    /// For each kind its curve, its bytes, and its largest error along it.
    pub kinds: Vec<(MapKind, Vec<[f64; 2]>, u64, f64)>,
    /// The picture of the first kind's map.
    pub map: egui::ColorImage,
    /// What is still missing.
    pub missing: usize,
}

/// The thread.
pub struct Truth {
    questions: Sender<(u64, Question)>,
    answers: Receiver<(u64, Answer)>,
    serial: Arc<AtomicU64>,
}

impl Truth {
    /// Starts it; `context` is asked to repaint when there is an answer.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(context: &egui::Context) -> std::io::Result<Self> {
        let (questions, asked) = channel::<(u64, Question)>();
        let (sender, answers) = channel();
        let serial = Arc::new(AtomicU64::new(0));
        let (latest, repaint) = (serial.clone(), context.clone());
        std::thread::Builder::new().name("truth".to_owned()).spawn(move || {
            let mut maps = Maps::default();
            while let Ok(mut question) = asked.recv() {
                while let Ok(newer) = asked.try_recv() {
                    question = newer;
                }
                let (number, question) = question;
                let wanted = Wanted { number, latest: latest.clone() };
                let tell = |answer: Answer| {
                    let _ = sender.send((number, answer));
                    repaint.request_repaint();
                };
                let answered = match &question {
                    Question::Difference { scene, settings, image } => {
                        difference(scene, settings, image, &wanted, &tell)
                    }
                    Question::Curves(curves) => maps.curves(curves, &wanted, &tell),
                };
                match answered {
                    Err(error) if !matches!(error.kind(), ErrorKind::Cancelled) => {
                        tell(Answer::None(error.to_string()));
                    }
                    _ => {}
                }
            }
        })?;
        Ok(Self { questions, answers, serial })
    }

    /// Asks; earlier questions are given up.
    pub fn ask(&self, question: Question) {
        let number = self.serial.fetch_add(1, Ordering::Relaxed) + 1;
        // The thread ends with this.
        let _ = self.questions.send((number, question));
    }

    /// Gives up.
    pub fn give_up(&self) {
        self.serial.fetch_add(1, Ordering::Relaxed);
    }

    /// Answers to the latest question.
    pub fn answers(&self) -> Vec<Answer> {
        let latest = self.serial.load(Ordering::Relaxed);
        let answers = self.answers.try_iter().filter(|(number, _)| *number == latest);
        answers.map(|(_, answer)| answer).collect()
    }
}

/// Whether an answer is still wanted.
struct Wanted {
    number: u64,
    latest: Arc<AtomicU64>,
}

impl Progress for Wanted {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
    fn cancelled(&self) -> bool {
        self.latest.load(Ordering::Relaxed) != self.number
    }
}

impl Wanted {
    fn check(&self) -> Result<()> {
        if self.cancelled() { Err(ErrorKind::Cancelled.into()) } else { Ok(()) }
    }
}

/// Steps of the colour map.
const STEPS: usize = 256;

/// The library's colour map inferno.
static INFERNO: LazyLock<Vec<egui::Color32>> = LazyLock::new(|| {
    let Ok(map) = preset("inferno") else { return vec![egui::Color32::BLACK; STEPS] };
    (0..STEPS).map(|i| on_screen(map.at(i as f64 / (STEPS - 1) as f64).0.to_array())).collect()
});

/// A colour for 0..1, dark for small ones.
pub fn colour(x: f64) -> egui::Color32 {
    INFERNO[(x.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize]
}
