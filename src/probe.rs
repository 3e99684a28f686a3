//! A light meter: how much of each light arrives at given points, through shadow maps or exactly.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::reference::Extinction;
use crate::scene::{Beam, Channels, LightKind, LightView, Scene};
use crate::settings::Settings;
use crate::shadow::{Map, Shadow, TexelMap};

/// Fewest and most rays along each edge of a square over which an exact mean is taken.
const RAYS: [f64; 2] = [20.0, 96.0];
/// Such rays are at most this share of the thinnest strand's thickness apart, if they are not too
/// many.
const APART: f64 = 0.25;
/// Points with a normal are moved along it by this share of the casters' diagonal for rays...
const OFF_SURFACE: f64 = 1e-5;
/// ...and by this many texels' edges for maps: a filter reaches that far.
const OFF_TEXELS: f64 = 1.5;

/// Footprints in maps are at least this wide, in texels.
const LEAST_SPAN: f64 = 1e-3;
/// Depths beyond this, in units of the view, are those of points behind everything.
const FARTHEST: f32 = 1e30;

/// How light is measured.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Probe {
    /// Whether rays are traced in f64, in place of lookups in maps.
    pub exact: bool,
    /// The edge, in world lengths, of a square across the ray over which the mean is taken; `None`
    /// for the point itself. Its edges are along the map's u and v. In maps it is the mean of the
    /// texels, weighted by the parts of them that the square covers.
    pub footprint: Option<f64>,
    /// World lengths by which points are moved towards the light.
    pub bias: f64,
}

/// A point at which light is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbePoint {
    /// World position.
    pub position: DVec3,
    /// The normal of the surface that it lies on, of any length but zero. Light from behind does
    /// not arrive, and the point is moved a little along the normal, off its surface. `None` in
    /// free space.
    pub normal: Option<DVec3>,
}

impl From<DVec3> for ProbePoint {
    fn from(position: DVec3) -> Self {
        Self { position, normal: None }
    }
}

/// The share of each of the scene's lights that arrives at each of `points`, 0..1 for red, green
/// and blue: the transmittance of everything on the way. The result has a row of all lights for
/// each point. A spot light's cone is not part of it.
///
/// Maps are built by `backend` under `settings`, and looked up with their filter unless there is a
/// footprint.
///
/// # Errors
/// If a value is out of its range, or as [`Backend::map`].
pub fn probe(
    scene: &Scene,
    settings: &Settings,
    backend: &dyn Backend,
    points: &[ProbePoint],
    how: &Probe,
    progress: &dyn Progress,
) -> Result<Vec<Vec<[f32; 3]>>> {
    check(points, how)?;
    settings.check()?;
    let mut found = vec![vec![[0.0; 3]; scene.lights.len()]; points.len()];
    // A spot light among the casters has no views where it does not shine.
    let mut scene = scene.clone();
    for light in &mut scene.lights {
        if let LightKind::Spot { position, .. } = light.kind {
            light.kind = LightKind::Point { position };
        }
    }
    for beam in scene.beams()?.iter().filter(|beam| beam.index < scene.lights.len()) {
        let meter = Meter::new(beam, settings, backend, how, progress)?;
        if how.exact {
            progress.begin("rays", points.len() as u64);
        }
        found.par_iter_mut().zip(points).for_each(|(row, point)| {
            if let Some(value) = meter.at(point) {
                match beam.channels {
                    Channels::All => row[beam.index] = [value; 3],
                    Channels::One(channel) => row[beam.index][channel.min(2)] = value,
                }
            }
            if how.exact {
                progress.advance(1);
            }
        });
    }
    Ok(found)
}

fn check(points: &[ProbePoint], how: &Probe) -> Result<()> {
    if let Some(edge) = how.footprint
        && !(edge > 0.0 && edge.is_finite())
    {
        return Err(Error::value("footprint", format!("{edge} is not above 0")));
    }
    if !how.bias.is_finite() {
        return Err(Error::value("bias", format!("{} is not finite", how.bias)));
    }
    for (i, ProbePoint { position, normal }) in points.iter().enumerate() {
        if !position.is_finite() {
            return Err(Error::value("points", format!("point {i}, {position}, is not finite")));
        }
        if let Some(normal) = normal
            && normal.try_normalize().is_none()
        {
            return Err(Error::value("normals", format!("normal {i}, {normal}, has no direction")));
        }
    }
    Ok(())
}

/// What measures the light of one beam.
struct Meter<'a> {
    beam: &'a Beam,
    how: &'a Probe,
    source: Source<'a>,
}

enum Source<'a> {
    Exact(Box<Extinction<'a>>),
    Map { map: Box<Map>, window: u32 },
}

