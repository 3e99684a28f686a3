//! The exact integral beside what is drawn, on a thread of its own: the difference of the picture, and
//! a light ray's transmittance as every kind of map keeps it. The latest question counts.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use deepshadow::accuracy::{ExactPoints, ExactTexels};
use deepshadow::glam::DVec3;
use deepshadow::image::Image;
use deepshadow::progress::Progress;
use deepshadow::reference::{Extinction, TexelProfile};
use deepshadow::scene::Beam;
use deepshadow::settings::MapKind;
use deepshadow::shadow::{Map, Shadow};
use deepshadow::{Backend, CpuBackend, ErrorKind, Frame, Result, Scene, Settings};
use eframe::egui;

/// Points of a curve.
const POINTS: usize = 160;
/// Distances of the pixels that are compared, one after another.
const SPACINGS: [usize; 4] = [16, 8, 4, 2];
/// Pixels that are computed before it is asked whether they are still wanted.
const AT_ONCE: usize = 256;
/// Edge of the picture of a map.
const MAP_PICTURE: usize = 256;

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

/// Compares pixels of a picture, ever closer ones.
fn difference(
    scene: &Scene,
    settings: &Settings,
    image: &Image,
    wanted: &Wanted,
    tell: &dyn Fn(Answer),
) -> Result<()> {
    let settings = settings.with(|settings| settings.image.tolerance = 0.0);
    let [width, height] = [image.width as usize, image.height as usize];
    let beams = scene.beams_for(&settings)?;
    let mut parts = Vec::new();
    for beam in &beams {
        let exact = ExactPoints(ExactTexels::new(beam, settings.map.size));
        parts.push((beam, Frame::new(beam, &settings)?, exact));
    }
    let bright = brightest(image);
    let mut known: HashMap<[u32; 2], f64> = HashMap::new();
    let pixels_at = |spacing: usize| {
        let half = spacing / 2;
        let rows = (half..height).step_by(spacing);
        rows.flat_map(move |y| (half..width).step_by(spacing).map(move |x| [x as u32, y as u32]))
    };
    let all: usize = SPACINGS.iter().map(|&spacing| pixels_at(spacing).count()).sum();
    let mut done = 0;
    for spacing in SPACINGS {
        let pixels: Vec<[u32; 2]> = pixels_at(spacing).collect();
        for chunk in pixels.chunks(AT_ONCE) {
            wanted.check()?;
            let mut sum = Image::filled(chunk.len() as u32, 1, [0.0; 4]);
            for (beam, frame, exact) in &parts {
                let seen = CpuBackend.march_pixels(beam.casters(), frame, exact, chunk)?;
                let seen = Image { width: chunk.len() as u32, height: 1, pixels: seen };
                beam.add(&seen, &mut sum);
            }
            for (&[x, y], truth) in chunk.iter().zip(&sum.pixels) {
                let own = image.pixel(x, y);
                let off = (0..3).map(|c| f64::from((own[c] - truth[c]).abs()));
                known.insert([x, y], off.fold(0.0, f64::max) / bright);
            }
            done += chunk.len();
            if done % (AT_ONCE * 8) < AT_ONCE {
                let share = done as f32 / all as f32;
                tell(Answer::Difference(heat(&known, [width, height], spacing, share)));
            }
        }
        let share = done as f32 / all as f32;
        tell(Answer::Difference(heat(&known, [width, height], spacing, share)));
    }
    Ok(())
}

/// The 99.9th percentile of the largest channels, above 0.
fn brightest(image: &Image) -> f64 {
    let mut largest: Vec<f32> =
        image.pixels.iter().map(|&[r, g, b, _]| r.max(g).max(b)).filter(|c| *c > 0.0).collect();
    if largest.is_empty() {
        return 1.0;
    }
    let rank = (largest.len() - 1) * 999 / 1000;
    f64::from(*largest.select_nth_unstable_by(rank, f32::total_cmp).1)
}

