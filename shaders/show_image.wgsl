// Pass `show_image`: what a screen shows of a picture, encoded, straight, 8 bits a channel.

#import kernel/tone

@group(0) @binding(29) var single: texture_2d<f32>;
@group(0) @binding(37) var screen: texture_storage_2d<rgba8unorm, write>;
// Factor on radiance, and the number of the tone curve.
@group(0) @binding(38) var<uniform> tone: vec4<f32>;

@compute @workgroup_size(8, 8)
fn show_image(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(screen);
    if any(id.xy >= size) {
        return;
    }
    let radiance = textureLoad(single, id.xy, 0);
    let alpha = saturate(radiance.w);
    let straight = select(0.0, 1.0 / max(alpha, 1e-30), alpha > 0.0);
    let colour = shown(radiance.xyz * straight, tone.x, u32(tone.y));
    textureStore(screen, id.xy, vec4<f32>(srgb_from_linear(colour), alpha));
}
