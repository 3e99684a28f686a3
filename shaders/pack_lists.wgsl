// Pass pack_lists: moves the lists of some rows of a map behind those of the rows before, without the
// room that they did not need. One workgroup per block of 8 x 8 texels, whose nodes stay interleaved:
// each of its texels gets room for the block's longest list.
#import kernel/fragments
#import kernel/tile

// The rows' lists.
@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
// The number of nodes that all blocks so far need; if it exceeds the tile's capacity, some are missing.
@group(0) @binding(11) var<storage, read_write> needed: array<atomic<u32>, 2>;
// The map's lists.
@group(0) @binding(39) var<storage, read_write> packed_runs: array<vec2<u32>>;
@group(0) @binding(40) var<storage, read_write> packed_nodes: array<vec2<f32>>;

var<workgroup> longest: atomic<u32>;
var<workgroup> before: u32;

@compute @workgroup_size(8, 8)
fn pack_lists(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    // All threads of a workgroup have to come to a barrier, also those beyond the tile.
    let is_texel = all(id.xy < tile.extent);
    var list = List(0u, 0u, 1u);
    if (is_texel) {
        list = list_of_run(runs[id.y * tile.extent.x + id.x]);
    }
    atomicMax(&longest, list.count);
    workgroupBarrier();
    let room = INTERLEAVED_STRIDE * atomicLoad(&longest);
    if (lane == 0u) {
        before = atomicAdd(&needed[0], room);
    }
    workgroupBarrier();
    if (!is_texel || before + room > tile.capacity) {
        return;
    }
    let first = before + lane;
    for (var i: u32 = 0u; i < list.count; i++) {
        packed_nodes[first + i * INTERLEAVED_STRIDE] = nodes[list.first + i * list.stride];
    }
    packed_runs[(tile.rows_before + id.y) * tile.extent.x + id.x] =
        vec2<u32>(first, list.count | INTERLEAVED);
}