/// A picture of the differences at the pixels with this distance.
fn heat(
    known: &HashMap<[u32; 2], f64>,
    [width, height]: [usize; 2],
    spacing: usize,
    share: f32,
) -> Difference {
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for &off in known.values() {
        squares += off * off;
        largest = largest.max(off);
    }
    let rms = (squares / known.len().max(1) as f64).sqrt();
    let scale = (8.0 * rms).max(1e-6);
    let [columns, rows] = [width, height].map(|n| n.div_ceil(spacing).max(1));
    let half = spacing / 2;
    let pixel = |column: usize, row: usize| {
        let at = [(column * spacing + half) as u32, (row * spacing + half) as u32];
        // Where no finer pixel was compared yet, the nearest of a coarser lattice is shown.
        let finer = SPACINGS.iter().rev().filter(|&&coarse| coarse >= spacing);
        let near = finer.filter_map(|&coarse| {
            let half = (coarse / 2) as f64;
            let to = |c: u32| {
                let steps = ((f64::from(c) - half) / coarse as f64).round().max(0.0);
                (steps * coarse as f64 + half) as u32
            };
            known.get(&at.map(to))
        });
        let near = near.copied().next();
        colour(near.map_or(0.0, |off| off / scale))
    };
    let pixels: Vec<egui::Color32> =
        (0..rows).flat_map(|row| (0..columns).map(move |column| pixel(column, row))).collect();
    let heat = egui::ColorImage::new([columns, rows], pixels);
    Difference { heat, rms, largest, spacing, scale, share }
}

/// A colour for 0..1, dark for small ones (matplotlib's inferno, by the library's preset).
pub fn colour(x: f64) -> egui::Color32 {
    let at = x.clamp(0.0, 1.0) as f32;
    // Four of inferno's colours, sRGB.
    const STOPS: [[f32; 3]; 5] = [
        [0.0, 0.0, 4.0],
        [87.0, 16.0, 110.0],
        [188.0, 55.0, 84.0],
        [249.0, 142.0, 9.0],
        [252.0, 255.0, 164.0],
    ];
    let place = at * 4.0;
    let index = (place as usize).min(3);
    let t = place - index as f32;
    let mixed = [0, 1, 2].map(|c| {
        let (a, b) = (STOPS[index][c], STOPS[index + 1][c]);
        (a + t * (b - a)).round() as u8
    });
    egui::Color32::from_rgb(mixed[0], mixed[1], mixed[2])
}

/// The maps that were built for a light.
#[derive(Default)]
struct Maps {
    /// The scene, the settings and the light for which they were built.
    of: Option<(Arc<Scene>, Arc<Settings>, usize)>,
    built: Vec<(MapKind, Arc<Map>)>,
    /// The light ray of the last question.
    ray: Option<[f64; 3]>,
}

impl Maps {
    fn curves(&mut self, of: &Curves, wanted: &Wanted, tell: &dyn Fn(Answer)) -> Result<()> {
        let beams = of.scene.beams()?;
        let beams: Vec<&Beam> = beams.iter().filter(|beam| beam.index == of.light).collect();
        let Some(&first) = beams.first() else { return Ok(()) };
        let seen = match of.at {
            Some(at) => Some(seen_point(of, first, at)),
            None => None,
        };
        // The view that answers for the point, if the light has several.
        let owner =
            seen.and_then(|seen| beams.iter().find(|beam| beam.view.answers_for(seen)).copied());
        let beam = owner.unwrap_or(first);
        if let Some(place) = seen.and_then(|seen| beam.view.coordinates(seen)) {
            self.ray = Some([place.x.clamp(0.0, 1.0), place.y.clamp(0.0, 1.0), place.z]);
        }
        let same = self.of.as_ref().is_some_and(|(scene, settings, light)| {
            *light == of.light && same_maps((scene, settings), (&of.scene, &of.settings))
        });
        if !same {
            self.built.clear();
        }
        self.of = Some((of.scene.clone(), of.settings.clone(), of.light));
        let [u, v, depth] = self.ray.unwrap_or([0.5, 0.5, 0.0]);
        for (index, kind) in of.kinds.iter().enumerate() {
            wanted.check()?;
            let known = self.built.iter().any(|(known, _)| known == kind);
            if !known {
                let settings = of.settings.with(|settings| settings.map.kind = Some(*kind));
                let map = CpuBackend.map(beam, &settings, wanted)?;
                self.built.push((*kind, Arc::new(map)));
            }
            let last = index + 1 == of.kinds.len();
            if last || !known {
                let missing = of.kinds.len() - index - 1;
                tell(Answer::Curves(Box::new(self.drawn(of, beam, [u, v, depth], missing))));
            }
        }
        Ok(())
    }

