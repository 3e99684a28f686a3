// Lists of nodes (depth, optical depth up to there) in storage buffers, and transmittance from
// them. Between two nodes optical depth is linear.

// The nodes of a texel: the first, how many, and how far apart in the buffer.
struct List {
    first: u32,
    count: u32,
    stride: u32,
}

// In the count of a run: its nodes lie INTERLEAVED_STRIDE apart, those of a block of texels side by
// side; without it, next to each other.
const INTERLEAVED: u32 = 0x80000000u;
const INTERLEAVED_STRIDE: u32 = 64u;

fn list_of_run(run: vec2<u32>) -> List {
    let interleaved = (run.y & INTERLEAVED) != 0u;
    return List(run.x, run.y & ~INTERLEAVED, select(1u, INTERLEAVED_STRIDE, interleaved));
}

// A link: the place of a node in the list of the texel to the right in the lower sixteen bits, of
// the one above in the upper; NO_LINK where that list is empty or the place is beyond them.
const NO_LINK: u32 = 0xffffu;

fn packed_link(neighbor: List, place: u32) -> u32 {
    return select(min(place, NO_LINK), NO_LINK, neighbor.count == 0u);
}

// Optical depth at a depth between the nodes a, in front of it, and b, behind it.
fn optical_depth_between(a: vec2<f32>, b: vec2<f32>, depth: f32) -> f32 {
    return a.y + (b.y - a.y) * ((depth - a.x) / (b.x - a.x));
}

// The same for transmittance with each fragment's shadow test an exponential of the way from its
// front (exponential deep shadow maps); `before` is the node in front of a, a itself if there is
// none, and b is a behind the last node.
fn exponential_transmittance(
    before: vec2<f32>,
    a: vec2<f32>,
    b: vec2<f32>,
    depth: f32,
    sharpness: f32,
) -> f32 {
    let passed = 1.0 - exp(-sharpness * (depth - a.x));
    let at_a = exp(-a.y);
    // A surface at a that has only just been passed.
    let start = select(at_a, exp(-before.y), before.x == a.x);
    return start + (at_a - start) * passed + (exp(-b.y) - at_a) * passed;
}
