// Transmittance from the light, read from a shadow map of one of the kinds in shaders/map/. What another
// program imports to shade its own objects: `shadow_at(world position)`.
#import kernel/light
#import map

// Mean transmittance over a window of texels, its ends included, each looked up by itself.
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

// Transmittance at (u, v, depth): 1 outside of the map; nearest, the mean of a window, or bilinear
// between the transmittances of the four nearest texels.
fn shadow_lookup(light: vec3<f32>) -> f32 {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return 1.0;
    }
    let size = f32(frame.sizes.w);
    let last = frame.sizes.w - 1u;
    let width = frame.methods.z;
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
    let four = four_transmittances(low, high, light.z);
    let rows = mix(four.xz, four.yw, f.x);
    return mix(rows.x, rows.y, f.y);
}

// Deeper than every volume.
const FAR: f32 = 1e12;

// The depth at which to look up the shadow of a point that need not lie in the volume.
fn surface_depth(light: vec3<f32>) -> f32 {
    let inside = light_extent(light.x, light.y);
    if (light.z >= inside.y) {
        return FAR;
    }
    if (light.z <= inside.x) {
        return -FAR;
    }
    return light.z;
}

// Transmittance from the light to any world position, in the volume, in front of it or behind it.
fn shadow_at(world: vec3<f32>) -> f32 {
    let light = light_coordinates(world + frame.world_origin.xyz);
    return shadow_lookup(vec3<f32>(light.xy, surface_depth(light)));
}
