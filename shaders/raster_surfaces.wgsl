// Pass raster_surfaces: pushes what strands and triangles leave in texels on the texels' lists. One
// thread for each segment and each triangle; those over many texels are left to pass raster_large.
#import kernel/casting
#import kernel/raster

@compute @workgroup_size(64)
fn raster_surfaces(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    raster_one(id.y * groups.x * 64u + id.x, lane);
}
