// Pass code_nested: codes the list of each of a tile's texels in four words. One thread per texel.
#import kernel/fragments
#import kernel/light
#import kernel/nested_fit
#import kernel/tile

// The lists of the tile.
@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
// The code of each texel of the map, row by row, and the depths where its ray enters and leaves the
// media.
@group(0) @binding(41) var<storage, read_write> coded: array<vec4<u32>>;
@group(0) @binding(42) var<storage, read_write> extents: array<vec2<f32>>;

// Optical depths above this count as this.
const OPAQUE: f32 = 87.0;

// Node k of a list.
fn node_at(list: List, k: u32) -> vec2<f32> {
    let node = nodes[list.first + k * list.stride];
    return vec2<f32>(node.x, clamp(node.y, 0.0, OPAQUE));
}

// Takes the points of a list: at equal distances along its curve, where distance is half depth and
// half opacity. `extent` are the depths where the ray enters and leaves the media.
fn sample_list(list: List, extent: vec2<f32>, largest: f32) {
    let ends = vec2<f32>(node_at(list, 0u).x, node_at(list, list.count - 1u).x);
    let half = 0.5 * f32(COUNT - 1u);
    let way = vec2<f32>(half / max(ends.y - ends.x, SMALLEST), half / largest);
    let per_length = 1.0 / max(extent.y - extent.x, SMALLEST);
    // The nodes around a point, and how far along the curve they lie.
    var k: u32 = 0u;
    var a = node_at(list, 0u);
    var start = dot(way, vec2<f32>(a.x - ends.x, 1.0 - exp(-a.y)));
    var b = a;
    var end = start;
    for (var i: u32 = 0u; i < COUNT; i++) {
        while (k + 1u < list.count && (end <= f32(i) || k == 0u)) {
            k++;
            a = b;
            start = end;
            b = node_at(list, k);
            end = dot(way, vec2<f32>(b.x - ends.x, 1.0 - exp(-b.y)));
        }
        let part = clamp((f32(i) - start) / max(end - start, SMALLEST), 0.0, 1.0);
        let here = a + (b - a) * part;
        points[i] = vec3<f32>(
            unit((here.x - extent.x) * per_length),
            unit((1.0 - exp(-here.y)) / largest),
            0.0,
        );
    }
    let first = unit((ends.x - extent.x) * per_length);
    points[0] = vec3<f32>(first, 0.0, 0.0);
    points[COUNT - 1u] = vec3<f32>(max(unit((ends.y - extent.x) * per_length), first), 1.0, 0.0);
    weigh();
}

@compute @workgroup_size(8, 8)
fn code_nested(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let list = list_of_run(runs[id.y * tile.extent.x + id.x]);
    let texel = tile.origin + id.xy;
    let size = frame.map.size;
    let place = (vec2<f32>(texel) + 0.5) / f32(size);
    let extent = light_extent(place.x, place.y);
    var words = vec4<u32>(0u);
    if (list.count > 0u) {
        let largest = 1.0 - exp(-node_at(list, list.count - 1u).y);
        let code = u32(round(largest * 4095.0));
        if (code > 0u) {
            sample_list(list, extent, largest);
            words = words_of(code);
        }
    }
    let at = texel.y * size + texel.x;
    coded[at] = words;
    extents[at] = extent;
}
