// Pass add_beam: adds the picture of one more beam (one light, in one colour channel or in all) to
// the sum of those before it. One thread per pixel.

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;
@group(0) @binding(26) var sum: texture_2d<f32>;
@group(0) @binding(27) var beam: texture_2d<f32>;
// The beam's weight in each channel.
@group(0) @binding(28) var<uniform> weights: vec4<f32>;

@compute @workgroup_size(8, 8)
fn add_beam(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(sum);
    if (id.x >= size.x || id.y >= size.y) {
        return;
    }
    let before = textureLoad(sum, id.xy, 0);
    textureStore(output, id.xy, before + weights * textureLoad(beam, id.xy, 0));
}
