//! The points at which maps are looked up, with their exact transmittances. They are drawn once
//! from a seed and are the same for all maps.

use glam::DVec3;
use rayon::prelude::*;

use super::random::Random;
use super::surface_points::on_surfaces;
use super::{Errors, ExactTexels};
use crate::progress::Progress;
use crate::scene::{Beam, Body, Casters, LightView, Media};
use crate::shadow::Shadow;

/// A position in a map, with the exact transmittance there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// (u, v, depth): u and v in 0..1 over the map, depth along the ray in units of the view.
    pub place: [f32; 3],
    /// Transmittance from the light to the point, 0..1, exact to rounding.
    pub truth: f64,
}

/// A set of points, and so a part of the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// Anywhere in the box of the media and of surfaces.
    Volume,
    /// In voxels whose value is above 0, and on surfaces: on strands' axes and on triangles. Where
    /// there are both, half of the points are on surfaces.
    Medium,
    /// On the central rays of texels that hit those boxes, between entry and exit, looked up in that
    /// texel alone. This is the representation's own error, without that of the map's resolution.
    Rays,
    /// Behind the boxes, at up to their own depth behind them: the shadow that it casts on other
    /// objects.
    Behind,
}

impl Place {
    /// All of them, in the order of [`Points`].
    pub const ALL: [Self; 4] = [Self::Volume, Self::Medium, Self::Rays, Self::Behind];

    /// A short name for tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Volume => "volume",
            Self::Medium => "medium",
            Self::Rays => "rays",
            Self::Behind => "behind",
        }
    }
}

/// Number of random rays that may miss the volume in sequence before drawing stops. The map's
/// outline is tight, so about half of the rays hit.
const MOST_MISSES: usize = 1000;

/// The smallest edge of the box around surfaces in which points are drawn, as a share of the largest.
const FLATTEST: f64 = 0.1;

/// Samples of every [`Place`].
#[derive(Clone, Debug)]
pub struct Points {
    sets: [Vec<Sample>; 4],
}

impl Points {
    /// Draws `count` samples for each of `places` in `beam`, for its maps of `map_size` squared
    /// texels. The same `seed` gives the same samples. A place that does not exist (medium in an
    /// empty volume) has none.
    pub fn draw(
        beam: &Beam,
        map_size: u32,
        places: &[Place],
        [count, seed]: [u64; 2],
        progress: &dyn Progress,
    ) -> Self {
        let exact = ExactTexels::new(beam, map_size);
        let mut sets = [const { Vec::new() }; 4];
        for &place in places {
            let mut random = Random::new(seed, place as u64);
            let count = count as usize;
            let drawn = match place {
                Place::Volume => in_volume(beam.casters(), count, &mut random),
                Place::Medium => in_casters(beam, count, &mut random),
                Place::Rays => on_rays(beam, map_size, count, &mut random),
                Place::Behind => behind(beam, count, &mut random),
            };
            progress.begin("truth", drawn.len() as u64);
            let samples = drawn.into_par_iter().filter_map(|drawn| {
                progress.advance(1);
                // Nobody asks for what is missing then.
                (!progress.cancelled()).then(|| sample(drawn, beam, &exact)).flatten()
            });
            sets[place as usize] = samples.collect();
        }
        Self { sets }
    }

    /// The samples of one place.
    pub fn of(&self, place: Place) -> &[Sample] {
        &self.sets[place as usize]
    }

    /// The errors of `map` at one place, filtered by a window of width `window` in texels (0:
    /// bilinear; [`Shadow::lookup`]); for [`Place::Rays`], of the texel alone.
    pub fn errors(&self, place: Place, map: &dyn Shadow, window: u32) -> Errors {
        let window = if place == Place::Rays { 1 } else { window };
        let error = |sample: &Sample| {
            let [u, v, depth] = sample.place;
            f64::from(map.lookup(window, u, v, depth)) - sample.truth
        };
        Errors::of(&self.of(place).par_iter().map(error).collect::<Vec<f64>>())
    }

    /// The sample on a texel's central ray where `map` has the largest error; `None` without such
    /// samples.
    pub fn worst(&self, map: &dyn Shadow) -> Option<Sample> {
        let error = |sample: &&Sample| {
            let [u, v, depth] = sample.place;
            (f64::from(map.lookup(1, u, v, depth)) - sample.truth).abs()
        };
        let samples = self.of(Place::Rays).iter();
        samples.max_by(|a, b| error(a).total_cmp(&error(b))).copied()
    }
}

/// A point without its exact transmittance.
#[derive(Clone, Copy, Debug)]
enum Drawn {
    World(DVec3),
    /// (u, v, depth)
    Light([f64; 3]),
}

fn sample(drawn: Drawn, beam: &Beam, exact: &ExactTexels<'_>) -> Option<Sample> {
    let view = &beam.view;
    match drawn {
        Drawn::World(point) if !view.answers_for(point) => None,
        Drawn::World(point) => {
            let place = view.place(point)?.to_array();
            let truth = exact.extinction().light_transmittance(&beam.light, point);
            Some(Sample { place, truth })
        }
        Drawn::Light([u, v, depth]) => {
            // The depth as a lookup receives it, so that rounding it is not counted as a map's
            // error.
            let depth = (depth / view.unit) as f32;
            let truth = exact.transmittance(u, v, f64::from(depth) * view.unit);
            Some(Sample { place: [u as f32, v as f32, depth], truth })
        }
    }
}

