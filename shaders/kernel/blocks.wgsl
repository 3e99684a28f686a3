// Density between voxels of a volume that is stored in blocks; equal blocks are stored once. The
// texture unit interpolates trilinearly within a block and clamps at the volume's border.
#import kernel/frame

// The stored blocks, side by side.
@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var trilinear: sampler;
// Where each block is stored, in blocks along x, y and z, ten bits each; NO_BLOCK for an empty one.
@group(0) @binding(25) var blocks: texture_3d<u32>;

const NO_BLOCK: u32 = 0xffffffffu;
// Cells along a block's edge, and voxels along it.
const BLOCK: f32 = 16.0;
const BLOCK_EDGE: f32 = 17.0;

// Density at a position in texture coordinates of the whole volume.
fn sample_density(place: vec3<f32>) -> f32 {
    let dims = round(1.0 / frame.media.voxel_share);
    let voxel = clamp(place * dims - 0.5, vec3<f32>(0.0), dims - 1.0);
    let block = floor(voxel * (1.0 / BLOCK));
    let stored = textureLoad(blocks, vec3<u32>(block), 0).x;
    if (stored == NO_BLOCK) {
        return 0.0;
    }
    let corner = vec3<f32>(vec3<u32>(stored, stored >> 10u, stored >> 20u) & vec3<u32>(1023u));
    let texel = corner * BLOCK_EDGE + (voxel - block * BLOCK) + 0.5;
    let share = 1.0 / vec3<f32>(textureDimensions(voxels));
    return textureSampleLevel(voxels, trilinear, texel * share, 0.0).x * frame.media.stored_one;
}
