//! The measuring itself: one scene, one truth, one map after the other.

use std::time::Instant;

use super::methods::Method;
use crate::accuracy::{
    Difference, Errors, ExactPoints, ExactTexels, Place, Points, Sample, TruePicture, lookup_time,
};
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::{Progress, Silent};
use crate::reference::{Extinction, TexelProfile};
use crate::scene::{LightView, Scene};
use crate::settings::Settings;
use crate::shadow::{Map, ShadowMap};

/// Points of a curve.
const CURVE_POINTS: usize = 160;

/// A scene whose truth is known.
pub(super) struct Bench<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub view: LightView,
    pub points: Points,
    frame: Frame,
    picture: TruePicture,
    pub true_image: Image,
    window: u32,
}

/// What one method comes to.
pub(super) struct Row {
    pub label: String,
    /// Bytes that a lookup may read, of the whole map; 0 for the exact integral.
    pub bytes: u64,
    /// Texels of a map; what keeps none (a grid over the volume) is held against as many.
    pub texels: u64,
    /// Seconds until the first lookup is answered.
    pub build_seconds: f64,
    pub lookup_nanoseconds: f64,
    /// In the order of [`Place::ALL`].
    pub errors: [Errors; 4],
    pub image: Image,
    pub difference: Difference,
    /// Where it errs most on a texel's central ray.
    pub worst: Option<Curve>,
}

/// Transmittance over depth along the central ray of one texel.
pub(super) struct Curve {
    pub texel: [u32; 2],
    /// Where the error is largest: depth, truth, and what the map says.
    pub depth: f64,
    pub truth: f64,
    pub found: f64,
    /// Depths where the ray enters and leaves the volume.
    pub extent: [f64; 2],
    /// (depth, truth, what the map says), by rising depth, from entry to exit and a little around.
    pub points: Vec<[f64; 3]>,
}

impl Row {
    pub(super) fn bytes_per_texel(&self) -> f64 {
        self.bytes as f64 / self.texels as f64
    }

    pub(super) fn at(&self, place: Place) -> &Errors {
        &self.errors[place as usize]
    }
}

impl<'a> Bench<'a> {
    /// Integrates the truth: `count` points of each place from `seed`, and the picture.
    pub(super) fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        [count, seed]: [u64; 2],
        progress: &dyn Progress,
    ) -> Result<Self> {
        let view = LightView::fit(scene.light(), &scene.media)?;
        let (frame, size) = (Frame::with_light_view(scene, settings, &view)?, settings.map_size);
        let points = Points::draw(scene, &view, size, &Place::ALL, [count, seed], progress);
        let exact = ExactPoints(ExactTexels::new(scene, &view, settings.map_size));
        let true_image = CpuBackend.march_view_through(&scene.media, &frame, &exact, progress);
        let picture = TruePicture::new(&true_image, settings.exposure as f32);
        let (window, _) = settings.filter.window();
        Ok(Self { scene, settings, view, points, frame, picture, true_image, window })
    }

    /// Builds and measures the map of `method`.
    pub(super) fn measure(&self, method: &Method) -> Result<Row> {
        let begun = Instant::now();
        let map: Map = CpuBackend.map(self.scene, &method.settings(self.settings), &Silent)?;
        map.texel_transmittance(0, 0, 0.0);
        let build_seconds = begun.elapsed().as_secs_f64();
        let lookup_nanoseconds = lookup_time(&map, &self.points, self.window);
        Ok(Row { build_seconds, lookup_nanoseconds, ..self.row(&method.label, &map) })
    }

    /// What the map's resolution alone costs: exact transmittance of every texel, filtered.
    pub(super) fn floor(&self) -> Row {
        let exact = ExactTexels::new(self.scene, &self.view, self.settings.map_size);
        self.row("exact texels", &exact)
    }

    fn row(&self, label: &str, map: &dyn ShadowMap) -> Row {
        let errors = Place::ALL.map(|place| self.points.errors(place, map, self.window));
        let media = &self.scene.media;
        let image = CpuBackend.march_view_through(media, &self.frame, map, &Silent);
        Row {
            label: label.to_owned(),
            bytes: map.bytes(),
            texels: u64::from(self.settings.map_size).pow(2),
            build_seconds: 0.0,
            lookup_nanoseconds: 0.0,
            errors,
            difference: self.picture.difference(&image),
            image,
            worst: self.points.worst(map).map(|sample| self.curve(map, sample)),
        }
    }

    /// The whole ray of a sample.
    fn curve(&self, map: &dyn ShadowMap, sample: Sample) -> Curve {
        let [u, v, depth] = sample.place;
        let n = self.settings.map_size;
        let texel = [u, v].map(|c| ((c * n as f32) as u32).min(n - 1));
        let center = texel.map(|i| (f64::from(i) + 0.5) / f64::from(n));
        let exact = Extinction::of(&self.scene.media);
        let trace = |depths: &[f64]| TexelProfile::trace(&exact, &self.view, center, depths);
        let [enter, exit] = trace(&[]).extent;
        let margin = 0.04 * (exit - enter);
        let step = (exit - enter + 2.0 * margin) / (CURVE_POINTS - 1) as f64;
        let depths: Vec<f64> =
            (0..CURVE_POINTS).map(|i| enter - margin + i as f64 * step).collect();
        let lookup = |depth: f32| f64::from(map.nearest(u, v, depth));
        let truths = trace(&depths).transmittance;
        let points = depths.iter().zip(truths).map(|(&z, truth)| [z, truth, lookup(z as f32)]);
        Curve {
            texel,
            depth: depth.into(),
            truth: sample.truth,
            found: lookup(depth),
            extent: [enter, exit],
            points: points.collect(),
        }
    }
}
