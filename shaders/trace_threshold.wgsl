// Pass trace_threshold: marches from the light through every texel of the map, and writes the
// texel's four numbers and the curve that they define. One thread per texel.
#import kernel/curves
#import kernel/light
#import kernel/occupancy
#import kernel/ray
#import kernel/threshold
#import media

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;

// A light ray in the space that media are sampled in.
struct LightRay {
    ray: Ray,
    enter: f32,
    exit: f32,
    // World lengths of steps: the shortest, that where the media change most, and the longest.
    lengths: vec3<f32>,
}

// Checkpoints: the distances where some of the ray's batches end, and the optical depth there. They
// tell where a threshold is crossed without marching the whole ray again. They are kept in the
// buffers that the texel's curve is written to later, two in each cubic and the last one in the
// ends. (Workgroup memory would take space from the cache of the volume's texture, which costs
// more.)
const CHECKPOINTS: u32 = 8u;

fn checkpoint(texel: u32, k: u32) -> vec2<f32> {
    if (k == CHECKPOINTS) {
        return piece_ends[texel].xy;
    }
    let pair = cubics[k / 2u * frame.map.size * frame.map.size + texel];
    return select(pair.xy, pair.zw, k % 2u == 1u);
}

fn set_checkpoint(texel: u32, k: u32, reached: vec2<f32>) {
    if (k == CHECKPOINTS) {
        piece_ends[texel] = vec4<f32>(reached, 0.0, 0.0);
        return;
    }
    let at = k / 2u * frame.map.size * frame.map.size + texel;
    if (k % 2u == 0u) {
        cubics[at] = vec4<f32>(reached, 0.0, 0.0);
    } else {
        cubics[at].z = reached.x;
        cubics[at].w = reached.y;
    }
}

// Optical depths of four steps from t on; their four samples are fetched at once.
fn depths_of(ray: Ray, t: f32, step: f32) -> vec4<f32> {
    let at = t + (vec4<f32>(0.0, 1.0, 2.0, 3.0) + 0.5) * step;
    let densities = four_along(ray, at, vec4<f32>(0.5 * step));
    return densities * (frame.media.extinction * step);
}

// Four steps from t on.
struct FourSteps {
    // Length of each.
    step: f32,
    taus: vec4<f32>,
}

// Four steps from t on, with optical depth tau in front of them: as long as the walk allows, or
// shorter where the medium is dense. They depend on t and tau only, so that a second march takes
// the same steps.
fn four_steps(ray: Ray, walk: Walk, t: f32, tau: f32) -> FourSteps {
    var step = step_from(walk, t);
    var taus: vec4<f32>;
    loop {
        taus = depths_of(ray, t, step);
        var end = taus.w;
        if (hides(walk, step)) {
            end = density_along(ray, t + BATCH * step, 0.5 * step) * (frame.media.extinction * step);
        }
        let shorter = cut_to_bend(walk, step, taus, end, frame.map.rays.limit, tau);
        if (shorter >= step) {
            break;
        }
        step = shorter;
    }
    return FourSteps(step, taus);
}

// Marches the ray and fills the checkpoints, the last of which is the end of all steps. Returns
// their number.
fn march(light: LightRay, texel: u32) -> u32 {
    var walk = walk_of(light.ray, light.exit, light.lengths);
    var t = next_place(&walk, light.enter);
    var tau: f32 = 0.0;
    var end = t;
    var count: u32 = 0u;
    // The number of batches between two checkpoints, and of those since the last one.
    var stride: u32 = 1u;
    var since: u32 = 0u;
    while (t < light.exit && tau < LARGEST_OPTICAL_DEPTH) {
        let steps = four_steps(light.ray, walk, t, tau);
        let step = steps.step;
        let taus = steps.taus;
        tau = (((tau + taus.x) + taus.y) + taus.z) + taus.w;
        end = t + BATCH * step;
        since++;
        if (since == stride && count == CHECKPOINTS) {
            // Drops every other checkpoint to make room.
            count = CHECKPOINTS / 2u;
            stride *= 2u;
            for (var k: u32 = 0u; k < CHECKPOINTS / 2u; k++) {
                set_checkpoint(texel, k, checkpoint(texel, 2u * k + 1u));
            }
        }
        if (since == stride) {
            since = 0u;
            set_checkpoint(texel, count, vec2<f32>(end, tau));
            count++;
        }
        t = next_place(&walk, end);
    }
    if (since > 0u) {
        set_checkpoint(texel, count, vec2<f32>(end, tau));
        count++;
    }
    return count;
}

