// Pass trace_threshold: from the light through every texel of the map. One thread a texel.
#import kernel/light
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

// Depths where three optical depths are reached, the ray's exit for those that are not, and the
// optical depth of the whole ray.
fn march(steps: LightSteps, targets: vec3<f32>) -> vec4<f32> {
    let extinction_step = frame.domain_min.w * steps.step;
    var depths = vec3<f32>(steps.exit);
    var tau: f32 = 0.0;
    for (var i: u32 = 0u; i < steps.count; i++) {
        let before = tau;
        let t = steps.enter + (f32(i) + 0.5) * steps.step;
        tau += density_along(steps.ray, t, 0.5 * steps.step) * extinction_step;
        let crossed = (vec3<f32>(before) < targets) & (targets <= vec3<f32>(tau));
        if (any(crossed)) {
            let z = steps.enter + vec2<f32>(f32(i), f32(i + 1u)) * steps.step;
            for (var k: u32 = 0u; k < 3u; k++) {
                if (crossed[k]) {
                    let ends = vec2<f32>(before, tau);
                    depths[k] = crossing_depth(frame.methods.x, z, targets[k], ends);
                }
            }
        }
    }
    return vec4<f32>(depths, tau);
}

fn trace_texel(u: f32, v: f32) -> vec4<f32> {
    let ray = index_ray_of(light_ray(u, v));
    let inside = intersect_box(ray, frame.domain_min.xyz, frame.domain_max.xyz);
    if (inside.y <= inside.x) {
        return vec4<f32>(0.0);
    }
    let extent = inside.y - inside.x;
    let voxel_lengths = extent * length(ray.direction);
    let count = step_count(voxel_lengths, LIGHT_STEPS_PER_VOXEL, frame.steps.x, frame.steps.y);
    let steps = LightSteps(ray, inside.x, inside.y, extent / f32(count), count);

    let marched = march(steps, frame.threshold_depths.xyz);
    let largest = 1.0 - exp(-marched.w);
    // Unset channels of the default lookup hold shares of the largest opacity, known only now.
    if (frame.methods.y == 0u && largest > 0.0 && largest < frame.thresholds.z) {
        let held = levels(largest, frame.thresholds.xyz);
        return vec4<f32>(march(steps, -log(1.0 - held)).xyz, largest);
    }
    return vec4<f32>(marched.xyz, largest);
}

@compute @workgroup_size(8, 8)
fn trace_threshold(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = frame.sizes.w;
    if (id.x >= size || id.y >= size) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / f32(size);
    textureStore(output, id.xy, trace_texel(at.x, at.y));
}
