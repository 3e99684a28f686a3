//! The optical depth of whole media: the sum of every body's own integral.

use glam::DVec3;

use super::crossings::Crossings;
use super::integral::{Cells, Stretch};
use crate::scene::{Casters, Light, TransferFunction};
use crate::volume::Volume;

/// Number of halvings of an interval around a root; f64 cannot resolve more.
const HALVINGS: u32 = 54;
/// Gauss-Legendre nodes and weights on 0..1 that integrate cubics exactly.
const TWO_NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
/// Number of parts of a cell where two grids are multiplied.
const PRODUCT_PARTS: u32 = 8;

/// Media and surfaces, prepared for exact integrals along rays.
#[derive(Clone, Debug)]
pub struct Extinction<'a> {
    bodies: Vec<Exact<'a>>,
    crossings: Crossings,
}

#[derive(Clone, Debug)]
struct Exact<'a> {
    cells: Cells<'a>,
    scale: f64,
    transfer: Option<&'a TransferFunction>,
    modulation: Option<Cells<'a>>,
}

/// A ray from `origin` along `direction` (unit length), in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldRay {
    pub origin: DVec3,
    pub direction: DVec3,
}

impl<'a> Extinction<'a> {
    /// Prepares `casters`, which may be media alone.
    pub fn of(casters: impl Into<Casters<'a>>) -> Self {
        let Casters { media, surfaces } = casters.into();
        let exact = |volume: &'a Volume| Cells::of(volume);
        let bodies = media.bodies().iter().map(|body| Exact {
            cells: exact(&body.volume),
            scale: body.medium.density_scale,
            transfer: body.medium.transfer.as_deref(),
            modulation: body.medium.modulation.as_deref().map(exact),
        });
        Self { bodies: bodies.collect(), crossings: Crossings::of(&surfaces.casting()) }
    }

    /// The surfaces.
    pub fn crossings(&self) -> &Crossings {
        &self.crossings
    }

    /// Transmittance along `origin + t direction` (world space, unit length) for `t` between the
    /// bounds, in world lengths, 0..1: what media and surfaces let through.
    pub fn transmittance(&self, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> f64 {
        let surfaces = self.crossings.transmittance(origin, direction, bounds);
        if surfaces == 0.0 || self.bodies.is_empty() {
            return surfaces;
        }
        surfaces * (-self.optical_depth(origin, direction, bounds)).exp()
    }

    /// Optical depth of the media along `origin + t direction` (world space, unit length) for `t`
    /// between the bounds, in world lengths. It is exact to rounding, also through transfer
    /// functions, whose knots split cells; where a second grid modulates extinction it is exact to
    /// about 1e-6.
    pub fn optical_depth(&self, origin: DVec3, direction: DVec3, bounds: [f64; 2]) -> f64 {
        let ray = WorldRay { origin, direction };
        let mut sum = 0.0;
        for body in &self.bodies {
            body.walk(ray, bounds, |stretch| {
                sum += body.scale * body.whole(ray, stretch);
            });
        }
        sum
    }

    /// Transmittance from `light` to the world position `point`, 0..1.
    pub fn light_transmittance(&self, light: &Light, point: DVec3) -> f64 {
        let farthest = light.position().map_or(f64::INFINITY, |at| (point - at).length());
        self.transmittance(point, -light.direction_at(point), [0.0, farthest])
    }

    /// Adds the optical depths at the rising `depths` along a ray to the same number of `taus`.
    /// Returns the optical depth of the whole ray, and the distances where it enters the first body
    /// and leaves the last.
    pub(super) fn profile(
        &self,
        ray: WorldRay,
        depths: &[f64],
        taus: &mut [f64],
    ) -> (f64, Option<[f64; 2]>) {
        let (mut total, mut extent) = (0.0, None::<[f64; 2]>);
        for body in &self.bodies {
            let (mut before, mut next) = (0.0, 0);
            body.walk(ray, [0.0, f64::INFINITY], |stretch| {
                let [begin, end] = extent.unwrap_or([stretch.enter, stretch.exit]);
                extent = Some([begin.min(stretch.enter), end.max(stretch.exit)]);
                let empty = stretch.is_empty() && body.transfer.is_none();
                while let Some(&depth) = depths.get(next)
                    && depth < stretch.exit
                {
                    let held = empty || depth <= stretch.enter;
                    let own = if held { 0.0 } else { body.to(ray, stretch, depth) };
                    taus[next] += body.scale * (before + own);
                    next += 1;
                }
                if !empty {
                    before += body.whole(ray, stretch);
                }
            });
            for tau in &mut taus[next..] {
                *tau += body.scale * before;
            }
            total += body.scale * before;
        }
        (total, extent)
    }
}

impl Exact<'_> {
    fn walk(&self, ray: WorldRay, bounds: [f64; 2], mut visit: impl FnMut(&Stretch)) {
        self.cells.walk(ray.origin, ray.direction, bounds, |stretch| {
            visit(stretch);
            true
        });
    }

    /// Integral of density, or of its opacity, over a stretch.
    #[inline]
    fn whole(&self, ray: WorldRay, stretch: &Stretch) -> f64 {
        match (self.transfer, &self.modulation) {
            (None, None) => stretch.integral(),
            _ => self.to(ray, stretch, stretch.exit),
        }
    }

    /// Integral of density, or of its opacity, from the begin of a stretch to `t`.
    fn to(&self, ray: WorldRay, stretch: &Stretch, t: f64) -> f64 {
        match (self.transfer, &self.modulation) {
            (None, None) => stretch.integral_to(t),
            (Some(function), None) => opacity_integral(function, stretch, [stretch.enter, t]),
            (_, Some(factor)) => {
                let mut sum = 0.0;
                let part = (t - stretch.enter) / f64::from(PRODUCT_PARTS);
                for i in 0..PRODUCT_PARTS {
                    let from = stretch.enter + f64::from(i) * part;
                    let own = match self.transfer {
                        Some(function) => opacity_integral(function, stretch, [from, from + part]),
                        None => stretch.integral_to(from + part) - stretch.integral_to(from),
                    };
                    let middle = ray.origin + (from + 0.5 * part) * ray.direction;
                    sum += own * factor.at(middle);
                }
                sum
            }
        }
    }
}

/// Integral of a function's opacity along a part of a stretch. The part is cut where density passes
/// one of the function's knots; between cuts opacity is a cubic, because density is one.
fn opacity_integral(function: &TransferFunction, stretch: &Stretch, [from, to]: [f64; 2]) -> f64 {
    let density = |t: f64| stretch.density(t);
    let mut turns = vec![from];
    turns.extend(stretch.turns().into_iter().flatten().filter(|&t| t > from && t < to));
    turns.push(to);
    turns.sort_by(f64::total_cmp);
    let mut cuts = turns.clone();
    for pair in turns.windows(2) {
        let (low, high) = (density(pair[0]), density(pair[1]));
        for knot in function.points() {
            let (low, high) = (low - knot.value, high - knot.value);
            if low * high < 0.0 {
                cuts.push(root(|t| density(t) - knot.value, [pair[0], pair[1]], low > 0.0));
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.windows(2)
        .map(|pair| {
            let length = pair[1] - pair[0];
            let at = |node: f64| function.at(density(pair[0] + node * length)).1;
            0.5 * length * (at(TWO_NODES[0]) + at(TWO_NODES[1]))
        })
        .sum()
}

/// The root of a monotone function between two positions; `falling` if it falls.
fn root(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], falling: bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (a + b);
        if (f(middle) > 0.0) == falling {
            a = middle;
        } else {
            b = middle;
        }
    }
    0.5 * (a + b)
}
