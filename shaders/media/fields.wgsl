// The grids of a mixture that has several.

const ONE_FIELD: bool = false;

@group(0) @binding(14) var field_0: texture_3d<f32>;
@group(0) @binding(15) var field_1: texture_3d<f32>;
@group(0) @binding(16) var field_2: texture_3d<f32>;
@group(0) @binding(17) var field_3: texture_3d<f32>;
@group(0) @binding(18) var field_4: texture_3d<f32>;
@group(0) @binding(19) var field_5: texture_3d<f32>;
@group(0) @binding(20) var field_6: texture_3d<f32>;
@group(0) @binding(21) var field_7: texture_3d<f32>;

// The value in a grid's texture at a position, 0..1 along each axis.
fn stored_number(field: u32, place: vec3<f32>) -> f32 {
    var value: f32 = 0.0;
    switch field {
        case 0u: { value = textureSampleLevel(field_0, trilinear, place, 0.0).x; }
        case 1u: { value = textureSampleLevel(field_1, trilinear, place, 0.0).x; }
        case 2u: { value = textureSampleLevel(field_2, trilinear, place, 0.0).x; }
        case 3u: { value = textureSampleLevel(field_3, trilinear, place, 0.0).x; }
        case 4u: { value = textureSampleLevel(field_4, trilinear, place, 0.0).x; }
        case 5u: { value = textureSampleLevel(field_5, trilinear, place, 0.0).x; }
        case 6u: { value = textureSampleLevel(field_6, trilinear, place, 0.0).x; }
        default: { value = textureSampleLevel(field_7, trilinear, place, 0.0).x; }
    }
    return value;
}
