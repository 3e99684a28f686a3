// A fragment map as what shadows are looked up in.
#import kernel/fragments
#import kernel/frame

// First node and count of each texel, row by row.
@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
// For each node the nearest in depth of the texel to the right and of the one above, as places in
// those texels' lists; NO_LINK without.
@group(0) @binding(7) var<storage, read> links: array<vec2<u32>>;

const NO_LINK: u32 = 0xffffffffu;
// Nodes that a walk from a link passes before a search takes over.
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

// Transmittance at a depth that `before` nodes lie in front of.
fn list_transmittance(list: List, before: u32, depth: f32) -> f32 {
    if (before == 0u) {
        return 1.0;
    }
    let a = node_of(list, before - 1u);
    let b = node_of(list, min(before, list.count - 1u));
    if (frame.filtering.x > 0.0) {
        let in_front = node_of(list, max(before, 2u) - 2u);
        return exponential_transmittance(in_front, a, b, depth, frame.filtering.x);
    }
    if (before == list.count) {
        return exp(-a.y);
    }
    return exp(-optical_depth_at(a, b, depth));
}

// Transmittance along the central ray of a texel to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    let list = list_of(texel);
    return list_transmittance(list, nodes_before(list, depth), depth);
}

// The place of a depth in a list, from the place `before` in the list of a neighbour by the link
// `direction` (0 right, 1 up): a few nodes further or back; a search where the two lists have little in
// common.
fn linked_place(own: List, before: u32, list: List, direction: u32, depth: f32) -> u32 {
    if (own.count > 0u && list.count > 0u) {
        let node = min(max(before, 1u) - 1u, own.count - 1u);
        var place = min(links[own.first + node * own.stride][direction], list.count);
        for (var i: u32 = 0u; i < MOST_WALKED; i++) {
            if (place < list.count && node_of(list, place).x <= depth) {
                place++;
            } else if (place > 0u && node_of(list, place - 1u).x > depth) {
                place--;
            } else {
                return place;
            }
        }
    }
    return nodes_before(list, depth);
}

// Mean transmittance over a window of texels, its ends included: from its lower left texel along the
// links (real-time deep shadow maps for hair, "Spatial filtering").
fn window_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    if (frame.counts.z == 0u) {
        return brute_force_mean(low, high, depth);
    }
    var row = list_of(vec2<u32>(low.x, high.y));
    var row_place = nodes_before(row, depth);
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i <= high.y - low.y; i++) {
        let y = high.y - i;
        if (i > 0u) {
            let upper = list_of(vec2<u32>(low.x, y));
            row_place = linked_place(row, row_place, upper, 1u, depth);
            row = upper;
        }
        var list = row;
        var place = row_place;
        for (var x = low.x; x <= high.x; x++) {
            if (x > low.x) {
                let right = list_of(vec2<u32>(x, y));
                place = linked_place(list, place, right, 0u, depth);
                list = right;
            }
            sum += list_transmittance(list, place, depth);
        }
    }
    let extent = vec2<f32>(high - low + 1u);
    return sum / (extent.x * extent.y);
}
