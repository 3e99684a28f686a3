//! Chooses the map that keeps a limit of error or of bytes, and certifies it with what was
//! measured.
//!
//! First every method builds a small map (a scout), which gives its bytes per texel and its own
//! part of the error; the exact texels of each resolution give the error of that resolution.
//! Together they predict the error of every method at every resolution, and so which few maps are
//! worth building. The decision is based on measurements of the map that is returned.

use std::fmt::Write;

use super::{Budget, Method, check_filter};
use crate::accuracy::{self, Errors, ExactTexels, Points};
use crate::backend::Backend;
use crate::error::{Error, ErrorKind, Result};
use crate::progress::{Progress, Silent};
use crate::scene::Beam;
use crate::settings::{MapKind, Settings};
use crate::shadow::{Map, Shadow};

/// Texels along each edge of the scouts' maps.
const SCOUT: u32 = 64;
/// Resolutions that are tried if none is requested.
const SIZES: [u32; 6] = [64, 128, 256, 512, 1024, 2048];
/// Number of points at which errors are measured, and the seed of their random numbers.
const POINTS: u64 = 50_000;
const SEED: u64 = 1;
/// Methods that are tried in addition to every kind with its default number.
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
/// A map is built if its predicted error exceeds the limit by no more than this factor, because
/// predictions have errors.
const DOUBT: f64 = 1.2;
/// Number of maps within a budget that are built, in order of predicted error.
const TRIES: usize = 3;
/// Largest number of bytes of maps that are tried.
const LARGEST: f64 = (1_u64 << 31) as f64;

/// A map that keeps its limits.
#[non_exhaustive]
pub struct Certified {
    /// The map, on the host.
    pub map: Map,
    /// The settings, with the chosen kind, resolution and tolerance.
    pub settings: Settings,
    /// What was measured, in one sentence.
    pub certificate: String,
}

/// Limits that a map must keep, and properties that are given. Without a limit of error, the most
/// exact map is chosen; with one, the smallest.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub struct Limits {
    /// Largest RMS error of transmittance at random points of the volume, above 0.
    pub error: Option<f64>,
    /// Largest number of bytes of the map.
    pub budget: Option<Budget>,
    /// Texels along each edge; `None` tries several resolutions.
    pub size: Option<u32>,
    /// The kind of map; `None` tries all.
    pub kind: Option<MapKind>,
    /// Whether only the settings' own tolerance is tried.
    pub own_tolerance: bool,
}

/// Chooses the map of `beam` that keeps `limits`, among the kinds for which `wanted` is true;
/// `settings` specify everything else.
///
/// # Errors
/// If no map that was tried keeps them; the error describes the one that came closest. If a setting
/// is out of its range ([`Settings::check`]).
pub fn choose(
    backend: &dyn Backend,
    beam: &Beam,
    settings: &Settings,
    limits: &Limits,
    wanted: fn(MapKind) -> bool,
    progress: &dyn Progress,
) -> Result<Certified> {
    let size = limits.size.unwrap_or(settings.map.size);
    settings.with(|s| s.map.size = size).check()?;
    check_filter(settings)?;
    let place = Place { backend, beam, settings, progress };
    Search::new(place, limits, wanted)?.run()
}

/// The context in which maps are tried.
#[derive(Clone, Copy)]
struct Place<'a> {
    backend: &'a dyn Backend,
    beam: &'a Beam,
    settings: &'a Settings,
    progress: &'a dyn Progress,
}

struct Search<'a> {
    at: Place<'a>,
    error: Option<f64>,
    budget: Option<Budget>,
    methods: Vec<Method>,
    sizes: Vec<u32>,
    points: Points,
}

/// A map that could be built, with predictions.
struct Candidate<'a> {
    method: &'a Method,
    size: u32,
    bytes: f64,
    expected: f64,
}

/// A map that was built, with measurements.
struct Tried<'a> {
    label: &'a str,
    settings: Settings,
    map: Map,
    errors: Errors,
}

impl<'a> Search<'a> {
    fn new(at: Place<'a>, limits: &Limits, wanted: fn(MapKind) -> bool) -> Result<Self> {
        let sizes = match (limits.size, limits.error, limits.budget) {
            (Some(size), ..) => vec![size],
            // A limit per texel alone does not require another resolution, whatever the number of
            // texels.
            (None, None, Some(Budget::Texel(_))) => vec![at.settings.map.size],
            _ => SIZES.to_vec(),
        };
        let tried = |method: &Method| {
            wanted(method.kind)
                && at.backend.builds(method.kind)
                && limits.kind.is_none_or(|kind| method.kind == kind)
                && !(limits.own_tolerance && method.label.contains('@'))
        };
        let kinds = MapKind::all().chain(limits.kind).map(|kind| kind.to_string());
        let mut methods: Vec<Method> = Vec::new();
        for label in kinds.chain(MORE.map(str::to_owned)) {
            let method = Method::parse(&label)?;
            if tried(&method) && methods.iter().all(|other| other.label != label) {
                methods.push(method);
            }
        }
        let counts = [POINTS, SEED];
        let points = Points::draw(at.beam, SCOUT, &[accuracy::Place::Volume], counts, at.progress);
        let (error, budget) = (limits.error, limits.budget);
        Ok(Self { at, error, budget, methods, sizes, points })
    }

