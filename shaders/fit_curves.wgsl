// Pass fit_curves: computes the curves of a threshold map that comes from the host and was not
// traced here. One thread per texel.
#import kernel/curves
#import kernel/light

@group(0) @binding(3) var threshold_map: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn fit_curves(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = frame.map.size;
    if (id.x >= size || id.y >= size) {
        return;
    }
    let at = (vec2<f32>(id.xy) + 0.5) / f32(size);
    keep_curve(id.xy, curve(textureLoad(threshold_map, id.xy, 0), light_extent(at.x, at.y)));
}
