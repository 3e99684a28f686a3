// Lists of nodes in storage buffers, and transmittance from them. A node is a depth and the optical
// depth from the light to there; between two nodes optical depth is linear.

// The nodes of a texel: index of the first, how many there are, and their stride in the buffer.
struct List {
    first: u32,
    count: u32,
    stride: u32,
}

// A flag in the count of a run: its nodes lie INTERLEAVED_STRIDE apart, interleaved with those of
// the other texels of a block. Without it they are contiguous.
const INTERLEAVED: u32 = 0x80000000u;
const INTERLEAVED_STRIDE: u32 = 64u;

fn list_of_run(run: vec2<u32>) -> List {
    let interleaved = (run.y & INTERLEAVED) != 0u;
    return List(run.x, run.y & ~INTERLEAVED, select(1u, INTERLEAVED_STRIDE, interleaved));
}

// A link holds the index of a node in the list of the texel to the right (lower sixteen bits) and
// of the texel above (upper sixteen). NO_LINK: that list is empty, or the index does not fit.
const NO_LINK: u32 = 0xffffu;

fn packed_link(neighbor: List, place: u32) -> u32 {
    return select(min(place, NO_LINK), NO_LINK, neighbor.count == 0u);
}

// Optical depth at a depth between node a in front of it and node b behind it.
fn optical_depth_between(a: vec2<f32>, b: vec2<f32>, depth: f32) -> f32 {
    return a.y + (b.y - a.y) * ((depth - a.x) / (b.x - a.x));
}

// Transmittance where each fragment's shadow test is an exponential of the distance from its front
// (exponential deep shadow maps). `before` is the node in front of a, or a itself if there is none;
// b is a behind the last node.
fn exponential_transmittance(
    before: vec2<f32>,
    a: vec2<f32>,
    b: vec2<f32>,
    depth: f32,
    sharpness: f32,
) -> f32 {
    let passed = 1.0 - exp(-sharpness * (depth - a.x));
    let at_a = exp(-a.y);
    // The depth lies just behind a surface at a.
    let start = select(at_a, exp(-before.y), before.x == a.x);
    return start + (at_a - start) * passed + (exp(-b.y) - at_a) * passed;
}
