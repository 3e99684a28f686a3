// Shadow lookup in a threshold map, directly from the four numbers of each texel.
#import kernel/light
#import kernel/threshold
#import map/texels

@group(0) @binding(3) var threshold_map: texture_2d<f32>;

// (depth, 1) where a texel's shadow begins to matter, or 0 in place of the 1 if there is no such
// depth.
fn front(texel: vec2<u32>) -> vec2<f32> {
    let numbers = textureLoad(threshold_map, texel, 0);
    return vec2<f32>(numbers.y, select(0.0, 1.0, numbers.w >= frame.map.thresholds.z));
}

// Transmittance along a texel's central ray from the light to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    let numbers = textureLoad(threshold_map, texel, 0);
    if (frame.map.lookup == 1u) {
        return transmittance_paper(numbers, depth);
    }
    let at = (vec2<f32>(texel) + 0.5) / f32(frame.map.size);
    return transmittance_default(numbers, light_extent(at.x, at.y), depth);
}
