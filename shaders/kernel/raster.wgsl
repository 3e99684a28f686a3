// Draws surfaces into the texels of a tile: with one thread for each, or with many for those over
// many texels. A root that imports this imports kernel/casting or kernel/seeing as well.
#import kernel/surfaces

// The surfaces that one thread would take too long for.
@group(0) @binding(35) var<storage, read_write> large: array<u32>;

// The most texels that one thread goes through.
const MOST_TEXELS: u32 = 512u;

// The texels that a workgroup's surfaces touch: all of them have a place in the buffer, with one
// access to the counter.
var<workgroup> touched_by_all: atomic<u32>;
var<workgroup> first_place: u32;

// Draws surface `index`; `lane` is the thread's number in its workgroup of 64.
fn raster_one(index: u32, lane: u32) {
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
            let left = left_in(drawn, texel);
            if (left.exists) {
                leave(at, texel, drawn, left);
            }
            at++;
        }
    }
}

// Draws a share of the large surfaces. The workgroups of a row share the rows of texels that a surface
// touches, and the 64 threads of a workgroup the columns.
fn raster_shared(group: vec3<u32>, groups: vec3<u32>, lane: u32) {
    let count = atomicLoad(&counters[2]);
    for (var i = group.y; i < count; i += groups.y) {
        let drawn = drawn_of(large[i]);
        let rows = rows_of(drawn.sides);
        var touched = 0u;
        for (var y = rows.x + group.x; y < rows.y; y += groups.x) {
            let columns = columns_of(drawn.sides, y);
            touched += columns.y - columns.x;
            for (var x = columns.x + lane; x < columns.y; x += 64u) {
                let texel = vec2<u32>(x, y);
                let left = left_in(drawn, texel);
                if (left.exists) {
                    leave(atomicAdd(&counters[0], 1u), texel, drawn, left);
                }
            }
        }
        if (lane == 0u) {
            atomicAdd(&counters[3], (touched + 255u) / 256u);
        }
    }
}
