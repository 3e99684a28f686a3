// Pass link_neighbors: links each node of a texel to the depth-nearest nodes of the texels to the
// right and above. One thread per texel. (Real-time deep shadow maps for hair, "Neighbor Linking".)
#import kernel/fragments
#import kernel/tile

@group(0) @binding(5) var<storage, read> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> nodes: array<vec2<f32>>;
@group(0) @binding(7) var<storage, read_write> links: array<u32>;

fn depth_of(list: List, k: u32) -> f32 {
    return nodes[list.first + k * list.stride].x;
}

// Index of the node of a neighbour's list that is nearest to a depth, searched from `start` on. Of
// two equally near nodes it is the one nearer to the light. Both lists rise in depth, so `start`
// never moves back and one pass over both lists is enough.
fn nearest(neighbor: List, start: u32, depth: f32) -> u32 {
    var at = start;
    while (at + 1u < neighbor.count) {
        let next = depth_of(neighbor, at + 1u);
        if (abs(next - depth) >= abs(depth_of(neighbor, at) - depth) && next > depth) {
            break;
        }
        at++;
    }
    return at;
}

@compute @workgroup_size(8, 8)
fn link_neighbors(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    let texel = id.y * tile.extent.x + id.x;
    let list = list_of_run(runs[texel]);
    let none = List(0u, 0u, 1u);
    var right = none;
    if (id.x + 1u < tile.extent.x) {
        right = list_of_run(runs[texel + 1u]);
    }
    var upper = none;
    if (id.y > 0u) {
        upper = list_of_run(runs[texel - tile.extent.x]);
    }
    var to_right: u32 = 0u;
    var to_upper: u32 = 0u;
    for (var i: u32 = 0u; i < list.count; i++) {
        let depth = depth_of(list, i);
        to_right = nearest(right, to_right, depth);
        to_upper = nearest(upper, to_upper, depth);
        let link = packed_link(right, to_right) | (packed_link(upper, to_upper) << 16u);
        links[list.first + i * list.stride] = link;
    }
}
