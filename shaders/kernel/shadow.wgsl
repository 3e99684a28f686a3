// Transmittance from the light, read from a shadow map of one of the kinds in shaders/map/. Another
// program imports this to shade its own objects with `shadow_at(world position)`.
#import kernel/light
#import map

// Four texels that are looked up at once.
struct Four {
    x: vec4<u32>,
    y: vec4<u32>,
    // How much each counts.
    weights: vec4<f32>,
}

// Bilinear weights of four texels: upper left, upper right, lower left, lower right.
fn four_weights(f: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(1.0 - f.x, f.x, 1.0 - f.x, f.x)
        * vec4<f32>(1.0 - f.y, 1.0 - f.y, f.y, f.y);
}

// The four texels around (u, v), with their bilinear weights.
fn four_texels(at: vec2<f32>) -> Four {
    let last = frame.map.size - 1u;
    let place = clamp(at * f32(frame.map.size) - 0.5, vec2<f32>(0.0), vec2<f32>(f32(last)));
    let low = vec2<u32>(place);
    let high = min(low + 1u, vec2<u32>(last));
    let ends = vec4<u32>(low, high);
    return Four(ends.xzxz, ends.yyww, four_weights(fract(place)));
}

// Texels `first` to `first` + 3 of a window from `low` to `high` inclusive, row by row. Behind its
// last texel that is repeated, and does not count.
fn window_texels(low: vec2<u32>, high: vec2<u32>, first: u32) -> Four {
    let extent = high - low + 1u;
    let count = extent.x * extent.y;
    let k = vec4<u32>(0u, 1u, 2u, 3u) + first;
    let at = min(k, vec4<u32>(count - 1u));
    let weights = select(vec4<f32>(0.0), vec4<f32>(1.0 / f32(count)), k < vec4<u32>(count));
    return Four(low.x + at % extent.x, low.y + at / extent.x, weights);
}

// The depths at which to look up four texels, so that their shadows are moved in depth to one common
// front where their fronts belong to one surface.
fn aligned_depths(four: Four, depth: f32) -> vec4<f32> {
    var fronts = vec4<f32>(0.0);
    var known = vec4<f32>(0.0);
    var x = four.x;
    var y = four.y;
    for (var k: u32 = 0u; k < 4u; k++) {
        // (depth, 1) if the texel has a front.
        let found = front(vec2<u32>(x.x, y.x));
        fronts = vec4<f32>(fronts.yzw, found.x);
        known = vec4<f32>(known.yzw, found.y);
        x = x.yzwx;
        y = y.yzwx;
    }
    let mean = dot(four.weights * known, fronts) / max(dot(four.weights, known), 1e-30);
    let shifts = known * (fronts - mean);
    let far = abs(shifts);
    let farthest = max(max(far.x, far.y), max(far.z, far.w));
    return depth + clamp(2.0 - farthest / frame.map.surface_reach, 0.0, 1.0) * shifts;
}

// Transmittance at (u, v, depth); 1 outside of the map. Depending on the settings it is that of the
// nearest texel, the mean over a window, or bilinear between the transmittances of the four nearest
// texels, whose shadows are moved to one common front. Texels are looked up in one place only,
// because drivers copy the code of maps to each.
fn shadow_lookup(light: vec3<f32>) -> f32 {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return 1.0;
    }
    var four = four_texels(light.xy);
    var depths = vec4<f32>(light.z);
    if (USUAL) {
        return dot(four.weights, four_transmittances(four.x, four.y, depths));
    }
    let is_window = frame.map.window > 0u;
    var low = vec2<u32>(0u);
    var high = vec2<u32>(0u);
    if (is_window) {
        let last = vec2<u32>(frame.map.size - 1u);
        let middle = min(vec2<u32>(light.xy * f32(frame.map.size)), last);
        let reach = vec2<u32>(frame.map.window / 2u);
        low = max(middle, reach) - reach;
        high = min(middle + reach, last);
        if (LINKED) {
            return linked_mean(low, high, light.z);
        }
    } else if (frame.map.surface_reach > 0.0) {
        depths = aligned_depths(four, light.z);
    }
    let count = (high.x - low.x + 1u) * (high.y - low.y + 1u);
    var sum: f32 = 0.0;
    for (var first: u32 = 0u; first < count; first += 4u) {
        if (is_window) {
            four = window_texels(low, high, first);
        }
        sum += dot(four.weights, four_transmittances(four.x, four.y, depths));
    }
    return sum;
}

// Transmittances of the three channels at (u, v, depth), bilinear: those of each texel are raised to
// the channels' ratios first.
fn shadow_lookup_colours(light: vec3<f32>) -> vec3<f32> {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return vec3<f32>(1.0);
    }
    let four = four_texels(light.xy);
    var depths = vec4<f32>(light.z);
    if (!USUAL && frame.map.surface_reach > 0.0) {
        depths = aligned_depths(four, light.z);
    }
    let kept = max(four_transmittances(four.x, four.y, depths), vec4<f32>(1e-30));
    return vec3<f32>(
        dot(four.weights, pow(kept, vec4<f32>(frame.media.ratios.x))),
        dot(four.weights, pow(kept, vec4<f32>(frame.media.ratios.y))),
        dot(four.weights, pow(kept, vec4<f32>(frame.media.ratios.z))),
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
