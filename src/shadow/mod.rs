//! Finished shadow maps behind one small interface: transmittance at (texel, depth). The module
//! knows neither how maps are built nor where they are stored.

mod coded;
mod fragments;
mod grid;
mod threshold;
mod visibility;

pub use crate::kernel::fragments::Node;
pub use coded::{Codec, CodedMap, TexelRay, codec};
pub use fragments::{
    Fragment, FragmentLists, FragmentMap, Links, MOST_WALKED, Merged, NO_LINK, Runs, disjoint,
    nearest_nodes, truncate,
};
pub use grid::{GridMap, grid_point, grid_shape};
pub use threshold::ThresholdMap;
pub use visibility::{VisibilityMap, VisibilityPoint, fit_visibility};

use glam::Vec3;

use crate::kernel::exponential::four_transmitted;
use crate::kernel::medium::SMALLEST_WEIGHT;
use crate::math::Each;
use crate::scene::LightView;

/// Tells how much light reaches a point. Passes, pictures and measures use maps through this trait
/// alone.
pub trait Shadow: Sync {
    /// Computes what lookups share, on all threads. Without this call the first lookup does so on
    /// its own thread. It must not run while other threads of the same pool look up.
    fn prepare(&self) {}

    /// Bytes that a lookup may read; data that it can do without (links, the light's view) do not
    /// count.
    fn bytes(&self) -> u64;

    /// Transmittance from the light to a point, 0..1. (`u`, `v`) is the position in the light's
    /// view ([`LightView`]); outside of 0..1 the result is 1. `depth` is the distance along the ray
    /// through (`u`, `v`) in units of the view ([`LightView::unit`]): world lengths for scenes of
    /// ordinary size. Maps of texels return the mean over a window of `width` x `width` texels, or,
    /// for `width` 0, interpolate between the four nearest.
    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32;

    /// [`Shadow::lookup`] at `place` (u, v, depth) for channels whose optical depths are those of
    /// the map times `ratios`. Maps that combine texels raise each texel's transmittance to these
    /// powers before; by default it is done behind.
    fn lookup_colours(&self, width: u32, place: Vec3, ratios: Vec3) -> Vec3 {
        powers(self.lookup(width, place.x, place.y, place.z), ratios)
    }
}

/// A transmittance raised to powers.
#[inline]
fn powers(transmittance: f32, ratios: Vec3) -> Vec3 {
    let optical_depth = -transmittance.max(SMALLEST_WEIGHT).ln();
    four_transmitted((optical_depth * ratios).extend(0.0)).truncate()
}

/// A map of transmittance over depth, seen from a light: N x N texels, (u, v) in 0..1, row 0 at v =
/// 0. [`Shadow::lookup`] is implemented by [`TexelMap::filtered`].
pub trait TexelMap: Shadow {
    /// Texels along each edge.
    fn size(&self) -> u32;

    /// Transmittance from the light to `depth` along the central ray of texel (`x`, `y`), 0..1.
    /// Depths are in units of the light's view ([`LightView::unit`]): world lengths for scenes of
    /// ordinary size.
    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32;

    /// Depth where the shadow of texel (`x`, `y`) begins to matter. `None` if the texel takes less
    /// than nine tenths of the light, or if the map does not know.
    fn front(&self, _x: u32, _y: u32) -> Option<f32> {
        None
    }

    /// Fronts of neighbouring texels that lie no further apart in depth than this belong to one
    /// surface, in units of the view; 0 where media are so thin that fronts do not matter.
    fn reach(&self) -> f32 {
        0.0
    }

    /// Transmittance at (u, v, depth) from the texel that contains the point; 1 outside of the map.
    fn nearest(&self, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let n = self.size();
        let texel = |c: f32| ((c * n as f32) as u32).min(n - 1);
        self.texel_transmittance(texel(u), texel(v), depth)
    }

