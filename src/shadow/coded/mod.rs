//! Maps in which every texel takes the same number of bytes. Each codec has its own file, which
//! names its source.

mod adaptive;
mod bytes;
mod canonical;
mod float_slices;
mod fourier;
mod layers;
mod moments;
mod nested;
mod occupancy;
mod peeling;
mod relative;
mod slices;
mod stochastic;
#[cfg(test)]
mod tests;
mod trigonometric;

use std::fmt::Debug;
use std::sync::Arc;

use super::{Shadow, TexelMap};
use crate::frame::Frame;
use crate::kernel::fragments::{Node, OPAQUE_OPTICAL_DEPTH, nodes_before, optical_depth_between};
use crate::kernel::light::light_extent;
use crate::scene::LightView;
use crate::settings::{Coding, MapKind};

/// The input of a codec: optical depth over depth along one texel's ray.
#[derive(Clone, Copy, Debug)]
pub struct TexelRay<'a> {
    /// The polyline of all slabs, by rising depth; empty for a ray without medium. Optical depth is
    /// 0 in front of the first node and constant behind the last.
    pub nodes: &'a [Node],
    /// Depths where the ray enters and leaves the volume; it misses if exit <= enter. A reader
    /// knows them without the map.
    pub extent: [f32; 2],
}

impl TexelRay<'_> {
    /// Transmittance from the light to `depth`, 0..1.
    pub fn transmittance(&self, depth: f32) -> f32 {
        (-optical_depth_between(self.nodes, nodes_before(self.nodes, depth), depth)).exp()
    }

    /// Optical depth from the light to a share of the extent; at share 1 that of the whole ray.
    fn optical_depth(&self, share: f32) -> f32 {
        if share >= 1.0 {
            return self.total();
        }
        let [enter, exit] = self.extent;
        let depth = enter + share * (exit - enter);
        optical_depth_between(self.nodes, nodes_before(self.nodes, depth), depth)
    }

    /// Optical depth of the whole ray.
    fn total(&self) -> f32 {
        self.nodes.last().map_or(0.0, |last| last.optical_depth)
    }

    /// The share of the extent where optical depth reaches `level`.
    fn share_at(&self, level: f32) -> f32 {
        let after = self.nodes.partition_point(|node| node.optical_depth < level);
        let depth =
            match (after.checked_sub(1).and_then(|i| self.nodes.get(i)), self.nodes.get(after)) {
                (Some(a), Some(b)) => {
                    let step = (level - a.optical_depth) / (b.optical_depth - a.optical_depth);
                    a.depth + (b.depth - a.depth) * step
                }
                (Some(node), None) | (None, Some(node)) => node.depth,
                (None, None) => return 0.0,
            };
        share(self.extent, depth)
    }

    /// The slabs that hold medium, by rising depth: the shares of the extent where each begins and
    /// ends, and its optical depth.
    fn slabs(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let place = |node: &Node| f64::from(share(self.extent, node.depth));
        let depth = |[a, b]: &[Node; 2]| f64::from(b.optical_depth) - f64::from(a.optical_depth);
        let pairs = self.nodes.array_windows::<2>().filter(move |pair| depth(pair) > 0.0);
        pairs.map(move |pair| ([place(&pair[0]), place(&pair[1])], depth(pair)))
    }
}

/// Position of `depth` in an extent: 0 at its front and before, 1 at its end and behind; 0 if the
/// extent is empty.
fn share([enter, exit]: [f32; 2], depth: f32) -> f32 {
    let share = (depth - enter) / (exit - enter);
    // NaN counts as 0.
    if exit > enter && share > 0.0 { share.min(1.0) } else { 0.0 }
}

/// An optical depth read from a texel's bytes, made finite and at least 0.
fn optical(depth: f32) -> f32 {
    if depth > 0.0 { depth.min(OPAQUE_OPTICAL_DEPTH) } else { 0.0 }
}

/// Transmittance of an optical depth; 1 for NaN.
fn through(optical_depth: f32) -> f32 {
    (-optical_depth.max(0.0)).exp()
}

/// A code for transmittance over depth along one ray, which takes the same number of bytes for
/// every ray.
pub trait Codec: Send + Sync + Debug {
    /// Bytes per texel.
    fn stride(&self) -> usize;

