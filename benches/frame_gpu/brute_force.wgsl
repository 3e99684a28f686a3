// The brute-force frame: a threshold map and a camera march with 512 equal steps on every ray that
// hits the volume's box, and one trilinear fetch per step. There is neither empty-space skipping
// nor early ray termination. It shares no code with what it is compared with, except the uniform
// `frame`: shaders/kernel/frame.wgsl is put in front of it. Parallel light, one ray per pixel, no
// ground. What is constant along a ray is computed before its loop.

@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var trilinear: sampler;
@group(0) @binding(3) var shadow_map: texture_2d<f32>;
@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;

const STEPS: u32 = 512u;
const FOUR_PI: f32 = 12.566370614359172;

// The steps of a ray: distances along it, and the texture coordinates that they sample.
struct March {
    // Distance where the ray enters the box, and the length of a step, which is 0 if the ray
    // misses.
    enter: f32,
    step: f32,
    // Optical depth of a step where the texture value is 1.
    extinction: f32,
    // Texture coordinates at distance `enter`, and their change per step.
    first: vec3<f32>,
    stride: vec3<f32>,
}

fn in_index(p: vec4<f32>) -> vec3<f32> {
    let rows = frame.media.index_from_frame;
    return vec3<f32>(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
}

fn march_of(origin: vec3<f32>, direction: vec3<f32>) -> March {
    let o = in_index(vec4<f32>(origin, 1.0));
    let d = in_index(vec4<f32>(direction, 0.0));
    let tiny = vec3<f32>(1e-30);
    let divisor = select(d, tiny, abs(d) < tiny);
    let a = (frame.media.domain_min - o) / divisor;
    let b = (frame.media.domain_max - o) / divisor;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, max(near.y, near.z)), 0.0);
    let step = max(min(far.x, min(far.y, far.z)) - enter, 0.0) / f32(STEPS);
    return March(
        enter,
        step,
        frame.media.extinction * frame.media.stored_one * step,
        (o + enter * d + 0.5) * frame.media.voxel_share,
        step * d * frame.media.voxel_share,
    );
}

// Writes the three depths where opacity passes the thresholds, and the opacity of the whole ray.
@compute @workgroup_size(8, 8)
fn brute_force_map(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = frame.map.size;
    if (id.x >= size || id.y >= size) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / f32(size);
    let origin = frame.light.origin + at.x * frame.light.origin_u + at.y * frame.light.origin_v;
    let direction = normalize(frame.light.direction.xyz);
    let march = march_of(origin.xyz, direction);
    if (march.step <= 0.0) {
        textureStore(output, id.xy, vec4<f32>(0.0));
        return;
    }
    let thresholds = frame.map.thresholds;
    var depths = vec3<f32>(march.enter + f32(STEPS) * march.step);
    var opacity: f32 = 0.0;
    for (var i: u32 = 0u; i < STEPS; i++) {
        let k = f32(i) + 0.5;
        let value = textureSampleLevel(voxels, trilinear, march.first + k * march.stride, 0.0).x;
        let before = opacity;
        opacity += (1.0 - opacity) * (1.0 - exp(-march.extinction * value));
        let passed = (vec3<f32>(before) < thresholds) & (thresholds <= vec3<f32>(opacity));
        depths = select(depths, vec3<f32>(march.enter + k * march.step), passed);
    }
    textureStore(output, id.xy, vec4<f32>(depths, opacity));
}

fn smooth_step(a: f32, b: f32, x: f32) -> f32 {
    let t = clamp((x - a) / max(b - a, 1e-30), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// The paper's reconstruction from a texel's four numbers.
fn transmittance(texel: vec4<f32>, depth: f32) -> f32 {
    let t = frame.map.thresholds;
    var opacity = texel.w;
    if (depth < texel.x) {
        opacity = 0.0;
    } else if (texel.w >= t.y && depth < texel.y) {
        opacity = t.x + (t.y - t.x) * smooth_step(texel.x, texel.y, depth);
    } else if (texel.w >= t.z && depth < texel.z) {
        opacity = t.y + (t.z - t.y) * smooth_step(texel.y, texel.z, depth);
    }
    return 1.0 - opacity;
}

// (column, row, depth) in the map of a point or a direction.
fn in_map(p: vec4<f32>) -> vec3<f32> {
    let rows = frame.light.from_frame;
    let size = f32(frame.map.size);
    return vec3<f32>(size * dot(rows[0], p), size * dot(rows[1], p), dot(rows[2], p));
}

// The phase function: share of light scattered per steradian (Henyey and Greenstein 1941).
fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (FOUR_PI * spread * sqrt(spread));
}

// Single scattering along a camera ray, lit through the nearest texel of the map.
@compute @workgroup_size(8, 8)
fn brute_force_view(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<u32>(frame.view.width, frame.view.height);
    if (id.x >= size.x || id.y >= size.y) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(size);
    let origin = frame.view.origin + at.x * frame.view.origin_x + at.y * frame.view.origin_y;
    let way = frame.view.direction + at.x * frame.view.direction_x + at.y * frame.view.direction_y;
    let direction = normalize(way.xyz);
    let march = march_of(origin.xyz, direction);
    if (march.step <= 0.0) {
        textureStore(output, id.xy, frame.view.background);
        return;
    }
    let first = in_map(vec4<f32>(origin.xyz + march.enter * direction, 1.0));
    let stride = march.step * in_map(vec4<f32>(direction, 0.0));
    let last = vec2<f32>(f32(frame.map.size - 1u));
    // Light scattered by the medium, as if only the sun lit it, with its shadow.
    var lit: f32 = 0.0;
    var through: f32 = 1.0;
    for (var i: u32 = 0u; i < STEPS; i++) {
        let k = f32(i) + 0.5;
        let value = textureSampleLevel(voxels, trilinear, march.first + k * march.stride, 0.0).x;
        let weight = through * (1.0 - exp(-march.extinction * value));
        let place = first + k * stride;
        let texel = vec2<u32>(clamp(place.xy, vec2<f32>(0.0), last));
        lit += weight * transmittance(textureLoad(shadow_map, texel, 0), place.z);
        through -= weight;
    }
    let scattered = phase(frame.media.phase_g, -dot(direction, frame.light.direction.xyz)) * lit;
    let opacity = 1.0 - through;
    let light = frame.light.irradiance * scattered + frame.view.ambient * opacity;
    let radiance = frame.media.albedo * light;
    textureStore(output, id.xy, vec4<f32>(radiance, opacity) + through * frame.view.background);
}
