// Pass raster_surfaces: pushes what strands and triangles leave in texels on the texels' lists. One
// thread for each segment and each triangle; those over many texels are left to pass raster_large.
#import kernel/surfaces

// The surfaces that are left to pass raster_large.
@group(0) @binding(35) var<storage, read_write> large: array<u32>;

// The most texels that one thread goes through.
const MOST_TEXELS: u32 = 256u;

// The texels that a workgroup's surfaces touch: all of them have a place in the buffer, with one
// access to the counter.
var<workgroup> touched_by_all: atomic<u32>;
var<workgroup> first_place: u32;

@compute @workgroup_size(64)
fn raster_surfaces(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = id.y * groups.x * 64u + id.x;
    var drawn: Drawn;
    if (index < tile.segments + tile.triangles) {
        drawn = drawn_of(index);
    }
    var rows = vec2<u32>(0u);
    var touched = 0u;
    if (drawn.exists) {
        rows = rows_of(drawn.sides);
        for (var y = rows.x; y < rows.y && touched <= MOST_TEXELS; y++) {
            let columns = columns_of(drawn.sides, y);
            // Rows count, too.
            touched += columns.y - columns.x + 1u;
        }
        if (touched > MOST_TEXELS) {
            large[atomicAdd(&counters[2], 1u)] = index;
            rows = vec2<u32>(0u);
            touched = 0u;
        }
    }
    var at = atomicAdd(&touched_by_all, touched - (rows.y - rows.x));
    workgroupBarrier();
    if (lane == 0u) {
        let all = atomicLoad(&touched_by_all);
        first_place = atomicAdd(&counters[0], all);
        atomicAdd(&counters[3], (all + 255u) / 256u);
    }
    workgroupBarrier();
    at += first_place;
    for (var y = rows.x; y < rows.y; y++) {
        let columns = columns_of(drawn.sides, y);
        for (var x = columns.x; x < columns.y; x++) {
            let texel = vec2<u32>(x, y);
            let left = left_in(drawn, index, texel);
            if (left.z > 0.0) {
                put_fragment(at, in_tile(texel), left.xy, left.z);
            }
            at++;
        }
    }
}
