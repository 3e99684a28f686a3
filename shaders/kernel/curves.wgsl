// Where the curves of a threshold map's texels are written, so that lookups need not work them out again.
#import kernel/threshold

@group(0) @binding(23) var kept_curves: texture_storage_2d_array<rgba32float, write>;

fn keep_curve(texel: vec2<u32>, c: Curve) {
    textureStore(kept_curves, texel, 0u, vec4<f32>(c.z, c.total));
    textureStore(kept_curves, texel, 1u, vec4<f32>(c.tau, c.onset.x));
    textureStore(kept_curves, texel, 2u, vec4<f32>(c.slope, c.end.x));
    textureStore(kept_curves, texel, 3u, vec4<f32>(c.onset.y, c.end.y, 0.0, 0.0));
}
