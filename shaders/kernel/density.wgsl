// Density between voxels: trilinear by the texture unit, clamped at the border.
#import kernel/frame

@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var trilinear: sampler;

// Density at a voxel index (x, y, z).
fn sample_density(index: vec3<f32>) -> f32 {
    let place = (index + 0.5) * frame.voxel_share.xyz;
    return textureSampleLevel(voxels, trilinear, place, 0.0).x * frame.world_origin.w;
}
