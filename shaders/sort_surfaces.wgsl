// Pass sort_surfaces: turns each texel's list of parts into pieces in order of depth that do not
// overlap. Parts of one strand that follow each other become one. One thread per texel; lists may
// have any length.
#import kernel/frame
#import kernel/parts

// Where each texel's pieces are: the index of the first, and how many there are.
@group(0) @binding(36) var<storage, read_write> piece_runs: array<vec2<u32>>;
// Front, back and optical depth of each.
@group(0) @binding(37) var<storage, read_write> pieces: array<vec3<f32>>;

// Lists up to this length use insertion sort.
const SHORT: u32 = 32u;
const OPAQUE_OPTICAL_DEPTH: f32 = 87.0;
const FARTHEST: f32 = 3.4028234663852886e38;

var<private> first: u32;
var<private> count: u32;

fn push_piece(front: f32, back: f32, optical_depth: f32) {
    pieces[first + count] = vec3<f32>(front, back, optical_depth);
    count++;
}

// A number with the order of a depth.
fn order_of(depth: f32) -> u32 {
    let bits = bitcast<u32>(depth);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

// Sorts a short list by its keys, in registers, and returns its head.
fn insertion_sort(head: u32) -> u32 {
    var order: array<u32, SHORT>;
    var keys: array<u32, SHORT>;
    var length: u32 = 0u;
    for (var at = head; at != 0u; at = parts[at - 1u].next) {
        let key = parts[at - 1u].key;
        var place = length;
        while (place > 0u && keys[place - 1u] > key) {
            keys[place] = keys[place - 1u];
            order[place] = order[place - 1u];
            place--;
        }
        keys[place] = key;
        order[place] = at;
        length++;
    }
    var next: u32 = 0u;
    for (var i = length; i > 0u; i--) {
        parts[order[i - 1u] - 1u].next = next;
        next = order[i - 1u];
    }
    return next;
}

// Sorts a list of any length by its keys, in place, by merging sorted stretches of doubling length,
// and returns its head.
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
                right = parts[right - 1u].next;
            }
            var right_count = stretch;
            while (left_count > 0u || (right_count > 0u && right != 0u)) {
                var take_left = right_count == 0u || right == 0u;
                if (!take_left && left_count > 0u) {
                    take_left = parts[left - 1u].key <= parts[right - 1u].key;
                }
                var taken: u32;
                if (take_left) {
                    taken = left;
                    left = parts[left - 1u].next;
                    left_count--;
                } else {
                    taken = right;
                    right = parts[right - 1u].next;
                    right_count--;
                }
                if (tail == 0u) {
                    head = taken;
                } else {
                    parts[tail - 1u].next = taken;
                }
                tail = taken;
            }
            left = right;
        }
        if (tail != 0u) {
            parts[tail - 1u].next = 0u;
        }
        if (merges <= 1u) {
            return head;
        }
    }
    return head;
}

// Sorts a list with `length` parts, and returns its head.
fn sorted(head: u32, length: u32) -> u32 {
    if (length <= SHORT) {
        return insertion_sort(head);
    }
    return merge_sort(head);
}

// Puts the parts of each strand together that follow each other in a list sorted by points. Gives
// every part its optical depth and the order of its front as its key. Returns the head of those that
// take any light, and their number.
fn put_together(list_head: u32) -> vec2<u32> {
    var head = 0u;
    var tail = 0u;
    var length = 0u;
    var at = list_head;
    while (at != 0u) {
        let own = at;
        var part = parts[own - 1u];
        at = part.next;
        if (part.key != OF_TRIANGLE) {
            var last = part.key;
            while (at != 0u && parts[at - 1u].key == last + 1u) {
                let more = parts[at - 1u];
                part.front = min(part.front, more.front);
                part.back = max(part.back, more.back);
                part.area += more.area;
                part.taken += more.taken;
                last = more.key;
                at = more.next;
            }
            let alpha = clamp(part.taken / max(part.area, 1.0), 0.0, 1.0);
            part.taken = OPAQUE_OPTICAL_DEPTH;
            if (alpha < 1.0) {
                part.taken = clamp(-log(1.0 - alpha), 0.0, OPAQUE_OPTICAL_DEPTH);
            }
            if (frame.map.covers == 0u) {
                part.front = 0.5 * (part.front + part.back);
                part.back = part.front;
            }
        }
        if (!(part.taken > 0.0 && abs(part.back) < FARTHEST)) {
            continue;
        }
        part.key = order_of(part.front);
        part.next = 0u;
        parts[own - 1u] = part;
        if (tail == 0u) {
            head = own;
        } else {
            parts[tail - 1u].next = own;
        }
        tail = own;
        length++;
    }
    return vec2<u32>(head, length);
}

// Takes a list, sorted by fronts, apart into pieces (src/shadow/fragments/overlaps.rs).
fn take_apart(list_head: u32) {
    var head = list_head;
    // The list of those that begin in front of `at` and may end behind it.
    var open = 0u;
    var at = -FARTHEST;
    var passed = 0.0;
    while (passed < OPAQUE_OPTICAL_DEPTH) {
        while (head != 0u) {
            let part = parts[head - 1u];
            if (part.front > at) {
                break;
            }
            if (part.back > part.front) {
                parts[head - 1u].next = open;
                open = head;
            } else {
                passed += part.taken;
                push_piece(part.front, part.back, part.taken);
            }
            head = part.next;
        }
        var end = FARTHEST;
        if (head != 0u) {
            end = parts[head - 1u].front;
        }
        // Their extinction, up to the first end. Those that have ended leave the list.
        var extinction = 0.0;
        var before = 0u;
        var one = open;
        while (one != 0u) {
            let part = parts[one - 1u];
            if (part.back > at) {
                extinction += part.taken / (part.back - part.front);
                end = min(end, part.back);
                before = one;
            } else if (before == 0u) {
                open = part.next;
            } else {
                parts[before - 1u].next = part.next;
            }
            one = part.next;
        }
        if (end == FARTHEST) {
            return;
        }
        if (open != 0u) {
            let optical_depth = extinction * (end - at);
            passed += optical_depth;
            push_piece(at, end, optical_depth);
        }
        at = end;
    }
}

@compute @workgroup_size(8, 8)
fn sort_surfaces(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let texel = id.y * tile.extent.x + id.x;
    let head = atomicLoad(&heads[texel]);
    piece_runs[texel] = vec2<u32>(0u);
    if (head == 0u) {
        return;
    }
    var length = 0u;
    for (var at = head; at != 0u; at = parts[at - 1u].next) {
        length++;
    }
    let whole = put_together(sorted(head, length));
    // A part that overlaps others begins and ends one piece at most.
    first = atomicAdd(&counters[1], 2u * whole.y);
    count = 0u;
    take_apart(sorted(whole.x, whole.y));
    piece_runs[texel] = vec2<u32>(first, count);
}
