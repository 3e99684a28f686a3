// Lookups of several texels in maps without links between texels: each texel is looked up by
// itself.

// Transmittances of four texels: upper left, upper right, lower left, lower right.
fn four_transmittances(low: vec2<u32>, high: vec2<u32>, depth: f32) -> vec4<f32> {
    return vec4<f32>(
        texel_transmittance(low, depth),
        texel_transmittance(vec2<u32>(high.x, low.y), depth),
        texel_transmittance(vec2<u32>(low.x, high.y), depth),
        texel_transmittance(high, depth),
    );
}

// Mean transmittance over a window of texels, from `low` to `high` inclusive.
fn window_mean(low: vec2<u32>, high: vec2<u32>, depth: f32) -> f32 {
    return brute_force_mean(low, high, depth);
}
