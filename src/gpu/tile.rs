//! The part of a map that a pass works on.

use bytemuck::{Pod, Zeroable};

use crate::shadow::Node;

/// Number of texels in a block whose nodes are interleaved, which is the stride between the nodes
/// of a texel.
pub const INTERLEAVED_STRIDE: u32 = 64;
/// A flag in the count of a run: its nodes are interleaved with those of the other texels of a
/// block.
pub const INTERLEAVED: u32 = 0x8000_0000;

/// The uniform that tells a pass which part of a map it works on (`shaders/kernel/tile.wgsl`).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Tile {
    /// The tile's first texel in the map.
    pub origin: [u32; 2],
    /// The tile's size in texels.
    pub extent: [u32; 2],
    /// Capacity of its buffers: nodes per texel (`trace_slices`), nodes of the whole map
    /// (`pack_lists`), or elements or parts of the whole tile (`raster_slices`, `raster_surfaces`,
    /// `raster_view`).
    pub capacity: u32,
    /// How many segments of strands are drawn.
    pub segments: u32,
    /// How many triangles are drawn.
    pub triangles: u32,
    /// How many points the strands have.
    pub points: u32,
    /// Rows of the map, in whole blocks, whose lists are in front of this tile's in the buffers of
    /// `trace_slices` and `pack_lists`.
    pub rows_before: u32,
    /// Nothing: the struct's size is a multiple of its alignment in the shaders.
    pub unused: u32,
}

impl Tile {
    /// The tile with the rows `first` to `first + rows` of a map of `size` squared texels.
    pub fn rows(size: u32, first: u32, rows: u32, capacity: u32) -> Self {
        let (origin, extent) = ([0, first], [size, rows]);
        Self { origin, extent, capacity, ..Self::zeroed() }
    }

    /// Number of texels.
    pub fn texels(&self) -> u64 {
        u64::from(self.extent[0]) * u64::from(self.extent[1])
    }

    /// Bytes of `capacity` nodes for each texel.
    pub(super) fn node_bytes(&self) -> u64 {
        self.block_texels() * u64::from(self.capacity) * size_of::<Node>() as u64
    }

    /// Number of texels in the blocks that cover the tile.
    pub(super) fn block_texels(&self) -> u64 {
        let blocks = self.extent.map(|n| u64::from(n.div_ceil(8)));
        blocks[0] * blocks[1] * u64::from(INTERLEAVED_STRIDE)
    }
}
