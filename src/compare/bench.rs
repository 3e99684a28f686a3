//! The measurements: one scene, one truth, and one map after another.

use web_time::Instant;

use super::method::{Method, check_filter};
use crate::accuracy::{
    self, Difference, Errors, ExactPoints, ExactTexels, Place, Points, Sample, TruePicture,
    lookup_time,
};
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::{Progress, Silent};
use crate::reference::{Extinction, TexelProfile};
use crate::scene::{Beam, Scene};
use crate::settings::Settings;
use crate::shadow::{Map, Shadow};

/// Most points of each place.
pub const MOST_POINTS: u64 = 100_000_000;
/// Number of points of a curve.
const CURVE_POINTS: usize = 160;

/// A scene with its exact transmittances and its true picture.
pub struct Bench<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Sizes, filter and everything else that all methods share.
    pub settings: Settings,
    /// One part per beam.
    parts: Vec<Part>,
    picture: TruePicture,
    /// The picture marched through exact transmittances.
    pub true_image: Image,
    /// The seed of the points.
    pub seed: u64,
    window: u32,
}

/// A beam with its exact transmittances.
struct Part {
    beam: Beam,
    /// Its channel and light, if there are several beams.
    label: Option<String>,
    points: Points,
    frame: Frame,
}

/// The results of one method.
#[non_exhaustive]
pub struct Row {
    /// The method's label.
    pub label: String,
    /// Bytes that a lookup may read, of all maps together; 0 for the exact integral.
    pub bytes: u64,
    /// Number of texels; a map without texels (a grid over the volume) is compared with the same
    /// number.
    pub texels: u64,
    /// Seconds until the first lookup can be answered.
    pub build_seconds: f64,
    /// Nanoseconds per lookup on one CPU thread.
    pub lookup_nanoseconds: f64,
    /// Errors of all beams together, in the order of [`Place::ALL`].
    pub errors: [Errors; 4],
    /// Errors of each beam with its name, if there are several; in the order of [`Place::ALL`].
    pub channels: Vec<(String, [Errors; 4])>,
    /// The picture through the maps.
    pub image: Image,
    /// Its difference from the true picture.
    pub difference: Difference,
    /// Transmittance along the texel's central ray with the largest error.
    pub worst: Option<Curve>,
}

/// Transmittance over depth along the central ray of one texel.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The texel (x, y), from the upper left.
    pub texel: [u32; 2],
    /// Depth where the error is largest, in world lengths.
    pub depth: f64,
    /// Exact transmittance there.
    pub truth: f64,
    /// The map's transmittance there.
    pub found: f64,
    /// Depths where the ray enters and leaves the volume, in world lengths.
    pub extent: [f64; 2],
    /// (depth in world lengths, true transmittance, map's transmittance) by rising depth, from a
    /// little in front of the entry to a little behind the exit.
    pub points: Vec<[f64; 3]>,
}

impl Row {
    /// Bytes for each texel.
    pub fn bytes_per_texel(&self) -> f64 {
        self.bytes as f64 / self.texels as f64
    }

    /// The errors at one place.
    pub fn at(&self, place: Place) -> &Errors {
        &self.errors[place as usize]
    }
}

impl<'a> Bench<'a> {
    /// Integrates the truth: `count` points of each place from `seed`, and the picture.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if the filter cannot be measured
    /// ([`check_filter`]), if there is no point or more than [`MOST_POINTS`], if a light cannot be
    /// fitted to the media, or if the scene does not fit f32.
    pub fn new(
        scene: &'a Scene,
        settings: &Settings,
        [count, seed]: [u64; 2],
        progress: &dyn Progress,
    ) -> Result<Self> {
        settings.check()?;
        check_filter(settings)?;
        if !(1..=MOST_POINTS).contains(&count) {
            return Err(Error::value("points", format!("{count} is not in 1..{MOST_POINTS}")));
        }
        // Pictures differ by their maps alone.
        let settings = &settings.with(|s| s.image.tolerance = 0.0);
        let (beams, size) = (scene.beams()?, settings.map.size);
        let [width, height] = settings.image.size;
        let mut true_image = Image::filled(width, height, [0.0; 4]);
        let mut parts = Vec::new();
        for beam in &beams {
            let frame = Frame::new(beam, settings)?;
            let points = Points::draw(beam, size, &Place::ALL, [count, seed], progress);
            let exact = ExactPoints(ExactTexels::new(beam, size));
            let seen = CpuBackend.march_view_through(beam.casters(), &frame, &exact, progress)?;
            beam.add(&seen, &mut true_image);
            let label = beam.label(&beams);
            parts.push(Part { beam: beam.clone(), label, points, frame });
        }
        let picture = TruePicture::new(&true_image, settings.image.exposure as f32);
        let (window, _) = settings.map.filter.window();
        let settings = settings.clone();
        Ok(Self { scene, settings, parts, picture, true_image, seed, window })
    }

    /// The largest optical depth of a light ray through the maps.
    pub fn largest_optical_depth(&self) -> f64 {
        let deepest =
            |part: &Part| accuracy::largest_optical_depth(&part.beam, self.settings.map.size);
        self.parts.iter().map(deepest).fold(0.0, f64::max)
    }

