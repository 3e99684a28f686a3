// Linked lists of what surfaces leave in each texel: a head buffer, an element buffer and counters
// ("Real-Time Deep Shadow Maps", "Creating list entries").
#import kernel/tile

// What a segment of a strand, or a triangle, leaves in a texel.
struct SurfacePart {
    // Lists are sorted by this: first the index of the segment's first point, or OF_TRIANGLE; once
    // strands are put together, the order of the fronts.
    key: u32,
    front: f32,
    back: f32,
    // Of a segment: the area of the texel that it covers.
    area: f32,
    // Of a segment: area times opacity. Else, and once strands are put together: optical depth.
    taken: f32,
    // Index of the next part plus one; 0 at the end of a list.
    next: u32,
}

const OF_TRIANGLE: u32 = 0xffffffffu;

// Index of the first part of each texel's list plus one; 0 for an empty list.
@group(0) @binding(9) var<storage, read_write> heads: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read_write> parts: array<SurfacePart>;
// The number of pushed parts, with those that found no room; the number of pieces made of them; and
// the number of surfaces that are left to pass raster_large.
@group(0) @binding(11) var<storage, read_write> counters: array<atomic<u32>, 4>;

// Pushes a part on the list of a texel of the tile. One that finds no room is still counted, so that
// the pass can run again with a larger buffer.
fn push_part(texel: vec2<u32>, key: u32, depths: vec2<f32>, area: f32, taken: f32) {
    let at = atomicAdd(&counters[0], 1u);
    if (at < tile.capacity) {
        let own = texel - tile.origin;
        let next = atomicExchange(&heads[own.y * tile.extent.x + own.x], at + 1u);
        parts[at] = SurfacePart(key, depths.x, depths.y, area, taken, next);
    }
}
