// Sorts lists of fragments.
#import kernel/lists
#import kernel/sorting

fn depth_of(element: u32) -> f32 {
    return elements[element - 1u].front;
}

fn next_of(element: u32) -> u32 {
    return elements[element - 1u].next;
}

fn link_to(element: u32, next: u32) {
    elements[element - 1u].next = next;
}
