// Pass raster_surfaces: pushes what strands and triangles leave in texels on the texels' lists. One
// thread for each segment and each triangle; those over many texels are left to pass raster_large.
#import kernel/surfaces

// The surfaces that are left to pass raster_large.
@group(0) @binding(35) var<storage, read_write> large: array<u32>;

// The most texels, in the rectangle around a surface, that one thread goes through.
const MOST_TEXELS: u32 = 256u;

@compute @workgroup_size(64)
fn raster_surfaces(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let index = id.y * groups.x * 64u + id.x;
    if (index >= tile.segments + tile.triangles) {
        return;
    }
    let drawn = drawn_of(index);
    if (!drawn.exists) {
        return;
    }
    let rows = rows_of(drawn.sides);
    let u = drawn.sides.u;
    let low = min(min(u.x, u.y), min(u.z, u.w));
    let high = max(max(u.x, u.y), max(u.z, u.w));
    let columns = texels_between(low, high, tile.origin.x, tile.origin.x + tile.extent.x);
    if ((rows.y - rows.x) * (columns.y - columns.x) > MOST_TEXELS) {
        large[atomicAdd(&counters[2], 1u)] = index;
        return;
    }
    for (var y = rows.x; y < rows.y; y++) {
        let touched = columns_of(drawn.sides, y);
        for (var x = touched.x; x < touched.y; x++) {
            leave(drawn, vec2<u32>(x, y));
        }
    }
}
