// The grids of a mixture: one, which leaves drivers a tenth of the work.

const ONE_FIELD: bool = true;

@group(0) @binding(14) var field_0: texture_3d<f32>;

// What a grid's texture holds at a place, 0..1 along each axis.
fn stored_number(field: u32, place: vec3<f32>) -> f32 {
    return textureSampleLevel(field_0, trilinear, place, 0.0).x;
}
