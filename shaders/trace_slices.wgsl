// Pass trace_slices: every slab of a texel's ray, in order, into nodes: all of them, or as few as the
// tolerance allows, fitted while marching so that no raw list is ever written. One thread a texel.
#import kernel/fitting
#import kernel/fragments
#import kernel/occupancy
#import kernel/slices
#import kernel/tile

@group(0) @binding(5) var<storage, read_write> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> nodes: array<vec2<f32>>;
// The most nodes that a texel would have kept, if more than there was room for.
@group(0) @binding(11) var<storage, read_write> needed: array<atomic<u32>, 2>;

var<private> list: List;

fn keep_node(node: vec2<f32>) {
    if (list.count < tile.capacity) {
        nodes[list.first + list.count * list.stride] = node;
    }
    list.count++;
}

fn kept_node(k: u32) -> vec2<f32> {
    return nodes[list.first + k * list.stride];
}

fn add_slab(slabs: Slabs, i: u32, joined: u32, optical_depth: f32) {
    if (i < slabs.last && optical_depth > 0.0 && !fitter_is_dark()) {
        fitter_add(joined_bounds(slabs, i, joined), optical_depth);
    }
}

@compute @workgroup_size(8, 8)
fn trace_slices(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    // The nodes of a block of texels lie side by side: their first ones, their second ones, ...
    let block = group.y * groups.x + group.x;
    list = List(block * INTERLEAVED_STRIDE * tile.capacity + lane, 0u, INTERLEAVED_STRIDE);

    let at = (vec2<f32>(tile.origin + id.xy) + 0.5) / f32(frame.sizes.w);
    let slabs = slabs_of(at.x, at.y);
    fitter_start(frame.slices.z);
    var walk = walk_of(slabs.ray, slabs.start, slabs.step, frame.lengths.y);
    var next = slabs.first;
    while (!fitter_is_dark()) {
        let i = next_step(&walk, next, slabs.last);
        if (i >= slabs.last) {
            break;
        }
        let joined = walk.joined;
        next = i + BATCH * joined;
        let optical_depths = four_optical_depths(slabs, i, joined);
        // Written out: reading a vector at a place that is not constant costs a fifth of the pass.
        add_slab(slabs, i, joined, optical_depths.x);
        add_slab(slabs, i + joined, joined, optical_depths.y);
        add_slab(slabs, i + 2u * joined, joined, optical_depths.z);
        add_slab(slabs, i + 3u * joined, joined, optical_depths.w);
    }
    fitter_finish();

    if (list.count > tile.capacity) {
        atomicMax(&needed[0], list.count);
        list.count = tile.capacity;
    } else if (frame.slices.z == 0.0 && list.count > 0u) {
        let kept = truncated(list.count, frame.slices.w);
        if (kept < list.count) {
            nodes[list.first + kept * list.stride] = kept_node(list.count - 1u);
            list.count = kept + 1u;
        }
    }
    runs[id.y * tile.extent.x + id.x] = vec2<u32>(list.first, list.count | INTERLEAVED);
}
