// The part of a map that a pass works on, and the capacity of its buffers.

struct Tile {
    // The tile's first texel in the map.
    origin: vec2<u32>,
    // The tile's size in texels.
    extent: vec2<u32>,
    // Nodes per texel for trace_slices; elements of the whole tile for raster_slices, fragments or
    // parts of the whole tile for raster_surfaces and raster_view, nodes of the whole tile for sort_fragments.
    capacity: u32,
    // How many segments of strands, triangles and points of strands there are.
    segments: u32,
    triangles: u32,
    points: u32,
}

@group(0) @binding(8) var<uniform> tile: Tile;
