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

// Sorts a list, and returns its head.
fn sorted(list_head: u32) -> u32 {
    if (list_head == 0u) {
        return 0u;
    }
    let first = sorted_stretch(list_head);
    var tail = first.y;
    var rest = first.z;
    while (rest != 0u) {
        let more = sorted_stretch(rest);
        link_to(tail, more.x);
        tail = more.y;
        rest = more.z;
    }
    link_to(tail, 0u);
    if (first.z == 0u) {
        return first.x;
    }
    return merged_stretches(first.x);
}

// Sorts a list of sorted stretches by merging stretches of doubling length, and returns its head.
fn merged_stretches(list_head: u32) -> u32 {
    var head = list_head;
    for (var stretch = STRETCH;; stretch *= 2u) {
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
