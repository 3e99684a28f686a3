//! The exact integral as a shadow map: the reference for all other maps.

use crate::reference::Extinction;
use crate::scene::{Beam, LightView};
use crate::shadow::{Shadow, TexelMap};

/// Exact transmittance of every texel's central ray. Filtered like any other map, it shows the
/// error of the map's resolution alone: no representation is better at that resolution.
#[derive(Clone, Debug)]
pub struct ExactTexels<'a> {
    extinction: Extinction<'a>,
    view: LightView,
    size: u32,
}

impl<'a> ExactTexels<'a> {
    /// The rays of a map of `beam` with `size` squared texels.
    pub fn new(beam: &'a Beam, size: u32) -> Self {
        Self { extinction: Extinction::of(beam.casters()), view: beam.view, size }
    }

    /// Exact transmittance from the light to `depth` (in world lengths) along the ray through (u,
    /// v), each 0..1 over the map.
    pub fn transmittance(&self, u: f64, v: f64, depth: f64) -> f64 {
        let (origin, direction) = self.view.ray(u, v);
        self.extinction.transmittance(origin, direction, [0.0, depth])
    }

    /// The exact integrals behind it.
    pub(super) fn extinction(&self) -> &Extinction<'a> {
        &self.extinction
    }

    /// The centre (u, v) of texel (`x`, `y`).
    fn center(&self, x: u32, y: u32) -> [f64; 2] {
        [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(self.size))
    }
}

impl Shadow for ExactTexels<'_> {
    /// It stores nothing.
    fn bytes(&self) -> u64 {
        0
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for ExactTexels<'_> {
    fn size(&self) -> u32 {
        self.size
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let [u, v] = self.center(x, y);
        self.transmittance(u, v, f64::from(depth) * self.view.unit) as f32
    }
}

/// Exact transmittance at each point itself, whatever filter is requested. A picture marched
/// through it is the reference for pictures through other maps.
#[derive(Clone, Debug)]
pub struct ExactPoints<'a>(pub ExactTexels<'a>);

impl Shadow for ExactPoints<'_> {
    fn bytes(&self) -> u64 {
        0
    }

    fn lookup(&self, _width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.0.transmittance(u.into(), v.into(), f64::from(depth) * self.0.view.unit) as f32
    }
}