    fn check_cancelled(&self) -> Result<()> {
        if self.at.progress.cancelled() { Err(ErrorKind::Cancelled.into()) } else { Ok(()) }
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
        self.at.progress.begin("choosing", candidates.len() as u64);
        let mut kept: Option<Tried<'_>> = None;
        let mut closest: Option<Tried<'_>> = None;
        let mut within = 0;
        for candidate in &candidates {
            self.check_cancelled()?;
            let tried = self.build(candidate.method, candidate.size)?;
            self.at.progress.advance(1);
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
                // No map was worth building; the one with the least predicted error shows by how
                // much.
                let build = || least.map(|(method, size)| self.build(method, size)).transpose();
                let closest = if closest.is_some() { closest } else { build()? };
                Err(self.failed(closest.as_ref()))
            }
        }
    }

    /// Every method at every resolution that is predicted to keep the budget.
    fn candidates(&self) -> Result<Vec<Candidate<'_>>> {
        let floor = |size: u32| {
            let exact = ExactTexels::new(self.at.beam, size);
            self.errors(&exact).rms
        };
        let steps = self.sizes.len() + self.methods.len();
        self.at.progress.begin("scouting", steps as u64);
        let floors: Vec<(u32, f64)> = self
            .sizes
            .iter()
            .map(|&size| {
                self.at.progress.advance(1);
                (size, floor(size))
            })
            .collect();
        let at_scout = floors.iter().find(|&&(size, _)| size == SCOUT);
        let scouted = at_scout.map_or_else(|| floor(SCOUT), |&(_, floor)| floor);
        let mut candidates = Vec::new();
        for method in &self.methods {
            self.check_cancelled()?;
            let scout = self.build(method, SCOUT)?;
            self.at.progress.advance(1);
            let per_texel = scout.map.bytes() as f64 / f64::from(SCOUT).powi(2);
            if let Map::Grid(map) = &scout.map {
                // A grid is the same at every resolution.
                let size = match self.sizes[..] {
                    [only] => only,
                    _ => self.at.settings.map.size,
                };
                let bytes = map.bytes() as f64;
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
        let settings = method.settings(self.at.settings).with(|s| s.map.size = size);
        let map = self.at.backend.map(self.at.beam, &settings, &Silent)?;
        let errors = self.errors(&map);
        Ok(Tried { label: &method.label, settings, map, errors })
    }

    fn errors(&self, map: &dyn Shadow) -> Errors {
        let (window, _) = self.at.settings.map.filter.window();
        self.points.errors(accuracy::Place::Volume, map, window)
    }

    /// The error if no map was chosen, with the one that came closest.
    fn failed(&self, closest: Option<&Tried<'_>>) -> Error {
        let Some(tried) = closest else {
            return Error::value("max-map-bytes", "no map tried is that small");
        };
        let what = if self.error.is_some() { "max-error" } else { "max-map-bytes" };
        let why = format!(
            "no map tried meets the limits; the closest is {} with an RMS error of {:.6}",
            described(tried),
            tried.errors.rms
        );
        Error::value(what, why)
    }
}

/// A map with a certificate of what was measured.
fn certified(tried: Tried<'_>) -> Certified {
    let mut certificate = format!(
        "{}: at {} random points of the volume (seed {SEED}, filter {}) transmittance differs \
         from the exact line integral by {:.6} RMS, {:.6} at most; a sample, not a bound",
        described(&tried),
        tried.errors.count,
        tried.settings.map.filter.name(),
        tried.errors.rms,
        tried.errors.max,
    );
    let fitted = matches!(tried.map, Map::Fragments(_) | Map::Visibility(_));
    if fitted && tried.settings.map.fragments.tolerance > 0.0 {
        let _ = write!(
            certificate,
            "; on texels' central rays it is within {} of all slabs together, which is a bound",
            tried.settings.map.fragments.tolerance
        );
    }
    Certified { map: tried.map, settings: tried.settings, certificate }
}

fn described(tried: &Tried<'_>) -> String {
    let n = tried.settings.map.size;
    if let Map::Grid(map) = &tried.map {
        return format!("{}, {} bytes", tried.label, map.bytes());
    }
    format!("{} {n}x{n}, {} bytes", tried.label, tried.map.bytes())
}
