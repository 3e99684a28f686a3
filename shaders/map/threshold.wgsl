// A threshold map as what shadows are looked up in.
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

// Transmittances of four texels: upper left, upper right, lower left, lower right.
fn four_transmittances(low: vec2<u32>, high: vec2<u32>, depth: f32) -> vec4<f32> {
    return vec4<f32>(
        texel_transmittance(low, depth),
        texel_transmittance(vec2<u32>(high.x, low.y), depth),
        texel_transmittance(vec2<u32>(low.x, high.y), depth),
        texel_transmittance(high, depth),
    );
}

// Mean transmittance over a window of texels, its ends included.
fn window_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    return brute_force_mean(low, high, depth);
}
