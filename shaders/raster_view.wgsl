// Pass raster_view: lists which surfaces the pixels of a picture see. The frame is that of the camera
// in the light's place. One thread for each segment and each triangle; those over many pixels are
// left to pass raster_view_large.
#import kernel/seeing
#import kernel/raster

@compute @workgroup_size(64)
fn raster_view(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    raster_one(id.y * groups.x * 64u + id.x, lane);
}
