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

// Four steps of equal length of a ray in index space, with two samples each.
struct Batch {
    ray: Ray,
    begin: f32,
    step: f32,
    // How many of the four there are.
    count: u32,
}

// Distance of sample k, 0 to 7; also of those between them.
fn sample_distance(batch: Batch, k: f32) -> f32 {
    return batch.begin + (0.25 + 0.5 * k) * batch.step;
}

// Optical depths of samples `first` to `first` + 3.
fn four_samples(batch: Batch, first: u32) -> vec4<f32> {
    let quarter = 0.25 * batch.step;
    let k = f32(first);
    let densities = vec4<f32>(
        density_along(batch.ray, sample_distance(batch, k), quarter),
        density_along(batch.ray, sample_distance(batch, k + 1.0), quarter),
        density_along(batch.ray, sample_distance(batch, k + 2.0), quarter),
        density_along(batch.ray, sample_distance(batch, k + 3.0), quarter),
    );
    let there = vec4<u32>(first) + vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(2u * batch.count);
    let extinction_half = frame.domain_min.w * (0.5 * batch.step);
    return select(vec4<f32>(0.0), densities, there) * extinction_half;
}

// Radiance that reaches the camera of what the samples emit, each behind half of itself; `before` is
// the transmittance in front of the first.
fn emitted(batch: Batch, early: vec4<f32>, late: vec4<f32>, before: f32) -> vec3<f32> {
    let reach = 0.25 * batch.step;
    var sum = vec3<f32>(0.0);
    var through = before;
    for (var k: u32 = 0u; k < 2u * batch.count; k++) {
        let tau = select(early[k & 3u], late[k & 3u], k > 3u);
        let seen = through * exp(-0.5 * tau) * 2.0 * reach;
        sum += emission_along(batch.ray, sample_distance(batch, f32(k)), reach) * seen;
        through *= exp(-tau);
    }
    return sum;
}

// Radiance scattered towards the camera, and the transmittance of the whole ray. A step takes two
// samples of density; a step, or several that add little, take one of the light, in the middle of what
// they hold. Eight samples of density are under way at once.
fn single_scattering(ray: Ray, steps: Steps) -> vec4<f32> {
    let parallel = frame.light_position.w == 0.0;
    let emits = frame.counts.w == 1u;
    var arrives = arriving(ray, ray.origin);
    var light = vec3<f32>(0.0);
    var through: f32 = 1.0;
    var walk = walk_of(steps.index_ray, steps.enter, steps.step, frame.lengths.z);
    var next: u32 = 0u;
    while (through >= OPAQUE_TRANSMITTANCE) {
        let i = next_step(&walk, next, steps.count);
        if (i >= steps.count) {
            return vec4<f32>(light, through);
        }
        let left = steps.count - i;
        let joined = max(min(walk.joined, left / BATCH), 1u);
        next = i + BATCH * joined;
        let begin = steps.enter + f32(i) * steps.step;
        let batch = Batch(steps.index_ray, begin, f32(joined) * steps.step, min(left, BATCH));
        let early = four_samples(batch, 0u);
        let late = four_samples(batch, 4u);
        let first = sample_distance(batch, 0.0);
        let added = scattered(through, early, late, first, 0.5 * batch.step);
        // Two lookups are under way at once. A step without weight has no place: it looks where the other does.
        for (var k: u32 = 0u; k < 2u; k++) {
            let weights = select(added.weights.xz, added.weights.yw, k == 1u);
            if (weights.x + weights.y <= 0.0) {
                continue;
            }
            let held = select(added.places.xz, added.places.yw, k == 1u);
            let places = select(held.yx, held, weights > vec2<f32>(0.0));
            let near = ray_at(ray, places.x);
            let far = ray_at(ray, places.y);
            let transmittances = vec2<f32>(
                shadow_lookup(light_coordinates(near)),
                shadow_lookup(light_coordinates(far)),
            );
            let reaches = 0.5 * batch.step * vec2<f32>(
                f32(shared_steps(added.weights, k)),
                f32(shared_steps(added.weights, k + 2u)),
            );
            if (!parallel) {
                arrives = arriving(ray, near);
            }
            light += weights.x
                * source_along(steps.index_ray, places.x, reaches.x, arrives, transmittances.x);
            if (!parallel) {
                arrives = arriving(ray, far);
            }
            light += weights.y
                * source_along(steps.index_ray, places.y, reaches.y, arrives, transmittances.y);
        }
        if (MIXED && emits) {
            light += emitted(batch, early, late, through);
        }
        through = added.through;
    }
    return vec4<f32>(light, 0.0);
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
