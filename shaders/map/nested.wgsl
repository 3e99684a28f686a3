// Shadow lookup in a map of nested knots.
#import kernel/light
#import kernel/nested
#import map/texels

// Whether lookups search lists.
const LISTS: bool = false;

// The code of each texel, row by row, and the depths where its ray enters and leaves the media.
@group(0) @binding(41) var<storage, read> coded: array<vec4<u32>>;
@group(0) @binding(42) var<storage, read> extents: array<vec2<f32>>;

// Codes do not tell where a shadow begins to matter.
fn front(texel: vec2<u32>) -> vec2<f32> {
    return vec2<f32>(0.0);
}

// Transmittance along a texel's central ray from the light to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    let at = texel.y * frame.map.size + texel.x;
    return nested_transmittance(coded[at], extents[at], depth);
}
