// Pass raster_view_large: does what pass raster_view left, with many threads for each surface.
#import kernel/seeing
#import kernel/raster

@compute @workgroup_size(64)
fn raster_view_large(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    raster_shared(group, groups, lane);
}
