// Density between voxels: the texture unit interpolates trilinearly and clamps at the border.
#import kernel/frame

@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var trilinear: sampler;

// Density at a position in texture coordinates.
fn sample_density(place: vec3<f32>) -> f32 {
    return textureSampleLevel(voxels, trilinear, place, 0.0).x * frame.media.stored_one;
}
