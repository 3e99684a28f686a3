// Linked lists of fragments: a head buffer, an element buffer and counters. Any caster may push
// fragments. (Real-time deep shadow maps for hair, "Creating list entries".)
#import kernel/heads
#import kernel/tile

struct Element {
    front: f32,
    back: f32,
    optical_depth: f32,
    // Index of the next element plus one; 0 at the end of a list.
    next: u32,
}

@group(0) @binding(10) var<storage, read_write> elements: array<Element>;

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
