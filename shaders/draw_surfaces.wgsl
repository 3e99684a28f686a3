// Pass draw_surfaces: what passes raster_surfaces and raster_large do, by the graphics pipeline. Each
// segment and each triangle is drawn as a rectangle around its outline, wide enough for the middles
// of all texels that the outline touches. There is no render target.
#import kernel/casting

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) index: u32,
}

// Half the diagonal of a texel, and some more for rounding.
const MARGIN: f32 = 0.72;

// The direction of an outline's longest side.
fn longest_side(sides: Sides) -> vec2<f32> {
    var longest = vec2<f32>(1e-6, 0.0);
    for (var i = 0u; i < 4u; i++) {
        let side = vec2<f32>(sides.u[(i + 1u) % 4u] - sides.u[i], sides.end[i] - sides.v[i]);
        if (dot(side, side) > dot(longest, longest)) {
            longest = side;
        }
    }
    return normalize(longest);
}

// The range of a direction's coordinate over the corners of an outline.
fn extent_along(sides: Sides, direction: vec2<f32>) -> vec2<f32> {
    let at = sides.u * direction.x + sides.v * direction.y;
    let low = min(min(at.x, at.y), min(at.z, at.w));
    let high = max(max(at.x, at.y), max(at.z, at.w));
    return vec2<f32>(low - MARGIN, high + MARGIN);
}

// Six corners of two triangles for each surface.
@vertex
fn surface(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Corner {
    let drawn = drawn_of(index);
    if (!drawn.exists) {
        return Corner(vec4<f32>(-2.0, -2.0, 0.0, 1.0), index);
    }
    let along = longest_side(drawn.sides);
    let across = vec2<f32>(-along.y, along.x);
    let lengths = extent_along(drawn.sides, along);
    let widths = extent_along(drawn.sides, across);
    let far = corner == 1u || corner == 2u || corner == 4u;
    let wide = corner == 2u || corner == 4u || corner == 5u;
    let place = along * select(lengths.x, lengths.y, far) + across * select(widths.x, widths.y, wide);
    let share = (place - vec2<f32>(tile.origin)) / vec2<f32>(tile.extent);
    return Corner(vec4<f32>(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y, 0.0, 1.0), index);
}

@fragment
fn draw_surfaces(at: Corner) {
    let texel = tile.origin + vec2<u32>(at.position.xy);
    let drawn = drawn_of(at.index);
    let touched = columns_of(drawn.sides, texel.y);
    if (texel.x >= touched.x && texel.x < touched.y) {
        let left = left_in(drawn, texel);
        if (left.exists) {
            leave(atomicAdd(&counters[0], 1u), texel, drawn, left);
        }
    }
}