    /// The mean number of points of a place at which each beam's map is looked up.
    pub fn points(&self, place: Place) -> usize {
        let all: usize = self.parts.iter().map(|part| part.points.of(place).len()).sum();
        all.div_ceil(self.parts.len().max(1))
    }

    /// Builds and measures the maps of `method`, for all beams.
    ///
    /// # Errors
    /// If such a map cannot be built.
    pub fn measure(&self, method: &Method) -> Result<Row> {
        let settings = method.settings(&self.settings);
        let (mut maps, mut build_seconds, mut lookup_nanoseconds) = (Vec::new(), 0.0, 0.0);
        for part in &self.parts {
            let begun = Instant::now();
            let map: Map = CpuBackend.map(&part.beam, &settings, &Silent)?;
            map.lookup(1, 0.0, 0.0, 0.0);
            build_seconds += begun.elapsed().as_secs_f64();
            lookup_nanoseconds += lookup_time(&map, &part.points, self.window);
            maps.push(map);
        }
        let maps: Vec<&dyn Shadow> = maps.iter().map(|map| map as &dyn Shadow).collect();
        Ok(Row { build_seconds, lookup_nanoseconds, ..self.row(&method.label, &maps)? })
    }

    /// The error of the maps' resolution alone: exact transmittance of every texel, filtered.
    ///
    /// # Errors
    /// If surfaces take too much memory.
    pub fn floor(&self) -> Result<Row> {
        let size = self.settings.map.size;
        let exact: Vec<_> = self.parts.iter().map(|part| part.exact(size)).collect();
        let exact: Vec<&dyn Shadow> = exact.iter().map(|map| map as &dyn Shadow).collect();
        self.row("exact texels", &exact)
    }

    fn row(&self, label: &str, maps: &[&dyn Shadow]) -> Result<Row> {
        let [width, height] = self.settings.image.size;
        let mut image = Image::filled(width, height, [0.0; 4]);
        let (mut each, mut worst) = (Vec::new(), None::<Curve>);
        for (part, &map) in self.parts.iter().zip(maps) {
            each.push(Place::ALL.map(|place| part.points.errors(place, map, self.window)));
            let casters = part.beam.casters();
            let seen = CpuBackend.march_view_through(casters, &part.frame, map, &Silent)?;
            part.beam.add(&seen, &mut image);
            let curve = part.points.worst(map).map(|sample| self.curve(part, map, sample));
            let worse = |a: &Curve, b: &Curve| a.error() < b.error();
            worst = match (worst, curve) {
                (Some(a), Some(b)) => Some(if worse(&a, &b) { b } else { a }),
                (a, b) => a.or(b),
            };
        }
        let errors = Place::ALL.map(|place| {
            let of_place: Vec<Errors> = each.iter().map(|errors| errors[place as usize]).collect();
            Errors::together(&of_place)
        });
        let names = self.parts.iter().filter_map(|part| part.label.clone());
        Ok(Row {
            label: label.to_owned(),
            bytes: maps.iter().map(|map| map.bytes()).sum(),
            texels: u64::from(self.settings.map.size).pow(2),
            build_seconds: 0.0,
            lookup_nanoseconds: 0.0,
            errors,
            channels: names.zip(each).collect(),
            difference: self.picture.difference(&image),
            image,
            worst,
        })
    }

    /// The curve along the whole ray of a sample, in world lengths.
    fn curve(&self, part: &Part, map: &dyn Shadow, sample: Sample) -> Curve {
        let [u, v, depth] = sample.place;
        let n = self.settings.map.size;
        let texel = [u, v].map(|c| ((c * n as f32) as u32).min(n - 1));
        let center = texel.map(|i| (f64::from(i) + 0.5) / f64::from(n));
        let exact = Extinction::of(part.beam.casters());
        let trace = |depths: &[f64]| TexelProfile::trace(&exact, &part.beam.view, center, depths);
        let [enter, exit] = trace(&[]).extent;
        let margin = 0.04 * (exit - enter);
        let step = (exit - enter + 2.0 * margin) / (CURVE_POINTS - 1) as f64;
        let depths: Vec<f64> =
            (0..CURVE_POINTS).map(|i| enter - margin + i as f64 * step).collect();
        let unit = part.beam.view.unit;
        let lookup = |depth: f32| f64::from(map.lookup(1, u, v, depth));
        let truths = trace(&depths).transmittance;
        let points =
            depths.iter().zip(truths).map(|(&z, truth)| [z, truth, lookup((z / unit) as f32)]);
        Curve {
            texel,
            depth: f64::from(depth) * unit,
            truth: sample.truth,
            found: lookup(depth),
            extent: [enter, exit],
            points: points.collect(),
        }
    }
}

impl Part {
    fn exact(&self, size: u32) -> ExactTexels<'_> {
        ExactTexels::new(&self.beam, size)
    }
}

impl Curve {
    fn error(&self) -> f64 {
        (self.found - self.truth).abs()
    }
}
