// Pass trace_threshold: from the light through every texel of the map, into its four numbers and the curve
// that they say. One thread a texel.
#import kernel/curves
#import kernel/light
#import kernel/occupancy
#import kernel/ray
#import kernel/threshold
#import media

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;

// A light ray cut into steps.
struct LightSteps {
    ray: Ray,
    enter: f32,
    exit: f32,
    step: f32,
    count: u32,
}

// A ray's optical depth behind equal parts of its steps. They tell where a threshold is crossed without
// marching the whole ray again.
// Each thread's own, side by side.
var<workgroup> checkpoints: array<array<f32, 64>, CHECKPOINTS>;

// Steps between two checkpoints: whole batches.
fn stride_of(steps: LightSteps) -> u32 {
    let most = BATCH * CHECKPOINTS;
    return BATCH * ((steps.count + most - 1u) / most);
}

// Optical depths of four steps from i on, each of `joined` ones, that end at `last`: four samples are under
// way at once.
fn four_steps(steps: LightSteps, i: u32, joined: u32, last: u32) -> vec4<f32> {
    let first = vec4<u32>(i) + joined * vec4<u32>(0u, 1u, 2u, 3u);
    let begin = vec4<f32>(min(first, vec4<u32>(last)));
    let end = vec4<f32>(min(first + joined, vec4<u32>(last)));
    let at = steps.enter + 0.5 * (begin + end) * steps.step;
    let half = 0.5 * (end - begin) * steps.step;
    let densities = vec4<f32>(
        density_along(steps.ray, at.x, half.x),
        density_along(steps.ray, at.y, half.y),
        density_along(steps.ray, at.z, half.z),
        density_along(steps.ray, at.w, half.w),
    );
    return densities * (end - begin) * (frame.domain_min.w * steps.step);
}

// Optical depth of the whole ray; fills the checkpoints.
fn march(steps: LightSteps, lane: u32) -> f32 {
    let stride = stride_of(steps);
    var walk = walk_of(steps.ray, steps.enter, steps.step, frame.lengths.x);
    var tau: f32 = 0.0;
    var next: u32 = 0u;
    for (var k: u32 = 0u; k < CHECKPOINTS; k++) {
        let last = min((k + 1u) * stride, steps.count);
        // Whatever was before: the same steps as when they are marched again.
        if (next < last) {
            walk.end = -3e38;
            next = max(next, k * stride);
        }
        while (next < last && tau < LARGEST_OPTICAL_DEPTH) {
            next = next_step(&walk, next, last);
            if (next >= last) {
                break;
            }
            let joined = walk.joined;
            let taus = four_steps(steps, next, joined, last);
            tau = (((tau + taus.x) + taus.y) + taus.z) + taus.w;
            next = min(next + BATCH * joined, last);
        }
        checkpoints[k][lane] = tau;
    }
    return tau;
}

// Depth where an optical depth is reached; the ray's exit where it is not.
fn depth_of(steps: LightSteps, lane: u32, wanted: f32) -> f32 {
    var k: u32 = 0u;
    while (k < CHECKPOINTS && checkpoints[k][lane] < wanted) {
        k++;
    }
    if (k == CHECKPOINTS) {
        return steps.exit;
    }
    let stride = stride_of(steps);
    let last = min((k + 1u) * stride, steps.count);
    var walk = walk_of(steps.ray, steps.enter, steps.step, frame.lengths.x);
    var before: f32 = 0.0;
    if (k > 0u) {
        before = checkpoints[k - 1u][lane];
    }
    var i = k * stride;
    loop {
        i = next_step(&walk, i, last);
        if (i >= last) {
            break;
        }
        let joined = walk.joined;
        let taus = four_steps(steps, i, joined, last);
        let a = before + taus.x;
        let b = a + taus.y;
        let c = b + taus.z;
        let d = c + taus.w;
        if (wanted <= d) {
            var found = vec3<f32>(0.0, before, a);
            if (wanted > c) {
                found = vec3<f32>(3.0, c, d);
            } else if (wanted > b) {
                found = vec3<f32>(2.0, b, c);
            } else if (wanted > a) {
                found = vec3<f32>(1.0, a, b);
            }
            let ends = f32(i) + f32(joined) * vec2<f32>(found.x, found.x + 1.0);
            let z = steps.enter + min(ends, vec2<f32>(f32(last))) * steps.step;
            return crossing_depth(frame.methods.x, z, wanted, found.yz);
        }
        before = d;
        i += BATCH * joined;
    }
    // Rounding alone kept the sum below it.
    return steps.enter + f32(last) * steps.step;
}

fn trace_texel(u: f32, v: f32, lane: u32) -> vec4<f32> {
    let ray = index_ray_of(light_ray(u, v));
    let inside = intersect_box(ray, frame.domain_min.xyz, frame.domain_max.xyz);
    if (inside.y <= inside.x) {
        return vec4<f32>(0.0);
    }
    let extent = inside.y - inside.x;
    let voxel_lengths = extent * length(ray.direction);
    let count = step_count(voxel_lengths, frame.rates.x, frame.steps.x, frame.steps.y);
    let steps = LightSteps(ray, inside.x, inside.y, extent / f32(count), count);

    let largest = 1.0 - exp(-march(steps, lane));
    if (largest <= 0.0) {
        return vec4<f32>(vec3<f32>(inside.y), largest);
    }
    var wanted = frame.threshold_depths.xyz;
    // Unset channels of the default lookup hold shares of the largest opacity.
    if (frame.methods.y == 0u && largest < frame.thresholds.z) {
        wanted = -log(1.0 - levels(largest, frame.thresholds.xyz));
    }
    return vec4<f32>(
        depth_of(steps, lane, wanted.x),
        depth_of(steps, lane, wanted.y),
        depth_of(steps, lane, wanted.z),
        largest,
    );
}

@compute @workgroup_size(8, 8)
fn trace_threshold(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let size = frame.sizes.w;
    if (id.x >= size || id.y >= size) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / f32(size);
    let texel = trace_texel(at.x, at.y, lane);
    textureStore(output, id.xy, texel);
    keep_curve(id.xy, curve(texel, light_extent(at.x, at.y)));
}
