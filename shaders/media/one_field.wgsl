// The grid of a mixture that has only one; without the selection among grids the driver has a tenth
// less work.

const ONE_FIELD: bool = true;

@group(0) @binding(14) var field_0: texture_3d<f32>;

// The value in the grid's texture at a position, 0..1 along each axis.
fn stored_number(field: u32, place: vec3<f32>) -> f32 {
    return textureSampleLevel(field_0, trilinear, place, 0.0).x;
}