    /// Writes the code of a ray into `texel`. All its bytes, [`Codec::stride`] of them, are zero
    /// before.
    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]);

    /// Transmittance at `depth`, in 0..1, of a ray with the given `extent` (as in [`TexelRay`]),
    /// decoded from its bytes. The result is in range for any bytes, also for those that no encoder
    /// writes.
    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32;
}

/// The codec of a coding. A count that the coding does not allow is replaced by the next one that
/// it does.
pub fn codec(coding: Coding) -> Arc<dyn Codec> {
    let count = |n: u16, least: u16, most: u16| usize::from(n.clamp(least, most));
    match coding {
        Coding::Nested => Arc::new(nested::Nested),
        Coding::Relative => Arc::new(relative::Relative),
        Coding::Slices(n) => Arc::new(slices::Slices { count: count(n, 1, u16::MAX) }),
        Coding::FloatSlices(n) => {
            Arc::new(float_slices::FloatSlices { count: count(n, 1, u16::MAX) })
        }
        Coding::Fourier(n) => Arc::new(fourier::Fourier { pairs: count(n, 1, u16::MAX) / 2 }),
        Coding::Moments(n) => Arc::new(moments::Moments { half: count(n, 4, 6) / 2 }),
        Coding::Trigonometric(n) => {
            Arc::new(trigonometric::Trigonometric { count: count(n, 2, 4) })
        }
        Coding::Adaptive(n) => Arc::new(adaptive::Adaptive { count: count(n, 3, u16::MAX) }),
        Coding::Layers(n) => Arc::new(layers::Layers { count: count(n, 1, u16::MAX) }),
        Coding::Peeling(n) => Arc::new(peeling::Peeling { count: count(n, 1, u16::MAX) }),
        Coding::Occupancy(n) => Arc::new(occupancy::Occupancy { count: count(n, 1, u16::MAX) }),
        Coding::Stochastic(n) => Arc::new(stochastic::Stochastic { count: count(n, 1, u16::MAX) }),
    }
}

/// A map whose texels are coded in a fixed number of bytes.
#[derive(Clone, Debug)]
pub struct CodedMap {
    size: u32,
    coding: Coding,
    codec: Arc<dyn Codec>,
    /// `size * size` texels of the codec's stride, row 0 at v = 0.
    bytes: Vec<u8>,
    extents: Vec<[f32; 2]>,
    view: LightView,
}

impl CodedMap {
    /// A map with the coded texels `bytes`, `frame.map.size` squared of them, row 0 at v = 0, built
    /// from `view` for `frame`.
    ///
    /// # Panics
    /// If `bytes` does not hold exactly as many bytes as the texels need.
    pub fn new(bytes: Vec<u8>, coding: Coding, view: LightView, frame: &Frame) -> Self {
        let (size, codec) = (frame.map.size, codec(coding));
        let texels = size as usize * size as usize;
        assert_eq!(bytes.len(), texels * codec.stride(), "bytes of a {size}^2 map");
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        let extent = |i: usize| light_extent(frame, at(i % size as usize), at(i / size as usize));
        let extents = (0..texels).map(|i| extent(i).into()).collect();
        Self { size, coding, codec, bytes, extents, view }
    }

    /// The coded texels, row by row, row 0 at v = 0; [`CodedMap::stride`] bytes each.
    pub fn texels(&self) -> &[u8] {
        &self.bytes
    }

    /// Depths where each texel's ray enters and leaves the volume, row by row.
    pub fn extents(&self) -> &[[f32; 2]] {
        &self.extents
    }

    /// The kind of the map.
    pub fn kind(&self) -> MapKind {
        MapKind::Coded(self.coding)
    }

    /// Bytes per texel.
    pub fn stride(&self) -> usize {
        self.codec.stride()
    }

    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        &self.view
    }
}

impl Shadow for CodedMap {
    fn bytes(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for CodedMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let i = y as usize * self.size as usize + x as usize;
        let stride = self.codec.stride();
        let texel = &self.bytes[i * stride..][..stride];
        self.codec.transmittance(texel, self.extents[i], depth)
    }
}
