//! The part of a map that a pass works on.

use bytemuck::{Pod, Zeroable};

use crate::shadow::Node;

/// Texels of a block whose nodes lie side by side, which is how far apart a texel's are.
pub const INTERLEAVED_STRIDE: u32 = 64;
/// In the count of a run: its nodes are interleaved with those of a block.
pub const INTERLEAVED: u32 = 0x8000_0000;

/// The part of a map that a pass works on (`shaders/kernel/tile.wgsl`).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Tile {
    /// Its first texel in the map.
    pub origin: [u32; 2],
    /// Its texels.
    pub extent: [u32; 2],
    /// What its buffers hold: nodes a texel (`trace_slices`), elements (`raster_slices`).
    pub capacity: u32,
    unused: [u32; 3],
}

impl Tile {
    /// Rows `first` to `first + rows` of a map.
    pub fn rows(size: u32, first: u32, rows: u32, capacity: u32) -> Self {
        Self { origin: [0, first], extent: [size, rows], capacity, unused: [0; 3] }
    }

    /// Texels.
    pub fn texels(&self) -> u64 {
        u64::from(self.extent[0]) * u64::from(self.extent[1])
    }

    /// Bytes of `capacity` nodes for each texel.
    pub(super) fn node_bytes(&self) -> u64 {
        self.block_texels() * u64::from(self.capacity) * size_of::<Node>() as u64
    }

    /// Texels of the blocks that cover it.
    pub(super) fn block_texels(&self) -> u64 {
        let blocks = self.extent.map(|n| u64::from(n.div_ceil(8)));
        blocks[0] * blocks[1] * u64::from(INTERLEAVED_STRIDE)
    }
}