    /// Transmittance at (u, v, depth), bilinear between the transmittances of the four nearest
    /// texels; 1 outside of the map, clamped within half a texel of its edge. Depths are not
    /// interpolated, since a depth of one texel means nothing in another, except where a dense
    /// medium's surface runs through all four: there their shadows are first moved in depth to one
    /// common front ([`TexelMap::front`], [`TexelMap::reach`]).
    fn bilinear(&self, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        let ([xs, ys], [fx, fy]) = four_texels(self.size(), u, v);
        if self.reach() > 0.0 {
            return aligned(self, [xs, ys], [fx, fy], depth);
        }
        let row = |y: u32| {
            let left = self.texel_transmittance(xs[0], y, depth);
            let right = self.texel_transmittance(xs[1], y, depth);
            left + (right - left) * fx
        };
        let (upper, lower) = (row(ys[0]), row(ys[1]));
        upper + (lower - upper) * fy
    }

    /// Mean transmittance at (u, v, depth) over `width` x `width` texels around the one that
    /// contains the point (percentage-closer filtering, Reeves et al. 1987); 1 outside of the map.
    /// Windows end at the map's edge.
    fn mean(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        if !inside(u, v) {
            return 1.0;
        }
        brute_force_mean(self, [u, v].each(|c| window(c, width, self.size())), depth)
    }

    /// Transmittance at (u, v, depth): bilinear for `width` 0, nearest for 1, else the mean over a
    /// window of `width` x `width` texels.
    fn filtered(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        match width {
            0 => self.bilinear(u, v, depth),
            1 => self.nearest(u, v, depth),
            _ => self.mean(width, u, v, depth),
        }
    }
}

/// The columns and rows of the four texels around (u, v), each 0..1, in a map of `size` squared
/// texels, and the position between them, 0..1.
#[inline]
fn four_texels(size: u32, u: f32, v: f32) -> ([[u32; 2]; 2], [f32; 2]) {
    let last = size - 1;
    let places = [u, v].each(|c| (c * size as f32 - 0.5).clamp(0.0, last as f32));
    // Conversion to i32 is the fastest.
    let lows = places.each(|c| c as i32);
    let texels = lows.each(|low| [low as u32, (low as u32 + 1).min(last)]);
    (texels, [places[0] - lows[0] as f32, places[1] - lows[1] as f32])
}

/// Bilinear between four texels whose shadows are first moved in depth to one common front. Without
/// that, a slanted surface gets steps, because over a texel it may be many times as deep as light
/// reaches. Fronts further apart than the map's reach belong to different surfaces and stay where
/// they are. (Mixing optical depths instead of transmittances has twice the error at outlines.)
fn aligned(
    map: &(impl TexelMap + ?Sized),
    [xs, ys]: [[u32; 2]; 2],
    [fx, fy]: [f32; 2],
    depth: f32,
) -> f32 {
    let (shifts, weights) = alignment(map, [xs, ys], [fx, fy]);
    let mut light = 0.0;
    for (i, (shift, weight)) in shifts.into_iter().zip(weights).enumerate() {
        light += weight * map.texel_transmittance(xs[i & 1], ys[i >> 1], depth + shift);
    }
    light
}

/// Bilinear weights of four texels: upper left, upper right, lower left, lower right.
#[inline]
fn four_weights([fx, fy]: [f32; 2]) -> [f32; 4] {
    [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy]
}

