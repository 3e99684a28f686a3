// Pass march_view: from the camera through the volume, each step lit through the shadow map, and on
// to the ground or the background. One thread a pixel.
#import kernel/light
#import kernel/medium
#import kernel/occupancy
#import kernel/ray
#import kernel/shadow
#import kernel/view
#import media

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;

// The part of a camera ray in the volume, cut into steps.
struct Steps {
    index_ray: Ray,
    enter: f32,
    step: f32,
    count: u32,
}

fn steps_of(ray: Ray, farthest: f32) -> Steps {
    let index_ray = index_ray_of(ray);
    let inside = intersect_box(index_ray, frame.domain_min.xyz, frame.domain_max.xyz);
    let extent = min(inside.y, farthest) - inside.x;
    if (extent <= 0.0) {
        return Steps(index_ray, inside.x, 0.0, 0u);
    }
    let voxel_lengths = extent * length(index_ray.direction);
    let count = step_count(voxel_lengths, frame.rates.z, frame.steps.z, frame.steps.w);
    return Steps(index_ray, inside.x, extent / f32(count), count);
}

// Two steps of equal length of a ray in index space.
struct Pair {
    ray: Ray,
    begin: f32,
    step: f32,
    // How many of the two there are.
    count: u32,
}

// Optical depths of their four samples.
fn four_samples(pair: Pair) -> vec4<f32> {
    let extinction_half = frame.domain_min.w * (0.5 * pair.step);
    let at = four_distances(pair);
    let quarter = 0.25 * pair.step;
    let first = vec2<f32>(
        density_along(pair.ray, at.x, quarter),
        density_along(pair.ray, at.y, quarter),
    );
    let second = vec2<f32>(
        density_along(pair.ray, at.z, quarter),
        density_along(pair.ray, at.w, quarter),
    );
    return extinction_half
        * vec4<f32>(
            select(vec2<f32>(0.0), first, pair.count > 0u),
            select(vec2<f32>(0.0), second, pair.count > 1u),
        );
}

fn four_distances(pair: Pair) -> vec4<f32> {
    return pair.begin + vec4<f32>(0.25, 0.75, 1.25, 1.75) * pair.step;
}

// Radiance that reaches the camera of what four samples emit, each behind half of itself; `through` is
// the transmittance in front of the first.
fn emitted(pair: Pair, taus: vec4<f32>, through: f32) -> vec3<f32> {
    let at = four_distances(pair);
    let reach = 0.25 * pair.step;
    var sum = vec3<f32>(0.0);
    var before = through;
    for (var k: u32 = 0u; k < 2u * pair.count; k++) {
        let seen = before * exp(-0.5 * taus[k]) * 2.0 * reach;
        sum += emission_along(pair.ray, at[k], reach) * seen;
        before *= exp(-taus[k]);
    }
    return sum;
}

