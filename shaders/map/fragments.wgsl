// Shadow lookup in a fragment map.
#import kernel/fragments
#import kernel/frame

// Whether lookups search lists.
const LISTS: bool = true;

// Index of the first node, and count, of each texel, row by row.
@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
// The links of each node to the texels to the right and above.
@group(0) @binding(7) var<storage, read> links: array<u32>;

// A depth behind every node.
const FARTHEST: f32 = 3e38;
// The number of nodes that a walk from a guess passes before a binary search takes over.
const MOST_WALKED: u32 = 8u;

fn list_of(texel: vec2<u32>) -> List {
    return list_of_run(runs[texel.y * frame.map.size + texel.x]);
}

fn node_of(list: List, k: u32) -> vec2<f32> {
    return nodes[list.first + k * list.stride];
}

// How many nodes of a list have at most this depth.
fn nodes_before(list: List, depth: f32) -> u32 {
    var low: u32 = 0u;
    var high = list.count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (node_of(list, middle).x <= depth) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// The position of a depth in a list: `before` nodes lie in front of it, a is the last of them and b
// the next one.
struct Place {
    before: u32,
    a: vec2<f32>,
    b: vec2<f32>,
}

// The place behind `before` nodes. Optical depth is zero in front of the first node and constant
// behind the last.
fn place_at(list: List, before: u32) -> Place {
    var a = vec2<f32>(-FARTHEST, 0.0);
    if (before > 0u) {
        a = node_of(list, before - 1u);
    }
    var b = vec2<f32>(FARTHEST, a.y);
    if (before < list.count) {
        b = node_of(list, before);
    }
    return Place(before, a, b);
}

// Whether a depth lies between the nodes of a place.
fn is_in(place: Place, depth: f32) -> bool {
    return place.a.x <= depth && depth < place.b.x;
}

// The neighbouring place on the depth's side; the same place if the depth lies in it.
fn place_towards(list: List, place: Place, depth: f32) -> Place {
    var next = place;
    if (place.b.x <= depth) {
        next.before = place.before + 1u;
        next.a = place.b;
        next.b = vec2<f32>(FARTHEST, place.b.y);
        if (next.before < list.count) {
            next.b = node_of(list, next.before);
        }
    } else if (place.a.x > depth) {
        next.before = place.before - 1u;
        next.b = place.a;
        next.a = vec2<f32>(-FARTHEST, 0.0);
        if (next.before > 0u) {
            next.a = node_of(list, next.before - 1u);
        }
    }
    return next;
}

// The place of a depth in a list: the given place if the depth lies in it, else found by a binary
// search.
fn place_searched(list: List, place: Place, depth: f32) -> Place {
    if (is_in(place, depth)) {
        return place;
    }
    return place_at(list, nodes_before(list, depth));
}

// The place of a depth in a list, found by a short walk from a guess, or by a binary search if it
// is farther away.
fn place_near(list: List, guess: u32, depth: f32) -> Place {
    var place = place_at(list, min(guess, list.count));
    for (var i: u32 = 0u; i < MOST_WALKED && !is_in(place, depth); i++) {
        place = place_towards(list, place, depth);
    }
    return place_searched(list, place, depth);
}

// Transmittance at a depth, given its place.
fn place_transmittance(list: List, place: Place, depth: f32) -> f32 {
    if (!USUAL && frame.map.sharpness > 0.0 && place.before > 0u) {
        let in_front = node_of(list, max(place.before, 2u) - 2u);
        return exponential_transmittance(in_front, place.a, place.b, depth, frame.map.sharpness);
    }
    return exp(-optical_depth_between(place.a, place.b, depth));
}

// Optical depth at which a shadow's front is taken to be.
const FRONT_DEPTH: f32 = 0.5;
// Optical depth that a texel must reach for its shadow to have a front: nine tenths of the light
// are gone.
const LEAST_WITH_FRONT: f32 = 2.3025851;

// (depth, 1) where a texel's shadow begins to matter, or 0 in place of the 1 if there is no such
// depth.
fn front(texel: vec2<u32>) -> vec2<f32> {
    let list = list_of(texel);
    if (list.count == 0u) {
        return vec2<f32>(0.0);
    }
    if (node_of(list, list.count - 1u).y < LEAST_WITH_FRONT) {
        return vec2<f32>(0.0);
    }
    var a = node_of(list, 0u);
    for (var k: u32 = 1u; k < list.count; k++) {
        let b = node_of(list, k);
        if (b.y >= FRONT_DEPTH) {
            let share = clamp((FRONT_DEPTH - a.y) / (b.y - a.y), 0.0, 1.0);
            return vec2<f32>(a.x + (b.x - a.x) * share, 1.0);
        }
        a = b;
    }
    return vec2<f32>(0.0);
}

// For each of four lists, how many nodes have at most a depth. The four binary searches run side by
// side, so that their reads overlap.
fn four_searches(a: List, b: List, c: List, d: List, depths: vec4<f32>) -> vec4<u32> {
    let firsts = vec4<u32>(a.first, b.first, c.first, d.first);
    let counts = vec4<u32>(a.count, b.count, c.count, d.count);
    let strides = vec4<u32>(a.stride, b.stride, c.stride, d.stride);
    let most = max(max(counts.x, counts.y), max(counts.z, counts.w));
    var before = vec4<u32>(0u);
    // The largest power of two <= `most`, then its half, and so on.
    for (var step = (1u << (firstLeadingBit(most) + 1u)) >> 1u; step > 0u; step >>= 1u) {
        let next = before + step;
        let at = firsts + (max(min(next, counts), vec4<u32>(1u)) - 1u) * strides;
        let found = vec4<f32>(nodes[at.x].x, nodes[at.y].x, nodes[at.z].x, nodes[at.w].x);
        before = select(before, next, (next <= counts) & (found <= depths));
    }
    return before;
}

// Where the last lookup of this invocation ended; the next one often ends there too.
var<private> last_places: vec4<u32>;

// Transmittances of four texels along their central rays from the light, each up to its own depth.
fn four_transmittances(x: vec4<u32>, y: vec4<u32>, depths: vec4<f32>) -> vec4<f32> {
    let a = list_of(vec2<u32>(x.x, y.x));
    let b = list_of(vec2<u32>(x.y, y.y));
    let c = list_of(vec2<u32>(x.z, y.z));
    let d = list_of(vec2<u32>(x.w, y.w));
    var in_a = Place();
    var in_b = Place();
    var in_c = Place();
    var in_d = Place();
    var found = false;
    // The texels of a window are others each time.
    if (USUAL || frame.map.window == 0u) {
        in_a = place_at(a, min(last_places.x, a.count));
        in_b = place_at(b, min(last_places.y, b.count));
        in_c = place_at(c, min(last_places.z, c.count));
        in_d = place_at(d, min(last_places.w, d.count));
        found = is_in(in_a, depths.x)
            && is_in(in_b, depths.y)
            && is_in(in_c, depths.z)
            && is_in(in_d, depths.w);
    }
    if (!found) {
        let before = four_searches(a, b, c, d, depths);
        in_a = place_at(a, before.x);
        in_b = place_at(b, before.y);
        in_c = place_at(c, before.z);
        in_d = place_at(d, before.w);
    }
    last_places = vec4<u32>(in_a.before, in_b.before, in_c.before, in_d.before);
    return vec4<f32>(
        place_transmittance(a, in_a, depths.x),
        place_transmittance(b, in_b, depths.y),
        place_transmittance(c, in_c, depths.z),
        place_transmittance(d, in_d, depths.w),
    );
}

// The place of a depth in the list of the next texel, found from the place `before` in a texel's
// own list through the link `direction` (0 right, 1 up).
fn linked_place(own: List, before: u32, list: List, direction: u32, depth: f32) -> Place {
    var guess: u32 = 0u;
    if (own.count > 0u) {
        let node = min(max(before, 1u) - 1u, own.count - 1u);
        guess = (links[own.first + node * own.stride] >> (16u * direction)) & NO_LINK;
    }
    return place_near(list, guess, depth);
}

// Mean transmittance over a window of texels, from `low` to `high` inclusive, which follows the
// links from the lower left texel (Real-time deep shadow maps for hair, "Spatial filtering").
fn linked_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    var row = list_of(vec2<u32>(low.x, high.y));
    var row_place = place_at(row, nodes_before(row, depth));
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i <= high.y - low.y; i++) {
        let y = high.y - i;
        if (i > 0u) {
            let upper = list_of(vec2<u32>(low.x, y));
            row_place = linked_place(row, row_place.before, upper, 1u, depth);
            row = upper;
        }
        var list = row;
        var place = row_place;
        for (var x = low.x; x <= high.x; x++) {
            if (x > low.x) {
                let right = list_of(vec2<u32>(x, y));
                place = linked_place(list, place.before, right, 0u, depth);
                list = right;
            }
            sum += place_transmittance(list, place, depth);
        }
    }
    let extent = vec2<f32>(high - low + 1u);
    return sum / (extent.x * extent.y);
}
