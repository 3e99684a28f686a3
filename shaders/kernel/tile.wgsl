// The part of a map that a pass works on, and how much its buffers hold.

struct Tile {
    // Its first texel in the map.
    origin: vec2<u32>,
    // Its texels.
    extent: vec2<u32>,
    // trace_slices: nodes a texel; raster_slices: elements, sort_fragments: nodes of the whole
    // tile.
    capacity: u32,
    unused0: u32,
    unused1: u32,
    unused2: u32,
}

@group(0) @binding(8) var<uniform> tile: Tile;
