//! What maps keep along a light ray, and their pictures.

use std::sync::Arc;

use deepshadow::backend::Cause;
use deepshadow::glam::DVec3;
use deepshadow::reference::{Extinction, TexelProfile};
use deepshadow::scene::Beam;
use deepshadow::settings::MapKind;
use deepshadow::shadow::{Map, Shadow};
use deepshadow::{Backend, CpuBackend, Result};
use eframe::egui;
use rayon::prelude::*;

use super::{Answer, Channel, Curves, Drawn, Made, Wanted, colour};

/// Points of a curve.
const POINTS: usize = 160;
/// Edge of the picture of a map.
const MAP_PICTURE: usize = 256;

/// The maps that were built for a light.
#[derive(Default)]
pub(super) struct Maps {
    /// What they depend on, besides their kind.
    cause: Option<Cause>,
    built: Vec<(MapKind, Arc<Map>)>,
    /// The light ray of the last question, (u, v) and the depth that is seen.
    ray: Option<[f64; 3]>,
}

impl Maps {
    /// Answers a question.
    ///
    /// # Errors
    /// If a map cannot be built, or if the answer is not wanted any more.
    pub(super) async fn curves(
        &mut self,
        of: &Curves,
        made: &Made,
        wanted: &Wanted,
        tell: &dyn Fn(Answer),
    ) -> Result<()> {
        let beams = made.scene.beams()?;
        let beams: Vec<&Beam> = beams.iter().filter(|beam| beam.index == of.light).collect();
        let Some(&first) = beams.first() else {
            tell(Answer::None("this light has no map".to_owned()));
            return Ok(());
        };
        let seen = of.at.map(|at| seen_point(made, first, at));
        if let Some(None) = seen {
            tell(Answer::None("there is nothing at this place".to_owned()));
            return Ok(());
        }
        let seen = seen.flatten();
        // The view that answers for the point, if the light has several.
        let owner =
            seen.and_then(|seen| beams.iter().find(|beam| beam.view.answers_for(seen)).copied());
        let beam = owner.unwrap_or(first);
        let usual = made.settings.with(|settings| settings.map.kind = None);
        let cause = Cause::of(beam, &usual);
        if !self.cause.as_ref().is_some_and(|known| known.same(&cause)) {
            self.built.clear();
            self.ray = None;
        }
        self.cause = Some(cause);
        if let Some(place) = seen.and_then(|seen| beam.view.coordinates(seen)) {
            self.ray = Some([place.x.clamp(0.0, 1.0), place.y.clamp(0.0, 1.0), place.z]);
        }
        let [u, v, depth] = self.ray.unwrap_or([0.5, 0.5, 0.0]);
        for (index, kind) in of.kinds.iter().enumerate() {
            wanted.check().await?;
            let known = self.built.iter().any(|(known, _)| known == kind);
            if !known {
                let settings = made.settings.with(|settings| settings.map.kind = Some(*kind));
                let map = CpuBackend.map(beam, &settings, wanted)?;
                self.built.push((*kind, Arc::new(map)));
            }
            let last = index + 1 == of.kinds.len();
            if last || !known {
                let missing = of.kinds.len() - index - 1;
                tell(Answer::Curves(Box::new(self.drawn(
                    (of, made),
                    beam,
                    [u, v, depth],
                    missing,
                ))));
            }
        }
        Ok(())
    }

    /// The curves of all maps that were built.
    fn drawn(
        &self,
        (of, made): (&Curves, &Made),
        beam: &Beam,
        [u, v, seen]: [f64; 3],
        missing: usize,
    ) -> Drawn {
        let exact = Extinction::of(beam.casters());
        let size = f64::from(made.settings.map.size);
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

/// The point that is seen at a place in the picture: where half of what is taken is taken, or where
/// the ground is; `None` if nothing is there.
fn seen_point(of: &Made, beam: &Beam, [x, y]: [f64; 2]) -> Option<DVec3> {
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
        return Some(origin + end * direction);
    }
    if all > 1.0 - 1e-6 {
        return None;
    }
    let (mut near, mut far) = (0.0, end);
    for _ in 0..48 {
        let middle = 0.5 * (near + far);
        if through(middle) > 0.5 * (1.0 + all) { near = middle } else { far = middle }
    }
    Some(origin + far * direction)
}

/// A picture of a map.
fn picture(map: &dyn Shadow, beam: &Beam, channel: Channel) -> egui::ColorImage {
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
