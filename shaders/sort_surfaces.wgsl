// Pass sort_surfaces: sorts each texel's linked list by depth, for pass trace_slices. One thread per
// texel; lists may have any length.
#import kernel/sorted_lists

@compute @workgroup_size(8, 8)
fn sort_surfaces(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let texel = id.y * tile.extent.x + id.x;
    atomicStore(&heads[texel], sorted(atomicLoad(&heads[texel])));
}
