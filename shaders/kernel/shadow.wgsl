// Transmittance from the light, read from a shadow map of one of the kinds in shaders/map/. Another
// program imports this to shade its own objects with `shadow_at(world position)`.
#import kernel/light
#import map

// Mean transmittance over a window of texels, from `low` to `high` inclusive; each texel is looked
// up by itself.
fn brute_force_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i <= high.y - low.y; i++) {
        for (var x = low.x; x <= high.x; x++) {
            sum += texel_transmittance(vec2<u32>(x, high.y - i), depth);
        }
    }
    let extent = vec2<f32>(high - low + 1u);
    return sum / (extent.x * extent.y);
}

// Bilinear weights of four texels: upper left, upper right, lower left, lower right.
fn four_weights(f: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(1.0 - f.x, f.x, 1.0 - f.x, f.x)
        * vec4<f32>(1.0 - f.y, 1.0 - f.y, f.y, f.y);
}

// Transmittances of four texels. Where their fronts belong to one surface, their shadows are first
// moved in depth to one common front.
fn four_aligned(low: vec2<u32>, high: vec2<u32>, weights: vec4<f32>, depth: f32) -> vec4<f32> {
    let upper_right = vec2<u32>(high.x, low.y);
    let lower_left = vec2<u32>(low.x, high.y);
    // (depth, 1) if the texel has a front.
    let a = front(low);
    let b = front(upper_right);
    let c = front(lower_left);
    let d = front(high);
    let fronts = vec4<f32>(a.x, b.x, c.x, d.x);
    let known = vec4<f32>(a.y, b.y, c.y, d.y);
    let mean = dot(weights * known, fronts) / max(dot(weights, known), 1e-30);
    let shifts = known * (fronts - mean);
    let far = abs(shifts);
    let farthest = max(max(far.x, far.y), max(far.z, far.w));
    let depths = depth + clamp(2.0 - farthest / frame.map.surface_reach, 0.0, 1.0) * shifts;
    return vec4<f32>(
        texel_transmittance(low, depths.x),
        texel_transmittance(upper_right, depths.y),
        texel_transmittance(lower_left, depths.z),
        texel_transmittance(high, depths.w),
    );
}

// Bilinear interpolation between four texels whose shadows are moved to one common front.
fn aligned(low: vec2<u32>, high: vec2<u32>, f: vec2<f32>, depth: f32) -> f32 {
    let weights = four_weights(f);
    return dot(weights, four_aligned(low, high, weights, depth));
}

// Transmittance at (u, v, depth); 1 outside of the map. Depending on the settings it is that of the
// nearest texel, the mean over a window, or bilinear between the transmittances of the four nearest
// texels.
fn shadow_lookup(light: vec3<f32>) -> f32 {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return 1.0;
    }
    let size = f32(frame.map.size);
    let last = frame.map.size - 1u;
    let width = frame.map.window;
    if (!USUAL && width != 0u) {
        let middle = min(vec2<u32>(light.xy * size), vec2<u32>(last));
        if (width == 1u) {
            return texel_transmittance(middle, light.z);
        }
        let reach = vec2<u32>(width / 2u);
        return window_mean(max(middle, reach) - reach, min(middle + reach, vec2<u32>(last)), light.z);
    }
    let place = clamp(light.xy * size - 0.5, vec2<f32>(0.0), vec2<f32>(f32(last)));
    let low = vec2<u32>(place);
    let high = min(low + 1u, vec2<u32>(last));
    let f = fract(place);
    if (!USUAL && frame.map.surface_reach > 0.0) {
        return aligned(low, high, f, light.z);
    }
    let four = four_transmittances(low, high, light.z);
    let rows = mix(four.xz, four.yw, f.x);
    return mix(rows.x, rows.y, f.y);
}

// Transmittances of the three channels at (u, v, depth), bilinear: those of each texel are raised to
// the channels' ratios first.
fn shadow_lookup_colours(light: vec3<f32>) -> vec3<f32> {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return vec3<f32>(1.0);
    }
    let last = frame.map.size - 1u;
    let place = clamp(light.xy * f32(frame.map.size) - 0.5, vec2<f32>(0.0), vec2<f32>(f32(last)));
    let low = vec2<u32>(place);
    let high = min(low + 1u, vec2<u32>(last));
    let weights = four_weights(fract(place));
    var four: vec4<f32>;
    if (!USUAL && frame.map.surface_reach > 0.0) {
        four = four_aligned(low, high, weights, light.z);
    } else {
        four = four_transmittances(low, high, light.z);
    }
    let kept = max(four, vec4<f32>(1e-30));
    return vec3<f32>(
        dot(weights, pow(kept, vec4<f32>(frame.media.ratios.x))),
        dot(weights, pow(kept, vec4<f32>(frame.media.ratios.y))),
        dot(weights, pow(kept, vec4<f32>(frame.media.ratios.z))),
    );
}

// The depth at which to look up the shadow of a point of a surface, which lies at (u, v, depth) in
// the map.
fn surface_depth(light: vec3<f32>) -> f32 {
    return light.z - frame.map.bias;
}

// Transmittance from the light to any world position: inside the volume, in front of it or behind
// it.
fn shadow_at(world: vec3<f32>) -> f32 {
    let light = light_coordinates(world * frame.view.per_world + frame.view.world_origin);
    return shadow_lookup(vec3<f32>(light.xy, surface_depth(light)));
}
