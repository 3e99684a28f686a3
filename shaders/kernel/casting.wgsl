// Surfaces that cast shadows, and the fragments that they leave in a map's texels.
#import kernel/lists
#import kernel/surfaces

@group(0) @binding(31) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(32) var<storage, read> opacities: array<f32>;
@group(0) @binding(34) var<storage, read> corners: array<vec4<f32>>;

const COUNTS_CELLS: bool = false;

fn point_of(i: u32) -> vec4<f32> {
    return points[i];
}

fn opacity_of(i: u32) -> f32 {
    return opacities[i];
}

fn corner_of(i: u32) -> vec4<f32> {
    return corners[i];
}

// What a triangle leaves where a texel's central ray meets it.
fn meets(drawn: Drawn, texel: vec2<u32>) -> Left {
    let center = vec2<f32>(texel) + 0.5;
    let at = center / f32(frame.map.size);
    var left: Left;
    left.front = triangle_depth(drawn.triangle, center, light_ray(at.x, at.y));
    left.back = left.front;
    left.exists = left.front >= 0.0;
    return left;
}

// Pushes a fragment, for which there is a place in the buffer, on the list of a texel.
fn leave(at: u32, texel: vec2<u32>, drawn: Drawn, left: Left) {
    var bounds = vec2<f32>(left.front, left.back);
    var optical_depth = drawn.triangle.optical_depth;
    if (drawn.is_segment) {
        let alpha = alpha_of(left);
        optical_depth = OPAQUE_OPTICAL_DEPTH;
        if (alpha < 1.0) {
            optical_depth = -log(1.0 - alpha);
        }
        if (frame.map.covers == 0u) {
            bounds = vec2<f32>(0.5 * (left.front + left.back));
        }
    }
    if (optical_depth > 0.0) {
        put_fragment(at, in_tile(texel), bounds, optical_depth);
    }
}