// Radiance scattered towards the camera, and the transmittance of the whole ray. A step takes two
// samples of density; a step, or two that add little, take one of the light, in the middle of what they
// hold. Eight samples of density are under way at once.
fn single_scattering(ray: Ray, steps: Steps) -> vec4<f32> {
    let parallel = frame.light_position.w == 0.0;
    let emits = frame.counts.w == 1u;
    var arrives = arriving(ray, ray.origin);
    var light = vec3<f32>(0.0);
    var through: f32 = 1.0;
    var walk = walk_of(steps.index_ray, steps.enter, steps.step, frame.lengths.z);
    var next: u32 = 0u;
    loop {
        let i = next_step(&walk, next, steps.count);
        if (i >= steps.count) {
            break;
        }
        let left = steps.count - i;
        let joined = max(min(walk.joined, left / BATCH), 1u);
        next = i + BATCH * joined;
        let begin = steps.enter + f32(i) * steps.step;
        let step = f32(joined) * steps.step;
        let near = Pair(steps.index_ray, begin, step, min(left, 2u));
        let far = Pair(steps.index_ray, begin + 2.0 * step, step, min(max(left, 2u) - 2u, 2u));
        let early = four_samples(near);
        let late = four_samples(far);
        for (var j: u32 = 0u; j < 2u; j++) {
            let taus = select(early, late, j == 1u);
            var pair = near;
            if (j == 1u) {
                pair = far;
            }
            let added = scattered(through, taus, four_distances(pair));
            for (var k: u32 = 0u; k < 2u; k++) {
                let weight = select(added.weights.x, added.weights.y, k == 1u);
                if (weight <= 0.0) {
                    continue;
                }
                let at = select(added.places.x, added.places.y, k == 1u);
                let point = ray_at(ray, at);
                if (!parallel) {
                    arrives = arriving(ray, point);
                }
                let transmittance = shadow_lookup(light_coordinates(point));
                let reach = select(step, 0.5 * step, added.weights.y > 0.0);
                light += weight
                    * source_along(steps.index_ray, at, reach, arrives, transmittance);
            }
            if (MIXED && emits) {
                light += emitted(pair, taus, through);
            }
            through = added.through;
            if (through < OPAQUE_TRANSMITTANCE) {
                return vec4<f32>(light, 0.0);
            }
        }
    }
    return vec4<f32>(light, through);
}

// The paper's shading: unshadowed accumulation of the sampled value, darkened by the plain average
// of the opacities looked up at equal distances along the ray.
fn paper_shading(ray: Ray, steps: Steps) -> vec4<f32> {
    let extinction_step = frame.domain_min.w * steps.step;
    let brightest = max(frame.domain_max.w, 1e-30);
    var colour: f32 = 0.0;
    var through: f32 = 1.0;
    for (var i: u32 = 0u; i < steps.count; i++) {
        let t = steps.enter + (f32(i) + 0.5) * steps.step;
        let density = density_along(steps.index_ray, t, 0.5 * steps.step);
        let opacity = step_opacity(density * extinction_step);
        colour += through * opacity * (density / brightest);
        through *= 1.0 - opacity;
    }
    if (steps.count == 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let lookups = frame.counts.x;
    let extent = steps.step * f32(steps.count);
    var shadow: f32 = 0.0;
    for (var i: u32 = 0u; i < lookups; i++) {
        let t = steps.enter + (f32(i) + 0.5) / f32(lookups) * extent;
        shadow += 1.0 - shadow_lookup(light_coordinates(ray_at(ray, t)));
    }
    return vec4<f32>(vec3<f32>(colour * (1.0 - shadow / f32(lookups))), through);
}

fn march(ray: Ray) -> vec4<f32> {
    let ground = ground_distance(ray);
    let steps = steps_of(ray, select(1e30, ground, ground > 0.0));
    var seen: vec4<f32>;
    if (!USUAL && frame.methods.w == 1u) {
        seen = paper_shading(ray, steps);
    } else {
        seen = single_scattering(ray, steps);
    }
    var behind = frame.background;
    if (ground > 0.0) {
        let point = ray_at(ray, ground);
        let light = light_coordinates(point);
        let transmittance = shadow_lookup(vec3<f32>(light.xy, surface_depth(light)));
        behind = vec4<f32>(ground_radiance(point, transmittance), 1.0);
    }
    return vec4<f32>(seen.xyz, 1.0 - seen.w) + seen.w * behind;
}

@compute @workgroup_size(8, 8)
fn march_view(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = frame.sizes.xy;
    if (id.x >= size.x || id.y >= size.y) {
        return;
    }
    let samples = frame.sizes.z;
    var sum = vec4<f32>(0.0);
    for (var i: u32 = 0u; i < samples; i++) {
        let at = (vec2<f32>(id.xy) + pixel_offset(i, samples)) / vec2<f32>(size);
        sum += march(camera_ray(at.x, at.y));
    }
    textureStore(output, id.xy, sum / f32(samples));
}
