// The speed of texture sampling: each thread makes 512 trilinear fetches from one face of the
// volume to the other, along paths close to those of its neighbours, with eight fetches in flight.

@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var trilinear: sampler;
@group(0) @binding(4) var output: texture_storage_2d<r32float, write>;

const FETCHES: u32 = 512u;

fn fetched(first: vec3<f32>, stride: vec3<f32>, i: u32) -> f32 {
    return textureSampleLevel(voxels, trilinear, first + f32(i) * stride, 0.0).x;
}

@compute @workgroup_size(8, 8)
fn fetch(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(textureDimensions(output));
    // From anywhere on the lower face to the middle nine tenths of the upper face.
    let first = vec3<f32>(at, 0.0);
    let stride = (vec3<f32>(0.05 + 0.9 * at, 1.0) - first) / f32(FETCHES);
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i < FETCHES; i += 8u) {
        let a = fetched(first, stride, i);
        let b = fetched(first, stride, i + 1u);
        let c = fetched(first, stride, i + 2u);
        let d = fetched(first, stride, i + 3u);
        let e = fetched(first, stride, i + 4u);
        let f = fetched(first, stride, i + 5u);
        let g = fetched(first, stride, i + 6u);
        let h = fetched(first, stride, i + 7u);
        sum += ((a + b) + (c + d)) + ((e + f) + (g + h));
    }
    textureStore(output, id.xy, vec4<f32>(sum));
}
