// Pass trace_slices: turns the slabs of each texel's ray and what surfaces leave on it, in order,
// into nodes: all of them, or as few as the tolerance allows. The fit runs while marching, so no raw
// list is ever written. One thread per texel.
#import kernel/fitting
#import kernel/fragments
#import kernel/occupancy
#import kernel/slices
#import kernel/tile
#import pieces

@group(0) @binding(5) var<storage, read_write> runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> nodes: array<vec2<f32>>;
// The largest number of nodes that a texel needed, if it exceeds the tile's capacity.
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

fn add_fragment(front: f32, back: f32, optical_depth: f32, of_medium: bool) {
    if (optical_depth > 0.0 && !fitter_is_dark()) {
        fitter_add_fragment(vec2<f32>(front, back), optical_depth, of_medium);
    }
}

@compute @workgroup_size(8, 4)
fn trace_slices(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= tile.extent)) {
        return;
    }
    // The nodes of a block of 8 x 8 texels are interleaved: all first nodes, then all second nodes,
    // and so on.
    let row = tile.rows_before + id.y;
    let block = row / 8u * ((tile.extent.x + 7u) / 8u) + id.x / 8u;
    let lane = row % 8u * 8u + id.x % 8u;
    list = List(block * INTERLEAVED_STRIDE * tile.capacity + lane, 0u, INTERLEAVED_STRIDE);

    let at = (vec2<f32>(tile.origin + id.xy) + 0.5) / f32(frame.map.size);
    let slabs = slabs_of(at.x, at.y);
    begin_pieces(id.y * tile.extent.x + id.x);
    fitter_start(frame.map.tolerance);
    let lengths = vec3<f32>(slabs.step, frame.map.slabs.rough, frame.map.slabs.longest);
    // The last slab between planes may be as thin as rounding allows.
    let thin = select(0.0, 2.0 * LEAST_SHARE, frame.map.planes > 0u);
    var walk = walk_of(slabs.ray, slabs.exit * (1.0 + thin), lengths);
    // Slabs between planes have a fixed length, so nothing is shortened there.
    let limit = select(frame.map.slabs.limit, 3e38, frame.map.planes > 0u);
    var t = next_place(&walk, slabs.enter);
    var next = f32(slabs.first);
    // The length to which steps that proved too long are shortened. They are repeated as iterations
    // of the same loop: with a loop of their own, all threads of a workgroup would wait for those
    // that repeat.
    var longest: f32 = 3e38;
    while (t < slabs.exit && !fitter_is_dark()) {
        let step = min(step_from(walk, t), longest);
        let batch = batch_of(slabs, t, step, next);
        let optical_depths = four_optical_depths(slabs, batch);
        var end = optical_depths.w;
        if (hides(walk, step)) {
            end = end_optical_depth(slabs, batch);
        }
        longest = cut_to_bend(walk, step, optical_depths, end, limit, fitter.last.y);
        if (longest < step) {
            continue;
        }
        longest = 3e38;
        next = batch.next;
        // Unrolled: reading a vector with a dynamic index costs a fifth of the pass's time.
        add_between(batch.fronts.x, batch.backs.x, optical_depths.x);
        add_between(batch.fronts.y, batch.backs.y, optical_depths.y);
        add_between(batch.fronts.z, batch.backs.z, optical_depths.z);
        add_between(batch.fronts.w, batch.backs.w, optical_depths.w);
        t = next_place(&walk, max(batch.end, t + LEAST_SHARE * slabs.exit));
    }
    add_rest();
    fitter_finish();

    if (list.count > tile.capacity) {
        atomicMax(&needed[0], list.count);
        list.count = tile.capacity;
    } else if (frame.map.tolerance == 0.0 && list.count > 0u) {
        let kept = truncated(list.count, frame.map.truncation);
        if (kept < list.count) {
            nodes[list.first + kept * list.stride] = kept_node(list.count - 1u);
            list.count = kept + 1u;
        }
    }
    runs[row * tile.extent.x + id.x] = vec2<u32>(list.first, list.count | INTERLEAVED);
}