    /// The curves of all maps that were built.
    fn drawn(&self, of: &Curves, beam: &Beam, [u, v, seen]: [f64; 3], missing: usize) -> Drawn {
        let exact = Extinction::of(beam.casters());
        let size = f64::from(of.settings.map.size);
        // The texel's own central ray, which maps keep.
        let centre = [u, v].map(|c| ((c * size).floor().min(size - 1.0) + 0.5) / size);
        let trace = |depths: &[f64]| TexelProfile::trace(&exact, &beam.view, centre, depths);
        let [enter, exit] = trace(&[]).extent;
        let [enter, exit] =
            if enter < exit { [enter, exit] } else { beam.view.depths_of(beam.casters()) };
        let margin = 0.04 * (exit - enter);
        let step = (exit - enter + 2.0 * margin) / (POINTS - 1) as f64;
        let depths: Vec<f64> = (0..POINTS).map(|i| enter - margin + i as f64 * step).collect();
        let truths = trace(&depths).transmittance;
        let truth = depths.iter().zip(&truths).map(|(&z, &t)| [z, t]).collect();
        let unit = beam.view.unit;
        let kinds = of.kinds.iter().filter_map(|kind| {
            let (_, map) = self.built.iter().find(|(known, _)| known == kind)?;
            let at = |z: f64| {
                let depth = (z / unit) as f32;
                f64::from(map.lookup(1, centre[0] as f32, centre[1] as f32, depth))
            };
            let curve: Vec<[f64; 2]> = depths.iter().map(|&z| [z, at(z)]).collect();
            let off = curve.iter().zip(&truths).map(|(point, truth)| (point[1] - truth).abs());
            let off = off.fold(0.0, f64::max);
            Some((*kind, curve, map.bytes(), off))
        });
        let kinds = kinds.collect();
        let first = of.kinds.first();
        let first = self.built.iter().find(|(known, _)| Some(known) == first);
        let map = first
            .map_or_else(egui::ColorImage::default, |(_, map)| picture(&**map, beam, of.channel));
        Drawn { at: [u, v], seen, truth, kinds, map, missing }
    }
}

/// Whether maps of one scene are those of the other.
fn same_maps(a: (&Scene, &Settings), b: (&Scene, &Settings)) -> bool {
    a.0.media.same(&b.0.media)
        && a.0.surfaces.same(&b.0.surfaces)
        && a.0.lights == b.0.lights
        && (a.1.map.size, a.1.quality, a.1.map.steps) == (b.1.map.size, b.1.quality, b.1.map.steps)
        && (&a.1.map.threshold, &a.1.map.fragments) == (&b.1.map.threshold, &b.1.map.fragments)
}

/// The point that is seen at a place in the picture: where half of what is taken is taken, or where
/// the ground is.
fn seen_point(of: &Curves, beam: &Beam, [x, y]: [f64; 2]) -> DVec3 {
    let [width, height] = of.settings.image.size.map(f64::from);
    let (origin, direction) = of.scene.camera.rays(width / height).ray(x, y);
    let exact = Extinction::of(beam.casters());
    let size = of.scene.camera.position.distance(of.scene.camera.target);
    let mut end = 100.0 * size.max(1e-9);
    if let Some(ground) = of.scene.ground {
        let t = (ground.height - origin.y) / direction.y;
        if t > 0.0 {
            end = end.min(t);
        }
    }
    let through = |t: f64| exact.transmittance(origin, direction, [0.0, t]);
    let all = through(end);
    if all > 0.5 && end < 100.0 * size {
        return origin + end * direction;
    }
    let (mut near, mut far) = (0.0, end);
    for _ in 0..48 {
        let middle = 0.5 * (near + far);
        if through(middle) > 0.5 * (1.0 + all) { near = middle } else { far = middle }
    }
    origin + far * direction
}

/// A picture of a map.
fn picture(map: &dyn Shadow, beam: &Beam, channel: Channel) -> egui::ColorImage {
    use rayon::prelude::*;
    let n = MAP_PICTURE;
    let unit = beam.view.unit;
    let [near, far] = beam.view.depths_of(beam.casters()).map(|depth| (depth / unit) as f32);
    let pixel = |index: usize| {
        let at = |i: usize| (i as f32 + 0.5) / n as f32;
        let (u, v) = (at(index % n), at(index / n));
        let through = |share: f32| map.lookup(1, u, v, near + share * (far - near));
        match channel {
            Channel::Opacity => colour(f64::from(1.0 - map.lookup(1, u, v, far * 1.5))),
            Channel::Transmittance(share) => {
                let grey = (through(share).clamp(0.0, 1.0) * 255.0).round() as u8;
                egui::Color32::from_gray(grey)
            }
            Channel::Depth(lost) => {
                let reached = |share: f32| through(share) <= 1.0 - lost;
                if !reached(1.01) {
                    return egui::Color32::TRANSPARENT;
                }
                let (mut low, mut high) = (0.0_f32, 1.01_f32);
                for _ in 0..12 {
                    let middle = 0.5 * (low + high);
                    if reached(middle) { high = middle } else { low = middle }
                }
                colour(f64::from(1.0 - high))
            }
        }
    };
    let pixels: Vec<egui::Color32> = (0..n * n).into_par_iter().map(pixel).collect();
    egui::ColorImage::new([n, n], pixels)
}
