// Linked lists of fragments: a head buffer, an element buffer and counters. Any caster may push
// fragments. (Real-time deep shadow maps for hair, "Creating list entries".)
#import kernel/tile

struct Element {
    front: f32,
    back: f32,
    optical_depth: f32,
    // Index of the next element plus one; 0 at the end of a list.
    next: u32,
}

// Index of the first element of each texel's list plus one; 0 for an empty list.
@group(0) @binding(9) var<storage, read_write> heads: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read_write> elements: array<Element>;
// The number of pushed elements, with those that found no room; the number of nodes made from them;
// of surfaces, those left to pass raster_large, and a 256th of the elements, rounded up, which tells
// when their number exceeds 32 bits.
@group(0) @binding(11) var<storage, read_write> counters: array<atomic<u32>, 4>;

const OPAQUE_OPTICAL_DEPTH: f32 = 87.0;

// Pushes a slab, or with equal bounds a surface, on a texel's list. A fragment that finds no room
// is still counted, so that the pass can run again with a larger buffer.
fn push_fragment(texel: u32, bounds: vec2<f32>, optical_depth: f32) {
    put_fragment(atomicAdd(&counters[0], 1u), texel, bounds, optical_depth);
}

// The same for a fragment that is counted already and whose place in the buffer is known.
fn put_fragment(at: u32, texel: u32, bounds: vec2<f32>, optical_depth: f32) {
    if (at < tile.capacity) {
        let next = atomicExchange(&heads[texel], at + 1u);
        let capped = min(optical_depth, OPAQUE_OPTICAL_DEPTH);
        elements[at] = Element(bounds.x, bounds.y, capped, next);
    }
}
