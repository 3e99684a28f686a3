// Pass sort_view: sorts the strands in each pixel by distance. One thread per pixel; lists may have
// any length.
#import kernel/seen
#import kernel/sorting

fn depth_of(element: u32) -> f32 {
    return seen[element - 1u].depth;
}

fn next_of(element: u32) -> u32 {
    return seen[element - 1u].next;
}

fn link_to(element: u32, next: u32) {
    seen[element - 1u].next = next;
}

@compute @workgroup_size(8, 8)
fn sort_view(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let list = 2u * (id.y * tile.extent.x + id.x);
    atomicStore(&heads[list], sorted(atomicLoad(&heads[list])));
}
