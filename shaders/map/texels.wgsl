// Lookups of several texels in maps without links between texels: each texel is looked up by
// itself.

// Transmittances of four texels along their central rays from the light, each up to its own depth.
fn four_transmittances(x: vec4<u32>, y: vec4<u32>, depths: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(
        texel_transmittance(vec2<u32>(x.x, y.x), depths.x),
        texel_transmittance(vec2<u32>(x.y, y.y), depths.y),
        texel_transmittance(vec2<u32>(x.z, y.z), depths.z),
        texel_transmittance(vec2<u32>(x.w, y.w), depths.w),
    );
}

// Never called: `LINKED` is for maps with links.
fn linked_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    return 1.0;
}
