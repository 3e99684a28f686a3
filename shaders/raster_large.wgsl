// Pass raster_large: does what pass raster_surfaces left, with many threads for each surface. The
// workgroups of a row share the rows of texels that a surface touches, and the threads of a workgroup
// the columns.
#import kernel/surfaces

@group(0) @binding(35) var<storage, read> large: array<u32>;

@compute @workgroup_size(64)
fn raster_large(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = atomicLoad(&counters[2]);
    for (var i = group.y; i < count; i += groups.y) {
        let drawn = drawn_of(large[i]);
        let rows = rows_of(drawn.sides);
        for (var y = rows.x + group.x; y < rows.y; y += groups.x) {
            let touched = columns_of(drawn.sides, y);
            for (var x = touched.x + lane; x < touched.y; x += 64u) {
                leave(drawn, vec2<u32>(x, y));
            }
        }
    }
}
