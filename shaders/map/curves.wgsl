// Shadow lookup in a threshold map through curves that were computed before.
#import kernel/light
#import kernel/threshold
#import map/texels

// Whether lookups search lists.
const LISTS: bool = false;

@group(0) @binding(3) var threshold_map: texture_2d<f32>;

// The curves, written once per texel (kernel/curves).
@group(0) @binding(23) var<storage, read> piece_ends: array<vec4<f32>>;
@group(0) @binding(24) var<storage, read> cubics: array<vec4<f32>>;

// (depth, 1) where a texel's shadow begins to matter, or 0 in place of the 1 if there is no such
// depth.
fn front(texel: vec2<u32>) -> vec2<f32> {
    let numbers = textureLoad(threshold_map, texel, 0);
    return vec2<f32>(numbers.y, select(0.0, 1.0, numbers.w >= frame.map.thresholds.z));
}

// Transmittance along a texel's central ray from the light to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    if (!USUAL && frame.map.lookup == 1u) {
        return transmittance_paper(textureLoad(threshold_map, texel, 0), depth);
    }
    let size = frame.map.size;
    let at = texel.y * size + texel.x;
    let ends = piece_ends[at];
    let k = piece_of(ends, depth);
    return exp(-optical_depth_in(ends, k, cubics[k * size * size + at], depth));
}