impl<'a> Meter<'a> {
    fn new(
        beam: &'a Beam,
        settings: &Settings,
        backend: &dyn Backend,
        how: &'a Probe,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let source = if how.exact {
            Source::Exact(Box::new(Extinction::of(beam.casters())))
        } else {
            let map = Box::new(backend.map(beam, settings, progress)?);
            map.prepare();
            Source::Map { map, window: settings.map.filter.window().0 }
        };
        Ok(Self { beam, how, source })
    }

    /// The share of the light at a point; `None` if another beam of the light answers for it.
    fn at(&self, point: &ProbePoint) -> Option<f32> {
        let view = &self.beam.view;
        if !view.answers_for(point.position) {
            return None;
        }
        let to_light = -self.beam.light.direction_at(point.position);
        let mut place = point.position + self.how.bias * to_light;
        if let Some(normal) = point.normal.and_then(DVec3::try_normalize) {
            if normal.dot(to_light) <= 0.0 {
                return Some(0.0);
            }
            place += self.off_surface(place) * normal;
        }
        match &self.source {
            Source::Exact(exact) => Some(self.exact(exact, place, to_light) as f32),
            Source::Map { map, window } => {
                let Some(mut light) = view.place(place) else { return Some(1.0) };
                light.z = light.z.clamp(-FARTHEST, FARTHEST);
                Some(match (self.how.footprint, map.texels()) {
                    (Some(edge), Some(texels)) => {
                        over_texels(texels, light.to_array(), edge / self.lengths(place))
                    }
                    _ => map.lookup(*window, light.x, light.y, light.z),
                })
            }
        }
    }

    /// World lengths by which a point is moved off its surface.
    fn off_surface(&self, place: DVec3) -> f64 {
        match &self.source {
            Source::Exact(_) => OFF_SURFACE * self.beam.casters().world_bounds().size().length(),
            Source::Map { map, .. } => {
                let texel = self.lengths(place).max_element() / f64::from(map.size().max(1));
                OFF_TEXELS * texel
            }
        }
    }

    /// Exact transmittance from the light to `place`, or its mean over the footprint.
    fn exact(&self, exact: &Extinction<'_>, place: DVec3, to_light: DVec3) -> f64 {
        let light = &self.beam.light;
        let Some(edge) = self.how.footprint else { return exact.light_transmittance(light, place) };
        let [across, down] = sides(&self.beam.view, to_light);
        let fine = edge / (APART * exact.crossings().thinnest());
        let count = fine.ceil().clamp(RAYS[0], RAYS[1]) as u32;
        let at = |i: u32| ((f64::from(i) + 0.5) / f64::from(count) - 0.5) * edge;
        let row = |j: u32| -> f64 {
            let places = (0..count).map(|i| place + at(i) * across + at(j) * down);
            places.map(|place| exact.light_transmittance(light, place)).sum()
        };
        (0..count).map(row).sum::<f64>() / f64::from(count * count)
    }

    /// The map's width and height at a world position, in world lengths.
    fn lengths(&self, place: DVec3) -> DVec2 {
        let view = &self.beam.view;
        match view.position {
            None => DVec2::new(view.origin_u.length(), view.origin_v.length()),
            // The map is that large at a distance of 1 along its axis.
            Some(_) => {
                let along = (view.light_from_world * place.extend(1.0)).w;
                DVec2::new(view.direction_u.length(), view.direction_v.length()) * along
            }
        }
    }
}

/// The directions of a footprint's edges: along the map's u and v, across the ray.
fn sides(view: &LightView, to_light: DVec3) -> [DVec3; 2] {
    let (u, v) = match view.position {
        None => (view.origin_u, view.origin_v),
        Some(_) => (view.direction_u, view.direction_v),
    };
    let across = u.reject_from_normalized(to_light).normalize_or(to_light.any_orthonormal_vector());
    let down = to_light.cross(across);
    [across, if down.dot(v) < 0.0 { -down } else { down }]
}

/// The mean of the texels that a rectangle of the map covers, weighted by the parts of them that it
/// covers; outside of the map transmittance is 1.
fn over_texels(map: &dyn TexelMap, [u, v, depth]: [f32; 3], spans: DVec2) -> f32 {
    let size = map.size();
    let range = |center: f32, span: f64| {
        let span = (span * f64::from(size)).max(LEAST_SPAN);
        let (center, half) = (f64::from(center) * f64::from(size), 0.5 * span);
        // Beyond one texel outside of the map all are alike.
        let inside = |c: f64| c.clamp(-1.0, f64::from(size) + 1.0);
        let ends = [center - half, center + half];
        (ends, inside(ends[0]).floor() as i64..=inside(ends[1]).floor() as i64)
    };
    let (us, columns) = range(u, spans.x);
    let (vs, rows) = range(v, spans.y);
    let covered =
        |[from, to]: [f64; 2], i: i64| (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0);
    let texels = 0..i64::from(size);
    let whole = (us[1] - us[0]) * (vs[1] - vs[0]);
    let mut shadow = 0.0;
    for y in rows.filter(|y| texels.contains(y)) {
        for x in columns.clone().filter(|x| texels.contains(x)) {
            let weight = covered(us, x) * covered(vs, y);
            if weight > 0.0 {
                let light = map.texel_transmittance(x as u32, y as u32, depth);
                shadow += weight * f64::from(1.0 - light);
            }
        }
    }
    (1.0 - shadow / whole) as f32
}
