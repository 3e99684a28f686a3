// Surfaces, and what one of them leaves in a texel (src/cpu/raster_surfaces.rs).
#import kernel/parts
#import kernel/triangle

// Points of strands: position in frame space, and radius.
@group(0) @binding(31) var<storage, read> points: array<vec4<f32>>;
// The opacity of a strand's crossing at each point, 0..1.
@group(0) @binding(32) var<storage, read> opacities: array<f32>;
// For each segment of a strand the index of the point where it begins, with two flags.
@group(0) @binding(33) var<storage, read> segments: array<u32>;
// Three corners of each triangle; the first one's w is the optical depth of a crossing.
@group(0) @binding(34) var<storage, read> corners: array<vec4<f32>>;

const SEGMENT_POINT: u32 = 0x3fffffffu;
const FIRST_SEGMENT: u32 = 0x80000000u;
const LAST_SEGMENT: u32 = 0x40000000u;

// A segment or a triangle in the map.
struct Drawn {
    sides: Sides,
    is_segment: bool,
    exists: bool,
    // Of a segment: the index of its first point.
    point: u32,
    opacities: vec2<f32>,
    stroke: Stroke,
    triangle: MapTriangle,
}

// Surface `index`: segments come first, then triangles.
fn drawn_of(index: u32) -> Drawn {
    var drawn: Drawn;
    drawn.is_segment = index < tile.segments;
    if (drawn.is_segment) {
        let segment = segments[index];
        let point = segment & SEGMENT_POINT;
        let caps = vec2<bool>((segment & FIRST_SEGMENT) != 0u, (segment & LAST_SEGMENT) != 0u);
        drawn.point = point;
        drawn.stroke = stroke_of(points[point], points[point + 1u], caps);
        drawn.opacities = vec2<f32>(opacities[point], opacities[point + 1u]);
        drawn.sides = drawn.stroke.sides;
        drawn.exists = drawn.stroke.exists;
    } else if (index - tile.segments < tile.triangles) {
        let first = 3u * (index - tile.segments);
        let a = corners[first];
        let all = array<vec3<f32>, 3>(a.xyz, corners[first + 1u].xyz, corners[first + 2u].xyz);
        drawn.triangle = triangle_of(all, a.w);
        drawn.sides = drawn.triangle.sides;
        drawn.exists = drawn.triangle.exists;
    }
    return drawn;
}

// The columns or rows between two places, in texels, that lie from `first` on and before `end`.
fn texels_between(low: f32, high: f32, first: u32, end: u32) -> vec2<u32> {
    let most = f32(end);
    let begin = max(u32(clamp(low, 0.0, most)), first);
    let behind = min(u32(clamp(high, 0.0, most)) + select(0u, 1u, high >= 0.0), end);
    return vec2<u32>(min(begin, behind), behind);
}

// The rows of the tile that an outline touches: the first, and one past the last.
fn rows_of(sides: Sides) -> vec2<u32> {
    let low = min(min(sides.v.x, sides.v.y), min(sides.v.z, sides.v.w));
    let high = max(max(sides.v.x, sides.v.y), max(sides.v.z, sides.v.w));
    return texels_between(low, high, tile.origin.y, tile.origin.y + tile.extent.y);
}

// The columns of the tile that an outline touches in a row.
fn columns_of(sides: Sides, row: u32) -> vec2<u32> {
    let extent = row_extent(sides, f32(row));
    if (extent.x > extent.y) {
        return vec2<u32>(0u);
    }
    return texels_between(extent.x, extent.y, tile.origin.x, tile.origin.x + tile.extent.x);
}

// Pushes what a surface leaves in a texel, if anything.
fn leave(drawn: Drawn, texel: vec2<u32>) {
    let corner = vec2<f32>(texel);
    if (drawn.is_segment) {
        leave_stroke(drawn.stroke, drawn.point, drawn.opacities, texel);
        return;
    }
    let center = corner + 0.5;
    let at = center / f32(frame.map.size);
    let depth = triangle_depth(drawn.triangle, center, light_ray(at.x, at.y));
    if (depth >= 0.0) {
        push_part(texel, OF_TRIANGLE, vec2<f32>(depth), 0.0, drawn.triangle.optical_depth);
    }
}

fn leave_stroke(stroke: Stroke, point: u32, own: vec2<f32>, texel: vec2<u32>) {
    let corner = vec2<f32>(texel);
    var area: f32;
    var range: vec2<f32>;
    if (frame.map.covers == 1u) {
        area = covered(stroke.sides, corner);
        range = range_over(stroke, corner);
    } else {
        area = select(0.0, 1.0, holds(stroke.sides, corner + 0.5));
        range = vec2<f32>(nearest_share(stroke, corner + 0.5));
    }
    if (area <= 0.0) {
        return;
    }
    let shares = vec2<f32>(share_along(stroke, range.x), share_along(stroke, range.y));
    let depths = vec2<f32>(depth_along(stroke, shares.x), depth_along(stroke, shares.y));
    let along = stroke.shares.x + (stroke.shares.y - stroke.shares.x) * 0.5 * (shares.x + shares.y);
    let opacity = own.x + (own.y - own.x) * along;
    let ordered = vec2<f32>(min(depths.x, depths.y), max(depths.x, depths.y));
    push_part(texel, point, ordered, area, area * opacity);
}
