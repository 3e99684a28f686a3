//! Maps that keep every texel in the same number of bytes: one codec a file, each with its source.

mod slices;

use std::fmt::Debug;
use std::sync::Arc;

use super::ShadowMap;
use crate::frame::Frame;
use crate::kernel::fragments::Node;
use crate::kernel::light::light_extent;
use crate::scene::LightView;
use crate::settings::{Coding, MapKind};

/// What a codec keeps: optical depth over depth along one texel's ray.
#[derive(Clone, Copy, Debug)]
pub struct TexelRay<'a> {
    /// The polyline of all slabs, by rising depth; empty for a ray without medium. Optical depth is 0
    /// in front of the first node and stays behind the last.
    pub nodes: &'a [Node],
    /// Depths where the ray enters and leaves the volume; it misses if the second is not greater. A
    /// reader knows them without the map.
    pub extent: [f32; 2],
}

impl TexelRay<'_> {
    /// Transmittance at `depth`.
    pub fn transmittance(&self, depth: f32) -> f32 {
        use crate::kernel::fragments::{nodes_before, optical_depth_between};
        let before = nodes_before(self.nodes, depth);
        (-optical_depth_between(self.nodes, before, depth)).exp()
    }
}

/// A code for transmittance over depth along one ray.
pub trait Codec: Send + Sync + Debug {
    /// Bytes a texel.
    fn stride(&self) -> usize;

    /// Writes a ray into `texel`, whose [`Codec::stride`] bytes are zero.
    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]);

    /// Transmittance at `depth` of the ray of `extent` (as in [`TexelRay`]) from its bytes, in 0..1;
    /// of any bytes, also such that no encoder writes.
    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32;
}

/// The codec of a coding.
pub fn codec(coding: Coding) -> Arc<dyn Codec> {
    match coding {
        Coding::Slices(count) => Arc::new(slices::Slices { count: usize::from(count) }),
    }
}

/// A map of coded texels.
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
    /// A map of texels coded in `bytes`, row 0 at v = 0, built from `view` for `frame`.
    ///
    /// # Panics
    /// If there are more or fewer bytes than texels need.
    pub fn new(bytes: Vec<u8>, coding: Coding, view: LightView, frame: &Frame) -> Self {
        let (size, codec) = (frame.sizes[3], codec(coding));
        let texels = size as usize * size as usize;
        assert_eq!(bytes.len(), texels * codec.stride(), "bytes of a {size}^2 map");
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        let extent = |i: usize| light_extent(frame, at(i % size as usize), at(i / size as usize));
        let extents = (0..texels).map(|i| extent(i).into()).collect();
        Self { size, coding, codec, bytes, extents, view }
    }

    /// The bytes of the texels, row 0 at v = 0.
    pub fn texels(&self) -> &[u8] {
        &self.bytes
    }

    /// What kind of map it is.
    pub fn kind(&self) -> MapKind {
        MapKind::Coded(self.coding)
    }

    /// Bytes a texel.
    pub fn stride(&self) -> usize {
        self.codec.stride()
    }

    /// How the map lies in the world.
    pub fn view(&self) -> &LightView {
        &self.view
    }
}

impl ShadowMap for CodedMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn bytes(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let i = y as usize * self.size as usize + x as usize;
        let stride = self.codec.stride();
        let texel = &self.bytes[i * stride..][..stride];
        self.codec.transmittance(texel, self.extents[i], depth)
    }
}
