// A threshold map as what shadows are looked up in, by curves that were worked out before.
#import kernel/light
#import kernel/threshold
#import map/texels

@group(0) @binding(3) var threshold_map: texture_2d<f32>;

// What it says of optical depth, worked out once a texel: four layers.
@group(0) @binding(24) var curves: texture_2d_array<f32>;

fn curve_of(texel: vec2<u32>) -> Curve {
    let a = textureLoad(curves, texel, 0u, 0);
    let b = textureLoad(curves, texel, 1u, 0);
    let c = textureLoad(curves, texel, 2u, 0);
    let d = textureLoad(curves, texel, 3u, 0);
    return Curve(a.xyz, b.xyz, c.xyz, vec2<f32>(b.w, d.x), vec2<f32>(c.w, d.y), a.w);
}

// Transmittance along the central ray of a texel to a depth.
fn texel_transmittance(texel: vec2<u32>, depth: f32) -> f32 {
    if (!USUAL && frame.methods.y == 1u) {
        return transmittance_paper(textureLoad(threshold_map, texel, 0), depth);
    }
    return exp(-optical_depth_at(curve_of(texel), depth));
}
