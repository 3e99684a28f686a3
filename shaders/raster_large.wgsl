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
            let columns = columns_of(drawn.sides, y);
            if (lane == 0u) {
                atomicAdd(&counters[3], (columns.y - columns.x + 255u) / 256u);
            }
            for (var x = columns.x + lane; x < columns.y; x += 64u) {
                let texel = vec2<u32>(x, y);
                let left = left_in(drawn, large[i], texel);
                if (left.z > 0.0) {
                    push_fragment(in_tile(texel), left.xy, left.z);
                }
            }
        }
    }
}
