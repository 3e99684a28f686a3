//! The exact integral in the place of a shadow map: what the others are measured against.

use crate::reference::Extinction;
use crate::scene::{Beam, LightView};
use crate::shadow::{Shadow, TexelMap};

/// Exact transmittance of every texel's central ray. Filtered like any other map it shows what the
/// map's resolution alone costs: no representation is better at that resolution.
#[derive(Clone, Debug)]
pub struct ExactTexels<'a> {
    extinction: Extinction<'a>,
    view: LightView,
    size: u32,
}

impl<'a> ExactTexels<'a> {
    /// The rays of a map of `beam` with `size` squared texels.
    pub fn new(beam: &'a Beam, size: u32) -> Self {
        Self { extinction: Extinction::of(&beam.media), view: beam.view, size }
    }

    /// Exact transmittance from the light to `depth` (world length) along the ray through (u, v).
    pub fn transmittance(&self, u: f64, v: f64, depth: f64) -> f64 {
        let (origin, direction) = self.view.ray(u, v);
        (-self.extinction.optical_depth(origin, direction, [0.0, depth])).exp()
    }

    /// The truth behind it.
    pub(super) fn extinction(&self) -> &Extinction<'a> {
        &self.extinction
    }

    /// The middle of texel (`x`, `y`).
    fn center(&self, x: u32, y: u32) -> [f64; 2] {
        [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(self.size))
    }
}

impl Shadow for ExactTexels<'_> {
    /// It keeps nothing.
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

/// Exact transmittance at each point itself, whatever filter is asked for: a picture marched
/// through it is the truth that other maps' pictures are compared with.
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
