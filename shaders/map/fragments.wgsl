// A fragment map as what shadows are looked up in.
#import kernel/fragments
#import kernel/frame

// First node and count of each texel, row by row.
@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
// For each node its links to the texels to the right and above.
@group(0) @binding(7) var<storage, read> links: array<u32>;

// Deeper than every node.
const FARTHEST: f32 = 3e38;
// Nodes that a walk from a guess passes before a search takes over.
const MOST_WALKED: u32 = 8u;

fn list_of(texel: vec2<u32>) -> List {
    return list_of_run(runs[texel.y * frame.sizes.w + texel.x]);
}

fn node_of(list: List, k: u32) -> vec2<f32> {
    return nodes[list.first + k * list.stride];
}

// How many nodes of a list lie at or in front of a depth.
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

// Where a depth lies in a list: behind `before` nodes, the last of them a, the next one b.
struct Place {
    before: u32,
    a: vec2<f32>,
    b: vec2<f32>,
}

// The nodes on both sides of a place; in front of the first there is no optical depth, and behind the last
// it stays.
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

// The place of a depth in a list, near a guess: a few nodes further or back, else by a search.
fn place_near(list: List, guess: u32, depth: f32) -> Place {
    var place = place_at(list, min(guess, list.count));
    for (var i: u32 = 0u; i < MOST_WALKED; i++) {
        if (place.b.x <= depth) {
            place = place_at(list, place.before + 1u);
        } else if (place.a.x > depth) {
            place = place_at(list, place.before - 1u);
        } else {
            return place;
        }
    }
    return place_at(list, nodes_before(list, depth));
}

// Transmittance at a depth in its place.
fn place_transmittance(list: List, place: Place, depth: f32) -> f32 {
    if (frame.filtering.x > 0.0 && place.before > 0u) {
        let in_front = node_of(list, max(place.before, 2u) - 2u);
        return exponential_transmittance(in_front, place.a, place.b, depth, frame.filtering.x);
    }
    return exp(-optical_depth_at(place.a, place.b, depth));
}

// Transmittance along the central ray of a texel to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    let list = list_of(texel);
    return place_transmittance(list, place_at(list, nodes_before(list, depth)), depth);
}

// Where the last lookup of this invocation ended: a ray's next lookup is not far from there.
var<private> last_places: vec4<u32>;

// Transmittances of four texels: upper left, upper right, lower left, lower right.
fn four_transmittances(low: vec2<u32>, high: vec2<u32>, depth: f32) -> vec4<f32> {
    let lists = array<List, 4>(
        list_of(low),
        list_of(vec2<u32>(high.x, low.y)),
        list_of(vec2<u32>(low.x, high.y)),
        list_of(high),
    );
    let places = array<Place, 4>(
        place_near(lists[0], last_places.x, depth),
        place_near(lists[1], last_places.y, depth),
        place_near(lists[2], last_places.z, depth),
        place_near(lists[3], last_places.w, depth),
    );
    last_places =
        vec4<u32>(places[0].before, places[1].before, places[2].before, places[3].before);
    return vec4<f32>(
        place_transmittance(lists[0], places[0], depth),
        place_transmittance(lists[1], places[1], depth),
        place_transmittance(lists[2], places[2], depth),
        place_transmittance(lists[3], places[3], depth),
    );
}

// The place of a depth in a list, from the place `before` in the list of a neighbour by the link
// `direction` (0 right, 1 up).
fn linked_place(own: List, before: u32, list: List, direction: u32, depth: f32) -> Place {
    var guess: u32 = 0u;
    if (own.count > 0u) {
        let node = min(max(before, 1u) - 1u, own.count - 1u);
        guess = (links[own.first + node * own.stride] >> (16u * direction)) & NO_LINK;
    }
    return place_near(list, guess, depth);
}

// Mean transmittance over a window of texels, its ends included: from its lower left texel along the
// links (real-time deep shadow maps for hair, "Spatial filtering").
fn window_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    if (frame.counts.z == 0u) {
        return brute_force_mean(low, high, depth);
    }
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
