//! The exact integral beside what is drawn: the difference of the picture, and a light ray's
//! transmittance as every kind of map keeps it. The latest question counts.

mod difference;
mod maps;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock};

use deepshadow::progress::Progress;
use deepshadow::scene::transfer::preset;
use deepshadow::settings::MapKind;
use deepshadow::{ErrorKind, Result};
use difference::difference;
use eframe::egui;
use maps::Maps;
use serde::{Deserialize, Serialize};

use super::Made;
use crate::host::threads;
use crate::panels::on_screen;

/// A question about a picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub enum Question {
    /// The difference of the picture from the one through exact transmittances.
    Difference,
    /// What maps keep along the light ray of a place in the picture.
    Curves(Curves),
}

/// The question for curves and the picture of a map.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Curves {
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
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
#[derive(Clone, Debug, Deserialize, Serialize)]
pub enum Answer {
    /// Differences so far.
    Difference(Difference),
    /// Curves.
    Curves(Box<Drawn>),
    /// There is none, and why.
    None(String),
}

/// The difference of a picture from the exact one.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Difference {
    /// A picture of the differences, at the pixels that were compared.
    #[serde(skip)]
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
#[derive(Clone, Debug, Deserialize, Serialize)]
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
    #[serde(skip)]
    pub map: egui::ColorImage,
    /// What is still missing.
    pub missing: usize,
}

/// What answers questions: it keeps the maps that it built.
#[derive(Default)]
pub struct Answers {
    maps: Maps,
}

impl Answers {
    /// Answers a question about what `made` is. From time to time it waits for `wanted`.
    pub async fn answer(
        &mut self,
        question: &Question,
        made: &Made,
        wanted: &Wanted,
        tell: &dyn Fn(Answer),
    ) {
        let answered = match (question, &made.image) {
            (Question::Difference, Some(image)) => difference(made, image, wanted, tell).await,
            (Question::Difference, None) => Ok(()),
            (Question::Curves(curves), _) => self.maps.curves(curves, made, wanted, tell).await,
        };
        match answered {
            Err(error) if !matches!(error.kind(), ErrorKind::Cancelled) => {
                tell(Answer::None(error.to_string()));
            }
            _ => {}
        }
    }
}

/// Whether an answer is still wanted.
pub struct Wanted {
    /// The number of the question.
    pub number: u64,
    /// That of the latest one.
    pub latest: Arc<AtomicU64>,
}

impl Progress for Wanted {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {}
    fn cancelled(&self) -> bool {
        self.latest.load(Ordering::Relaxed) != self.number
    }
}

impl Wanted {
    /// Lets a browser say that it is not.
    async fn check(&self) -> Result<()> {
        threads::pause().await;
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
