//! `--max-error` and `--max-map-bytes`: the map that keeps a limit, and a certificate of what was
//! measured of it.
//!
//! Every method is scouted on a small map, which tells its bytes a texel and its own share of the
//! error; the exact texels of each resolution tell what that costs. From both follows what to expect of
//! every method at every resolution, and so which few are worth building. What counts is measured on
//! the map that is used.

mod limits;

use std::fmt::Write;

pub(super) use limits::{Budget, LimitArguments};

use super::arguments::SceneArguments;
use super::compare::methods::{Method, check_filter};
use super::job::Job;
use crate::accuracy::{Errors, ExactTexels, Place, Points};
use crate::error::{Error, Result};
use crate::progress::Silent;
use crate::scene::{LightView, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::{Map, ShadowMap};

/// Texels along the edge of the maps that are scouted.
const SCOUT: u32 = 64;
/// Resolutions that are tried where none is asked for.
const SIZES: [u32; 6] = [64, 128, 256, 512, 1024, 2048];
/// Points that errors are measured at, and where their random numbers begin.
const POINTS: u64 = 50_000;
const SEED: u64 = 1;
/// Methods tried beside every kind at its usual number.
const MORE: [&str; 16] = [
    "fragments@0.05",
    "fragments@0.02",
    "fragments@0.01",
    "fragments@0.005",
    "fragments@0.001",
    "fragments@0.0005",
    "fragments@raw",
    "visibility@0.05",
    "visibility@0.02",
    "visibility@0.01",
    "visibility@0.005",
    "visibility@0.001",
    "slices:4",
    "slices:8",
    "slices:32",
    "slices:64",
];
/// A map is built although as much more error is expected of it than allowed: expectations err.
const DOUBT: f64 = 1.2;
/// Of the maps within a budget so many are built, those first of which least error is expected.
const TRIES: usize = 3;
/// Larger maps are not tried, bytes.
const LARGEST: f64 = (1_u64 << 31) as f64;

/// A map that keeps its limits.
pub(super) struct Certified {
    pub map: Map,
    /// With the kind, the resolution and the tolerance that were chosen.
    pub settings: Settings,
    /// What was measured, in a sentence.
    pub certificate: String,
}

/// The map of `scene`, a beam of the job's, that keeps `limits`, of a kind that is `wanted`; `None` if
/// there are none.
///
/// # Errors
/// If no map tried keeps them, with the one that came closest.
pub(super) fn choose(
    job: &Job,
    scene: &Scene,
    arguments: &SceneArguments,
    limits: &LimitArguments,
    wanted: fn(MapKind) -> bool,
) -> Result<Option<Certified>> {
    if !limits.any() {
        return Ok(None);
    }
    check_filter(&job.settings)?;
    let search = Search::new(job, scene, arguments, limits, wanted)?;
    search.run().map(Some)
}

struct Search<'a> {
    job: &'a Job,
    scene: &'a Scene,
    error: Option<f64>,
    budget: Option<Budget>,
    methods: Vec<Method>,
    sizes: Vec<u32>,
    view: LightView,
    points: Points,
}

/// A map that could be built.
struct Candidate<'a> {
    method: &'a Method,
    size: u32,
    bytes: f64,
    expected: f64,
}

/// A map that was.
struct Tried<'a> {
    label: &'a str,
    settings: Settings,
    map: Map,
    errors: Errors,
}

impl<'a> Search<'a> {
    fn new(
        job: &'a Job,
        scene: &'a Scene,
        arguments: &SceneArguments,
        limits: &LimitArguments,
        wanted: fn(MapKind) -> bool,
    ) -> Result<Self> {
        let view = LightView::fit(scene.light(), &scene.media)?;
        let sizes = match (arguments.map_size, limits.max_error, limits.max_map_bytes) {
            (Some(size), ..) => vec![size],
            // However many texels: a limit a texel alone does not ask for another resolution.
            (None, None, Some(Budget::Texel(_))) => vec![job.settings.map_size],
            _ => SIZES.to_vec(),
        };
        let asked: Option<MapKind> = arguments.map.as_ref().and(job.settings.map);
        let tried = |method: &Method| {
            wanted(method.kind)
                && job.backend.builds(method.kind)
                && asked.is_none_or(|kind| method.kind == kind)
                && (arguments.tolerance.is_none() || !method.label.contains('@'))
        };
        let kinds = MapKind::all().chain(asked).map(|kind| kind.to_string());
        let mut methods: Vec<Method> = Vec::new();
        for label in kinds.chain(MORE.map(str::to_owned)) {
            let method = Method::parse(&label)?;
            if tried(&method) && methods.iter().all(|other| other.label != label) {
                methods.push(method);
            }
        }
        let progress = &*job.progress;
        let places = [Place::Volume];
        let points = Points::draw(scene, &view, SCOUT, &places, [POINTS, SEED], progress);
        let (error, budget) = (limits.max_error, limits.max_map_bytes);
        Ok(Self { job, scene, error, budget, methods, sizes, view, points })
    }