fn in_volume(casters: Casters<'_>, count: usize, random: &mut Random) -> Vec<Drawn> {
    let casting = casters.surfaces.casting();
    let casters = Casters { surfaces: &casting, ..casters };
    if !casters.surfaces.is_empty() {
        // Flat things get some space around them.
        let mut bounds = casters.world_bounds();
        let around = DVec3::splat(FLATTEST * bounds.size().max_element()) - bounds.size();
        let around = 0.5 * around.max(DVec3::ZERO);
        (bounds.min, bounds.max) = (bounds.min - around, bounds.max + around);
        let one = |_| Drawn::World(bounds.min + random.cube() * bounds.size());
        return (0..count).map(one).collect();
    }
    let media = casters.media;
    let domain = media.domain();
    let world = |index: DVec3| Drawn::World(media.world_from_index().transform_point3(index));
    (0..count).map(|_| world(domain.min + random.cube() * domain.size())).collect()
}

fn in_casters(beam: &Beam, count: usize, random: &mut Random) -> Vec<Drawn> {
    let casting = beam.surfaces.casting();
    let casters = Casters { surfaces: &casting, ..beam.casters() };
    let on = if casting.is_empty() {
        0
    } else if casters.media.bodies().is_empty() {
        count
    } else {
        count / 2
    };
    let mut drawn = in_medium(casters.media, count - on, random);
    let lit =
        |(point, off): (DVec3, f64)| Drawn::World(point - off * beam.light.direction_at(point));
    drawn.extend(on_surfaces(casters.surfaces, on, random).into_iter().map(lit));
    drawn
}

fn in_medium(media: &Media, count: usize, random: &mut Random) -> Vec<Drawn> {
    let bodies = media.bodies();
    let mut filled = 0;
    for body in bodies {
        body.volume.voxels().for_each_held(|held, _| filled += held.voxels() as u64);
    }
    if filled == 0 {
        return Vec::new();
    }
    // Rising ranks among the filled voxels, so that one pass over the values finds them all.
    let mut ranks: Vec<u64> = (0..count).map(|_| random.below(filled)).collect();
    ranks.sort_unstable();
    let mut wanted = ranks.into_iter().peekable();
    let mut drawn = Vec::with_capacity(count);
    let mut rank = 0;
    for Body { volume, .. } in bodies {
        let domain = volume.domain();
        volume.voxels().for_each_held(|held, _| {
            let beyond = rank + held.voxels() as u64;
            while let Some(found) = wanted.next_if(|&wanted| wanted < beyond) {
                let voxel = held.voxel((found - rank) as usize);
                let index = DVec3::from_array(voxel.map(|c| c as f64)) + random.cube() - 0.5;
                let index = index.clamp(domain.min, domain.max);
                drawn.push(Drawn::World(volume.world_from_index().transform_point3(index)));
            }
            rank = beyond;
        });
    }
    drawn
}

fn on_rays(beam: &Beam, map_size: u32, count: usize, random: &mut Random) -> Vec<Drawn> {
    let n = u64::from(map_size);
    drawn_through(count, || {
        let texel = random.below(n * n);
        let [u, v] = [texel % n, texel / n].map(|i| (i as f64 + 0.5) / n as f64);
        let [enter, exit] = extent(beam.casters(), &beam.view, u, v)?;
        Some([u, v, enter + random.unit() * (exit - enter)])
    })
}

fn behind(beam: &Beam, count: usize, random: &mut Random) -> Vec<Drawn> {
    let [near, far] = beam.view.depths_of(beam.casters());
    drawn_through(count, || {
        let (u, v) = (random.unit(), random.unit());
        let [_, exit] = extent(beam.casters(), &beam.view, u, v)?;
        Some([u, v, exit + random.unit() * (far - near)])
    })
}

/// `count` points from `draw`, or fewer if it keeps failing.
fn drawn_through(count: usize, mut draw: impl FnMut() -> Option<[f64; 3]>) -> Vec<Drawn> {
    let mut one = || (0..MOST_MISSES).find_map(|_| draw());
    (0..count).map_while(|_| one().map(Drawn::Light)).collect()
}

/// Depths where the ray through (u, v) enters the first and leaves the last box of media and
/// surfaces; `None` if it misses them.
fn extent(casters: Casters<'_>, view: &LightView, u: f64, v: f64) -> Option<[f64; 2]> {
    let (origin, direction) = view.ray(u, v);
    let media = casters.media;
    let index_from_world = media.world_from_index().inverse();
    let in_media = media.domain().intersect(
        index_from_world.transform_point3(origin),
        index_from_world.transform_vector3(direction),
    );
    let in_media = in_media.filter(|_| casters.media_count());
    let surfaces = casters.surfaces.casting().world_bounds();
    let in_surfaces = surfaces.and_then(|bounds| bounds.intersect(origin, direction));
    let both = in_media.into_iter().chain(in_surfaces);
    both.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).map(|(enter, exit)| [enter, exit])
}
