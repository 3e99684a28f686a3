// Pass march_view: from the camera through the volume, each step lit through the shadow map, and on
// to the ground or the background. One thread a pixel.
#import kernel/density
#import kernel/light
#import kernel/medium
#import kernel/ray
#import kernel/shadow
#import kernel/view

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
    let count = step_count(voxel_lengths, VIEW_STEPS_PER_VOXEL, frame.steps.z, frame.steps.w);
    return Steps(index_ray, inside.x, extent / f32(count), count);
}

// Unshadowed light that a point sends towards the camera, per unit of optical depth and albedo.
fn scattered_light(ray: Ray, point: vec3<f32>) -> vec3<f32> {
    let cosine = -dot(ray.direction, light_direction_at(point));
    return irradiance_at(point) * phase(frame.albedo.w, cosine);
}

// Radiance scattered towards the camera, and the transmittance of the whole ray. A step takes two
// samples of density and one of the light, in the middle of what it holds.
fn single_scattering(ray: Ray, steps: Steps) -> vec4<f32> {
    let extinction_half = frame.domain_min.w * (0.5 * steps.step);
    let parallel = frame.light_position.w == 0.0;
    var unshadowed = scattered_light(ray, ray.origin);
    var light = vec3<f32>(0.0);
    var through: f32 = 1.0;
    for (var i: u32 = 0u; i < steps.count; i++) {
        let begin = steps.enter + f32(i) * steps.step;
        let front = sample_density(ray_at(steps.index_ray, begin + 0.25 * steps.step));
        let back = sample_density(ray_at(steps.index_ray, begin + 0.75 * steps.step));
        let tau = (front + back) * extinction_half;
        if (tau <= 0.0) {
            continue;
        }
        let t = begin + steps.step * ((0.25 * front + 0.75 * back) / (front + back));
        let point = ray_at(ray, t);
        if (!parallel) {
            unshadowed = scattered_light(ray, point);
        }
        let lit = unshadowed * shadow_lookup(light_coordinates(point));
        let opacity = step_opacity(tau);
        light += through * opacity * frame.albedo.xyz * (lit + frame.ambient.xyz);
        through *= 1.0 - opacity;
        if (through < OPAQUE_TRANSMITTANCE) {
            return vec4<f32>(light, 0.0);
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
        let density = sample_density(ray_at(steps.index_ray, t));
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
    if (frame.methods.w == 1u) {
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