    fn run(&self) -> Result<Certified> {
        let mut candidates = self.candidates()?;
        let least = candidates.iter().min_by(|a, b| a.expected.total_cmp(&b.expected));
        let least = least.map(|candidate| (candidate.method, candidate.size));
        if let Some(error) = self.error {
            let order = |a: &Candidate<'_>, b: &Candidate<'_>| {
                a.bytes.total_cmp(&b.bytes).then(a.expected.total_cmp(&b.expected))
            };
            candidates.sort_by(order);
            candidates.retain(|c| c.expected <= error * DOUBT);
        } else {
            candidates.sort_by(|a, b| a.expected.total_cmp(&b.expected));
        }
        self.job.progress.begin("choosing", candidates.len() as u64);
        let mut kept: Option<Tried<'_>> = None;
        let mut closest: Option<Tried<'_>> = None;
        let mut within = 0;
        for candidate in &candidates {
            let tried = self.build(candidate.method, candidate.size)?;
            self.job.progress.advance(1);
            let texels = f64::from(candidate.size).powi(2);
            let fits = self.budget.is_none_or(|b| b.allows(tried.map.bytes() as f64, texels));
            let exact = self.error.is_none_or(|error| tried.errors.rms <= error);
            let better = |other: &Option<Tried<'_>>| {
                other.as_ref().is_none_or(|other| tried.errors.rms < other.errors.rms)
            };
            if fits && exact && better(&kept) {
                kept = Some(tried);
            } else if fits && better(&closest) {
                closest = Some(tried);
            }
            within += usize::from(fits);
            let done = if self.error.is_some() { kept.is_some() } else { within == TRIES };
            if done {
                break;
            }
        }
        match kept {
            Some(tried) => Ok(certified(tried)),
            None => {
                // Nothing was worth building: the one of which least is expected tells how far off.
                let build = || least.map(|(method, size)| self.build(method, size)).transpose();
                let closest = if closest.is_some() { closest } else { build()? };
                Err(self.failed(closest.as_ref()))
            }
        }
    }

    /// Every method at every resolution that keeps the budget, as far as one can tell before.
    fn candidates(&self) -> Result<Vec<Candidate<'_>>> {
        let floor = |size: u32| {
            let exact = ExactTexels::new(self.scene, &self.view, size);
            self.errors(&exact).rms
        };
        let steps = self.sizes.len() + self.methods.len();
        self.job.progress.begin("scouting", steps as u64);
        let floors: Vec<(u32, f64)> = self
            .sizes
            .iter()
            .map(|&size| {
                self.job.progress.advance(1);
                (size, floor(size))
            })
            .collect();
        let at_scout = floors.iter().find(|&&(size, _)| size == SCOUT);
        let scouted = at_scout.map_or_else(|| floor(SCOUT), |&(_, floor)| floor);
        let mut candidates = Vec::new();
        for method in &self.methods {
            let scout = self.build(method, SCOUT)?;
            self.job.progress.advance(1);
            let per_texel = scout.map.bytes() as f64 / f64::from(SCOUT).powi(2);
            if let Map::Grid(map) = &scout.map {
                // The same at every resolution.
                let (size, bytes) = (self.job.settings.map_size, map.bytes() as f64);
                if self.budget.is_none_or(|b| b.allows(bytes, f64::from(size).powi(2))) {
                    candidates.push(Candidate { method, size, bytes, expected: scout.errors.rms });
                }
                continue;
            }
            let own = (scout.errors.rms.powi(2) - scouted.powi(2)).max(0.0);
            for &(size, floor) in &floors {
                let texels = f64::from(size).powi(2);
                let (bytes, expected) = (per_texel * texels, (own + floor * floor).sqrt());
                let fits = self.budget.is_none_or(|b| b.allows(bytes / 1.1, texels));
                if fits && bytes <= LARGEST {
                    candidates.push(Candidate { method, size, bytes, expected });
                }
            }
        }
        Ok(candidates)
    }

    fn build<'m>(&self, method: &'m Method, size: u32) -> Result<Tried<'m>> {
        let settings = Settings { map_size: size, ..method.settings(&self.job.settings) };
        let map = self.job.backend.map(self.scene, &settings, &Silent)?;
        let errors = self.errors(&map);
        Ok(Tried { label: &method.label, settings, map, errors })
    }

    fn errors(&self, map: &dyn ShadowMap) -> Errors {
        let (window, _) = self.job.settings.filter.window();
        self.points.errors(Place::Volume, map, window)
    }

    /// Why nothing was chosen, with what came closest.
    fn failed(&self, closest: Option<&Tried<'_>>) -> Error {
        let Some(tried) = closest else {
            return Error::value("max-map-bytes", "no map tried is as small as that");
        };
        let what = if self.error.is_some() { "max-error" } else { "max-map-bytes" };
        let why = format!(
            "no map tried keeps the limits; closest comes {} with an RMS error of {:.6}",
            described(tried),
            tried.errors.rms
        );
        Error::value(what, why)
    }
}

/// A map with what was measured of it.
fn certified(tried: Tried<'_>) -> Certified {
    let mut certificate = format!(
        "{}: at {} random points of the volume (seed {SEED}, filter {}) transmittance differs \
         from the exact line integral by {:.6} RMS, {:.6} at most; a sample, not a bound",
        described(&tried),
        tried.errors.count,
        tried.settings.filter.name(),
        tried.errors.rms,
        tried.errors.max,
    );
    let fitted = matches!(tried.map, Map::Fragments(_) | Map::Visibility(_));
    if fitted && tried.settings.tolerance > 0.0 {
        let _ = write!(
            certificate,
            "; on texels' central rays it is within {} of all slabs together, a bound",
            tried.settings.tolerance
        );
    }
    Certified { map: tried.map, settings: tried.settings, certificate }
}

fn described(tried: &Tried<'_>) -> String {
    let n = tried.settings.map_size;
    if let Map::Grid(map) = &tried.map {
        return format!("{}, {} bytes", tried.label, map.bytes());
    }
    format!("{} {n}x{n}, {} bytes", tried.label, tried.map.bytes())
}
