// Transmittance from the light, read from a threshold map. What another program imports to shade its
// own objects: `shadow_at(world position)`.
#import kernel/frame
#import kernel/light
#import kernel/threshold

@group(0) @binding(3) var threshold_map: texture_2d<f32>;

// Transmittance along the central ray of a texel to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    let numbers = textureLoad(threshold_map, texel, 0);
    if (frame.methods.y == 1u) {
        return transmittance_paper(numbers, depth);
    }
    let at = (vec2<f32>(texel) + 0.5) / f32(frame.sizes.w);
    return transmittance_default(numbers, light_extent(at.x, at.y), depth);
}

// Transmittance at (u, v, depth): 1 outside of the map; nearest, or bilinear between the
// transmittances of the four nearest texels.
fn shadow_lookup(light: vec3<f32>) -> f32 {
    if (!(light.x >= 0.0 && light.x <= 1.0 && light.y >= 0.0 && light.y <= 1.0)) {
        return 1.0;
    }
    let size = f32(frame.sizes.w);
    let last = frame.sizes.w - 1u;
    if (frame.methods.z == 0u) {
        return texel_transmittance(min(vec2<u32>(light.xy * size), vec2<u32>(last)), light.z);
    }
    let place = clamp(light.xy * size - 0.5, vec2<f32>(0.0), vec2<f32>(f32(last)));
    let low = vec2<u32>(place);
    let high = min(low + 1u, vec2<u32>(last));
    let f = fract(place);
    let upper = mix(
        texel_transmittance(low, light.z),
        texel_transmittance(vec2<u32>(high.x, low.y), light.z),
        f.x,
    );
    let lower = mix(
        texel_transmittance(vec2<u32>(low.x, high.y), light.z),
        texel_transmittance(high, light.z),
        f.x,
    );
    return mix(upper, lower, f.y);
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
