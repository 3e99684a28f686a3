// Pass sort_fragments: sorts each texel's linked list by depth and turns it into a contiguous run
// of nodes: all of them, truncated, or as few as the tolerance allows. One thread per texel; lists
// may have any length.
#import kernel/fitting
#import kernel/frame
#import kernel/sorted_lists

@group(0) @binding(5) var<storage, read_write> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> nodes: array<vec2<f32>>;

var<private> first: u32;
var<private> count: u32;
var<private> keeping: bool;

fn keep_node(node: vec2<f32>) {
    if (keeping) {
        nodes[first + count] = node;
    }
    count++;
}

// Turns the sorted list into nodes. Counts them, and writes them if `keeping`.
fn fit(head: u32) {
    count = 0u;
    fitter_start(frame.map.tolerance);
    for (var at = head; at != 0u; at = elements[at - 1u].next) {
        let element = elements[at - 1u];
        fitter_add(vec2<f32>(element.front, element.back), element.optical_depth);
    }
    fitter_finish();
}

fn kept_node(k: u32) -> vec2<f32> {
    return nodes[first + k];
}

@compute @workgroup_size(8, 8)
fn sort_fragments(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let texel = id.y * tile.extent.x + id.x;
    let head = sorted(atomicLoad(&heads[texel]));
    if (head == 0u) {
        runs[texel] = vec2<u32>(0u);
        return;
    }
    keeping = false;
    fit(head);
    first = atomicAdd(&counters[1], count);
    keeping = true;
    fit(head);
    if (frame.map.tolerance == 0.0) {
        let kept = truncated(count, frame.map.truncation);
        if (kept < count) {
            nodes[first + kept] = kept_node(count - 1u);
            count = kept + 1u;
        }
    }
    runs[texel] = vec2<u32>(first, count);
}