/// By how much the shadows of four texels are moved in depth, and the texels' bilinear weights:
/// upper left, upper right, lower left, lower right.
fn alignment(
    map: &(impl TexelMap + ?Sized),
    [xs, ys]: [[u32; 2]; 2],
    [fx, fy]: [f32; 2],
) -> ([f32; 4], [f32; 4]) {
    let texels = [[xs[0], ys[0]], [xs[1], ys[0]], [xs[0], ys[1]], [xs[1], ys[1]]];
    let weights = four_weights([fx, fy]);
    let fronts = texels.each(|[x, y]| map.front(x, y));
    let (mut sum, mut all) = (0.0, 0.0);
    for (front, weight) in fronts.iter().zip(weights) {
        if let Some(front) = front {
            sum += weight * front;
            all += weight;
        }
    }
    let mean = sum / f32::max(all, SMALLEST_WEIGHT);
    let shifts = fronts.each(|front| front.map_or(0.0, |front| front - mean));
    let farthest = shifts.iter().fold(0.0_f32, |most, shift| most.max(shift.abs()));
    let share = (2.0 - farthest / map.reach()).clamp(0.0, 1.0);
    (shifts.each(|shift| share * shift), weights)
}

/// The first and the last texel, along one axis, of a window around coordinate `c` of a map.
fn window(c: f32, width: u32, size: u32) -> [u32; 2] {
    let middle = ((c * size as f32) as u32).min(size - 1);
    [middle.saturating_sub(width / 2), (middle + width / 2).min(size - 1)]
}

/// Mean over a window of texels [[x0, x1], [y0, y1]]; each texel is looked up by itself.
fn brute_force_mean(
    map: &(impl TexelMap + ?Sized),
    [[x0, x1], [y0, y1]]: [[u32; 2]; 2],
    depth: f32,
) -> f32 {
    // The sum has the same order as that of walks along links.
    let texels = (y0..=y1).rev().flat_map(|y| (x0..=x1).map(move |x| (x, y)));
    let sum: f32 = texels.map(|(x, y)| map.texel_transmittance(x, y, depth)).sum();
    sum / ((x1 - x0 + 1) * (y1 - y0 + 1)) as f32
}

/// A map of any kind.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Map {
    /// Four numbers per texel.
    Threshold(ThresholdMap),
    /// Lists of fragments.
    Fragments(FragmentMap),
    /// A code with the same number of bytes for every texel.
    Coded(CodedMap),
    /// Lists of points of transmittance.
    Visibility(VisibilityMap),
    /// A grid over the volume.
    Grid(GridMap),
}

impl Map {
    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        match self {
            Self::Threshold(map) => map.view(),
            Self::Fragments(map) => map.view(),
            Self::Coded(map) => map.view(),
            Self::Visibility(map) => map.view(),
            Self::Grid(map) => map.view(),
        }
    }

    /// The fragment map, if it is one.
    pub fn as_fragments(&self) -> Option<&FragmentMap> {
        match self {
            Self::Fragments(map) => Some(map),
            Self::Threshold(_) | Self::Coded(_) | Self::Visibility(_) | Self::Grid(_) => None,
        }
    }

    /// Texels along each edge; for a grid, cells along its longest axis.
    pub fn size(&self) -> u32 {
        match self {
            Self::Grid(map) => map.longest(),
            _ => self.texels().map_or(0, TexelMap::size),
        }
    }

    /// The map as a map of texels; `None` for a grid.
    pub fn texels(&self) -> Option<&dyn TexelMap> {
        match self {
            Self::Threshold(map) => Some(map),
            Self::Fragments(map) => Some(map),
            Self::Coded(map) => Some(map),
            Self::Visibility(map) => Some(map),
            Self::Grid(_) => None,
        }
    }

    fn inner(&self) -> &dyn Shadow {
        match self {
            Self::Threshold(map) => map,
            Self::Fragments(map) => map,
            Self::Coded(map) => map,
            Self::Visibility(map) => map,
            Self::Grid(map) => map,
        }
    }
}

impl Shadow for Map {
    fn prepare(&self) {
        self.inner().prepare();
    }

    fn bytes(&self) -> u64 {
        self.inner().bytes()
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.inner().lookup(width, u, v, depth)
    }

    fn lookup_colours(&self, width: u32, place: Vec3, ratios: Vec3) -> Vec3 {
        self.inner().lookup_colours(width, place, ratios)
    }
}

fn inside(u: f32, v: f32) -> bool {
    (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)
}
