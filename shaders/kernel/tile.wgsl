// The part of a map that a pass works on, and the capacity of its buffers.

struct Tile {
    // The tile's first texel in the map.
    origin: vec2<u32>,
    // The tile's size in texels.
    extent: vec2<u32>,
    // Of trace_slices nodes of each texel, of pack_lists nodes of the map; of all others elements or
    // nodes of the whole tile.
    capacity: u32,
    // How many segments of strands, triangles and points of strands there are.
    segments: u32,
    triangles: u32,
    points: u32,
    // Rows of the map, in whole blocks, whose lists are in front of this tile's in the buffers of
    // trace_slices and pack_lists.
    rows_before: u32,
    unused: u32,
}

@group(0) @binding(8) var<uniform> tile: Tile;
