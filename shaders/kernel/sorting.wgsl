// Sorts linked lists of any length by the depths of their elements, in place. A file that imports this
// defines `depth_of(element: u32) -> f32`, `next_of(element: u32) -> u32` and
// `link_to(element: u32, next: u32)`; elements are their indices plus one.

// Stretches of this length are sorted by insertion.
const STRETCH: u32 = 16u;

// Sorts the first elements of a list, by insertion in private memory. Returns the head of what is
// sorted, its last element, and the head of the rest.
fn sorted_stretch(head: u32) -> vec3<u32> {
    var order: array<u32, STRETCH>;
    var depths: array<f32, STRETCH>;
    var length: u32 = 0u;
    var at = head;
    while (at != 0u && length < STRETCH) {
        let depth = depth_of(at);
        var place = length;
        while (place > 0u && depths[place - 1u] > depth) {
            depths[place] = depths[place - 1u];
            order[place] = order[place - 1u];
            place--;
        }
        depths[place] = depth;
        order[place] = at;
        length++;
        at = next_of(at);
    }
    for (var i: u32 = 1u; i < length; i++) {
        link_to(order[i - 1u], order[i]);
    }
    return vec3<u32>(order[0], order[length - 1u], at);
}

// The sorted stretches that are merged at once: of each the first element (0 behind its last), its
// depth, and the element behind it. Their numbers are constants everywhere, so that they stay in
// registers.
struct Ways {
    heads: array<vec4<u32>, 4>,
    depths: array<vec4<f32>, 4>,
    nexts: array<vec4<u32>, 4>,
}

const WAYS: u32 = 16u;
// The length of what is merged at once.
const GROUP: u32 = 256u;
// A depth behind all elements, and the largest that one has.
const NO_DEPTH: f32 = 3.4028234663852886e38;
const LAST_DEPTH: f32 = 3.4e38;

// Puts `head` at the front of way `which`.
fn set_way(ways: ptr<function, Ways>, which: u32, head: u32) {
    var depth = NO_DEPTH;
    var next: u32 = 0u;
    if (head != 0u) {
        depth = min(depth_of(head), LAST_DEPTH);
        next = next_of(head);
    }
    set_four(ways, 0u, which, head, depth, next);
    set_four(ways, 1u, which, head, depth, next);
    set_four(ways, 2u, which, head, depth, next);
    set_four(ways, 3u, which, head, depth, next);
}

// The same for the ways 4 `four` to 4 `four` + 3.
fn set_four(ways: ptr<function, Ways>, four: u32, which: u32, head: u32, depth: f32, next: u32) {
    let own = vec4<u32>(0u, 1u, 2u, 3u) + 4u * four == vec4<u32>(which);
    (*ways).heads[four] = select((*ways).heads[four], vec4<u32>(head), own);
    (*ways).depths[four] = select((*ways).depths[four], vec4<f32>(depth), own);
    (*ways).nexts[four] = select((*ways).nexts[four], vec4<u32>(next), own);
}

// The first way with a depth, among four.
fn first_with(depths: vec4<f32>, depth: f32) -> u32 {
    let own = depths == vec4<f32>(depth);
    return select(select(select(3u, 2u, own.z), 1u, own.y), 0u, own.x);
}

fn one_of(four: vec4<u32>, which: u32) -> u32 {
    return select(select(select(four.w, four.z, which == 2u), four.y, which == 1u), four.x, which == 0u);
}

// Sorts the first elements of a list, up to GROUP of them. Returns the head of what is sorted, its last
// element, and the head of the rest.
fn sorted_group(list_head: u32) -> vec3<u32> {
    var ways: Ways;
    var stretch: vec3<u32>;
    var rest = list_head;
    var count: u32 = 0u;
    while (count < WAYS && rest != 0u) {
        stretch = sorted_stretch(rest);
        rest = stretch.z;
        if (count == 0u && rest == 0u) {
            return stretch;
        }
        link_to(stretch.y, 0u);
        set_way(&ways, count, stretch.x);
        count++;
    }
    // Ways that hold nothing.
    for (var four = 0u; four < 4u; four++) {
        let is_held = vec4<u32>(0u, 1u, 2u, 3u) + 4u * four < vec4<u32>(count);
        ways.depths[four] = select(vec4<f32>(NO_DEPTH), ways.depths[four], is_held);
    }
    var head: u32 = 0u;
    var tail: u32 = 0u;
    loop {
        let depths = min(min(ways.depths[0], ways.depths[1]), min(ways.depths[2], ways.depths[3]));
        let depth = min(min(depths.x, depths.y), min(depths.z, depths.w));
        // Of equal depths the one of the earliest stretch, so that the order is kept.
        var four = 3u;
        var own = ways.depths[3];
        var heads = ways.heads[3];
        var nexts = ways.nexts[3];
        if (any(ways.depths[0] == vec4<f32>(depth))) {
            four = 0u;
            own = ways.depths[0];
            heads = ways.heads[0];
            nexts = ways.nexts[0];
        } else if (any(ways.depths[1] == vec4<f32>(depth))) {
            four = 1u;
            own = ways.depths[1];
            heads = ways.heads[1];
            nexts = ways.nexts[1];
        } else if (any(ways.depths[2] == vec4<f32>(depth))) {
            four = 2u;
            own = ways.depths[2];
            heads = ways.heads[2];
            nexts = ways.nexts[2];
        }
        let which = first_with(own, depth);
        let taken = one_of(heads, which);
        if (taken == 0u) {
            break;
        }
        if (tail == 0u) {
            head = taken;
        } else {
            link_to(tail, taken);
        }
        tail = taken;
        set_way(&ways, 4u * four + which, one_of(nexts, which));
    }
    return vec3<u32>(head, tail, rest);
}

// Sorts a list, and returns its head.
fn sorted(list_head: u32) -> u32 {
    var head: u32 = 0u;
    var tail: u32 = 0u;
    var rest = list_head;
    var groups: u32 = 0u;
    while (rest != 0u) {
        let group = sorted_group(rest);
        if (tail == 0u) {
            head = group.x;
        } else {
            link_to(tail, group.x);
        }
        tail = group.y;
        rest = group.z;
        groups++;
    }
    if (tail != 0u) {
        link_to(tail, 0u);
    }
    if (groups < 2u) {
        return head;
    }
    return merged_groups(head);
}

// Sorts a list of sorted groups by merging groups of doubling length, and returns its head.
fn merged_groups(list_head: u32) -> u32 {
    var head = list_head;
    for (var stretch = GROUP;; stretch *= 2u) {
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
                right = next_of(right);
            }
            var right_count = stretch;
            while (left_count > 0u || (right_count > 0u && right != 0u)) {
                var take_left = right_count == 0u || right == 0u;
                if (!take_left && left_count > 0u) {
                    take_left = depth_of(left) <= depth_of(right);
                }
                var taken: u32;
                if (take_left) {
                    taken = left;
                    left = next_of(left);
                    left_count--;
                } else {
                    taken = right;
                    right = next_of(right);
                    right_count--;
                }
                if (tail == 0u) {
                    head = taken;
                } else {
                    link_to(tail, taken);
                }
                tail = taken;
            }
            left = right;
        }
        link_to(tail, 0u);
        if (merges <= 1u) {
            return head;
        }
    }
    return head;
}