// How many of the first `count` checkpoints lie in front of an optical depth. All are read at once.
fn checkpoints_before(texel: u32, count: u32, wanted: f32) -> u32 {
    let row = frame.map.size * frame.map.size;
    let a = cubics[texel];
    let b = cubics[row + texel];
    let c = cubics[2u * row + texel];
    let d = cubics[3u * row + texel];
    let last = piece_ends[texel];
    let near = (vec4<f32>(a.yw, b.yw) < vec4<f32>(wanted)) & (vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(count));
    let far = (vec4<f32>(c.yw, d.yw) < vec4<f32>(wanted)) & (vec4<u32>(4u, 5u, 6u, 7u) < vec4<u32>(count));
    let sums = select(vec4<u32>(0u), vec4<u32>(1u), near) + select(vec4<u32>(0u), vec4<u32>(1u), far);
    let beyond = count > CHECKPOINTS && last.y < wanted;
    return sums.x + sums.y + sums.z + sums.w + select(0u, 1u, beyond);
}

// The depth where an optical depth is reached, or the ray's exit if it is not.
fn depth_of(light: LightRay, texel: u32, count: u32, wanted: f32) -> f32 {
    let k = checkpoints_before(texel, count, wanted);
    if (k == count) {
        return light.exit;
    }
    let last = checkpoint(texel, k).x;
    var t = light.enter;
    var before: f32 = 0.0;
    if (k > 0u) {
        let reached = checkpoint(texel, k - 1u);
        t = reached.x;
        before = reached.y;
    }
    var walk = walk_of(light.ray, light.exit, light.lengths);
    while (t < last) {
        t = next_place(&walk, t);
        let steps = four_steps(light.ray, walk, t, before);
        let step = steps.step;
        let taus = steps.taus;
        let a = before + taus.x;
        let b = a + taus.y;
        let c = b + taus.z;
        let d = c + taus.w;
        if (wanted <= d) {
            // x: the step; y and z: optical depths at its ends; w: how much more the next step
            // holds.
            var found = vec4<f32>(0.0, before, a, taus.y - taus.x);
            if (wanted > c) {
                found = vec4<f32>(3.0, c, d, taus.w - taus.z);
            } else if (wanted > b) {
                found = vec4<f32>(2.0, b, c, 0.5 * (taus.w - taus.y));
            } else if (wanted > a) {
                found = vec4<f32>(1.0, a, b, 0.5 * (taus.z - taus.x));
            }
            let ends = t + vec2<f32>(found.x, found.x + 1.0) * step;
            return crossing_depth(frame.map.crossing, ends, wanted, found.yz, found.w);
        }
        before = d;
        t += BATCH * step;
    }
    // Only rounding kept the sum below the wanted optical depth.
    return last;
}

fn trace_texel(u: f32, v: f32, texel: u32) -> vec4<f32> {
    let ray = index_ray_of(light_ray(u, v));
    let inside = intersect_box(ray, frame.media.domain_min, frame.media.domain_max);
    if (inside.y <= inside.x) {
        return vec4<f32>(0.0);
    }
    let extent = inside.y - inside.x;
    let voxel_lengths = voxels_over(ray, extent, extent);
    let count = step_count(voxel_lengths, frame.map.rays.per_voxel, frame.map.rays.least, frame.map.rays.most);
    let lengths = vec3<f32>(extent / f32(count), frame.map.rays.rough, frame.map.rays.longest);
    let light = LightRay(media_ray_of(ray), inside.x, inside.y, lengths);

    let kept = march(light, texel);
    var total: f32 = 0.0;
    if (kept > 0u) {
        total = checkpoint(texel, kept - 1u).y;
    }
    let largest = 1.0 - exp(-total);
    if (largest <= 0.0) {
        return vec4<f32>(vec3<f32>(inside.y), largest);
    }
    var wanted = frame.map.threshold_depths;
    // With the default lookup, channels whose threshold is not reached hold the depths of shares of
    // the largest opacity.
    if (frame.map.lookup == 0u && largest < frame.map.thresholds.z) {
        wanted = -log(1.0 - levels(largest, frame.map.thresholds));
    }
    var depths = vec3<f32>(0.0);
    for (var k: u32 = 0u; k < 3u; k++) {
        depths = vec3<f32>(depths.yz, depth_of(light, texel, kept, wanted.x));
        wanted = wanted.yzx;
    }
    return vec4<f32>(depths, largest);
}

@compute @workgroup_size(8, 8)
fn trace_threshold(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = frame.map.size;
    if (id.x >= size || id.y >= size) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / f32(size);
    let texel = trace_texel(at.x, at.y, id.y * size + id.x);
    textureStore(output, id.xy, texel);
    keep_curve(id.xy, curve(texel, light_extent(at.x, at.y)));
}
