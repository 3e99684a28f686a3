// Pass sort_fragments: sorts each texel's linked list by depth and turns it into a contiguous run
// of nodes: all of them, truncated, or as few as the tolerance allows. One thread per texel; lists
// may have any length.
#import kernel/fitting
#import kernel/frame
#import kernel/lists

@group(0) @binding(5) var<storage, read_write> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> nodes: array<vec2<f32>>;

// Lists up to this length use insertion sort.
const SHORT: u32 = 32u;

var<private> first: u32;
var<private> count: u32;
var<private> keeping: bool;

fn keep_node(node: vec2<f32>) {
    if (keeping) {
        nodes[first + count] = node;
    }
    count++;
}

// Sorts a short list by insertion in registers, relinks it and returns its head.
fn insertion_sort(head: u32) -> u32 {
    var order: array<u32, SHORT>;
    var depths: array<f32, SHORT>;
    var length: u32 = 0u;
    for (var at = head; at != 0u; at = elements[at - 1u].next) {
        let depth = elements[at - 1u].front;
        var place = length;
        while (place > 0u && depths[place - 1u] > depth) {
            depths[place] = depths[place - 1u];
            order[place] = order[place - 1u];
            place--;
        }
        depths[place] = depth;
        order[place] = at;
        length++;
    }
    for (var i: u32 = 0u; i < length; i++) {
        var next: u32 = 0u;
        if (i + 1u < length) {
            next = order[i + 1u];
        }
        elements[order[i] - 1u].next = next;
    }
    return order[0];
}

// Sorts a list of any length in place, by merging sorted stretches of doubling length, and returns
// its head.
fn merge_sort(list_head: u32) -> u32 {
    var head = list_head;
    for (var stretch: u32 = 1u;; stretch *= 2u) {
        var left = head;
        var tail: u32 = 0u;
        var merges: u32 = 0u;
        head = 0u;
        while (left != 0u) {
            merges++;
            var right = left;
            var left_count: u32 = 0u;
            while (left_count < stretch && right != 0u) {
                left_count++;
                right = elements[right - 1u].next;
            }
            var right_count = stretch;
            while (left_count > 0u || (right_count > 0u && right != 0u)) {
                var take_left = right_count == 0u || right == 0u;
                if (!take_left && left_count > 0u) {
                    take_left = elements[left - 1u].front <= elements[right - 1u].front;
                }
                var taken: u32;
                if (take_left) {
                    taken = left;
                    left = elements[left - 1u].next;
                    left_count--;
                } else {
                    taken = right;
                    right = elements[right - 1u].next;
                    right_count--;
                }
                if (tail == 0u) {
                    head = taken;
                } else {
                    elements[tail - 1u].next = taken;
                }
                tail = taken;
            }
            left = right;
        }
        elements[tail - 1u].next = 0u;
        if (merges <= 1u) {
            return head;
        }
    }
    return head;
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
    var head = atomicLoad(&heads[texel]);
    if (head == 0u) {
        runs[texel] = vec2<u32>(0u);
        return;
    }
    var length: u32 = 0u;
    for (var at = head; at != 0u; at = elements[at - 1u].next) {
        length++;
    }
    if (length <= SHORT) {
        head = insertion_sort(head);
    } else {
        head = merge_sort(head);
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
