// Surfaces, and what one of them leaves in a texel (src/cpu/raster_surfaces.rs). A file that imports
// this says where surfaces are stored and what is kept of them: `point_of(i: u32) -> vec4<f32>`
// (position in frame space, and radius), `opacity_of(i: u32) -> f32`, `corner_of(i: u32) -> vec4<f32>`
// (the first of a triangle's three has the optical depth of a crossing in w), the constant COUNTS_CELLS,
// whether parts know the cells that they cover, and `meets(drawn: Drawn, texel: vec2<u32>) -> Left` for triangles.
#import kernel/tile
#import kernel/triangle

// For each segment of a strand the index of the point where it begins, with two flags.
@group(0) @binding(33) var<storage, read> segments: array<u32>;

const SEGMENT_POINT: u32 = 0x3fffffffu;
const FIRST_SEGMENT: u32 = 0x80000000u;
const LAST_SEGMENT: u32 = 0x40000000u;

// A segment or a triangle in the map.
struct Drawn {
    // Its number among all.
    index: u32,
    is_segment: bool,
    exists: bool,
    sides: Sides,
    // Of a segment: its number, with the flags; where it is; and the corners of a box around the
    // segment in front of it and the one behind it (lowest u and v, highest u and v).
    segment: u32,
    stroke: Stroke,
    before: vec4<f32>,
    after: vec4<f32>,
    triangle: MapTriangle,
}

const NOWHERE = vec4<f32>(3e38, 3e38, -3e38, -3e38);

fn segment_stroke(segment: u32) -> Stroke {
    let point = segment & SEGMENT_POINT;
    let caps = vec2<bool>((segment & FIRST_SEGMENT) != 0u, (segment & LAST_SEGMENT) != 0u);
    return stroke_of(point_of(point), point_of(point + 1u), caps);
}

// The box around a segment, lowest u and v, highest u and v.
fn segment_box(segment: u32) -> vec4<f32> {
    let stroke = segment_stroke(segment);
    if (!stroke.exists) {
        return NOWHERE;
    }
    let u = stroke.sides.u;
    let v = stroke.sides.v;
    return vec4<f32>(
        min(min(u.x, u.y), min(u.z, u.w)),
        min(min(v.x, v.y), min(v.z, v.w)),
        max(max(u.x, u.y), max(u.z, u.w)),
        max(max(v.x, v.y), max(v.z, v.w)),
    );
}

// Surface `index`: segments come first, then triangles.
fn drawn_of(index: u32) -> Drawn {
    var drawn: Drawn;
    drawn.index = index;
    drawn.is_segment = index < tile.segments;
    if (drawn.is_segment) {
        drawn.segment = segments[index];
        drawn.stroke = segment_stroke(drawn.segment);
        drawn.sides = drawn.stroke.sides;
        drawn.exists = drawn.stroke.exists;
        drawn.before = NOWHERE;
        if ((drawn.segment & FIRST_SEGMENT) == 0u) {
            drawn.before = segment_box(segments[index - 1u]);
        }
        drawn.after = NOWHERE;
        if ((drawn.segment & LAST_SEGMENT) == 0u) {
            drawn.after = segment_box(segments[index + 1u]);
        }
    } else if (index - tile.segments < tile.triangles) {
        let first = 3u * (index - tile.segments);
        let a = corner_of(first);
        let all = array<vec3<f32>, 3>(a.xyz, corner_of(first + 1u).xyz, corner_of(first + 2u).xyz);
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

// What a surface leaves in a texel.
struct Left {
    exists: bool,
    // Of a strand: the depths between which it lies, the area that it covers, area times opacity,
    // and area times distance along the strand from the first of its points, of which each is 1 from
    // the next.
    front: f32,
    back: f32,
    area: f32,
    taken: f32,
    along: f32,
    // The number of its last segment.
    last: u32,
    // Of a strand the cells that it covers; of a triangle the rays of a pixel that meet it.
    cells: vec2<u32>,
}

fn left_in(drawn: Drawn, texel: vec2<u32>) -> Left {
    if (drawn.is_segment) {
        return left_by_strand(drawn, vec2<f32>(texel));
    }
    return meets(drawn, texel);
}

// The share of light that what a strand leaves takes of its texel, 0..1.
fn alpha_of(left: Left) -> f32 {
    return clamp(left.taken / max(left.area, 1.0), 0.0, 1.0);
}

// Whether a box touches the texel whose upper left corner is `texel`.
fn is_near(box: vec4<f32>, texel: vec2<f32>) -> bool {
    return all(box.xy <= texel + 1.0) && all(box.zw >= texel);
}

// The area of a texel that a segment covers: 0 where it is nothing but rounding.
fn area_of(stroke: Stroke, texel: vec2<f32>) -> f32 {
    if (frame.map.covers == 0u) {
        return select(0.0, 1.0, holds(stroke.sides, texel + 0.5));
    }
    let area = covered(stroke.sides, texel);
    return select(0.0, area, area > LEAST_AREA);
}

// What a segment covers of a texel where it is the first of its strand, or the first after others
// that do not: all that follow it and cover the texel too count with it.
fn left_by_strand(drawn: Drawn, texel: vec2<f32>) -> Left {
    let index = drawn.index;
    var left: Left;
    let area = area_of(drawn.stroke, texel);
    if (area == 0.0) {
        return left;
    }
    if (is_near(drawn.before, texel) && area_of_segment(segments[index - 1u], texel) > 0.0) {
        return left;
    }
    left = strip_of(drawn.stroke, drawn.segment, texel, area);
    left.last = index;
    var near = is_near(drawn.after, texel);
    while (near) {
        let segment = segments[left.last + 1u];
        let stroke = segment_stroke(segment);
        let more = area_of_touching(stroke, texel);
        if (more == 0.0) {
            break;
        }
        let strip = strip_of(stroke, segment, texel, more);
        left.last++;
        left.front = min(left.front, strip.front);
        left.back = max(left.back, strip.back);
        left.area += more;
        left.taken += strip.taken;
        left.along += strip.along + more * f32(left.last - index);
        left.cells |= strip.cells;
        near = (segment & LAST_SEGMENT) == 0u;
    }
    left.exists = abs(left.back) < 3e38;
    return left;
}

fn area_of_segment(segment: u32, texel: vec2<f32>) -> f32 {
    return area_of_touching(segment_stroke(segment), texel);
}

// The area of a texel that a segment covers, if its outline touches the texel.
fn area_of_touching(stroke: Stroke, texel: vec2<f32>) -> f32 {
    if (!stroke.exists) {
        return 0.0;
    }
    let extent = row_extent(stroke.sides, texel.y);
    if (!(extent.x < texel.x + 1.0 && extent.y >= texel.x)) {
        return 0.0;
    }
    return area_of(stroke, texel);
}

// What one segment leaves in a texel of which it covers an area.
fn strip_of(stroke: Stroke, segment: u32, texel: vec2<f32>, area: f32) -> Left {
    var range = vec2<f32>(nearest_share(stroke, texel + 0.5));
    if (frame.map.covers == 1u) {
        range = range_over(stroke, texel);
    }
    let shares = vec2<f32>(share_along(stroke, range.x), share_along(stroke, range.y));
    let depths = vec2<f32>(depth_along(stroke, shares.x), depth_along(stroke, shares.y));
    let middle = stroke.shares.x + (stroke.shares.y - stroke.shares.x) * 0.5 * (shares.x + shares.y);
    let point = segment & SEGMENT_POINT;
    let opacity = mix(opacity_of(point), opacity_of(point + 1u), middle);
    var strip: Left;
    strip.front = min(depths.x, depths.y);
    strip.back = max(depths.x, depths.y);
    strip.area = area;
    strip.taken = area * opacity;
    strip.along = area * middle;
    if (COUNTS_CELLS) {
        strip.cells = cells_of(stroke.sides, texel);
    }
    return strip;
}

// The index of a texel of the map in the tile.
fn in_tile(texel: vec2<u32>) -> u32 {
    let own = texel - tile.origin;
    return own.y * tile.extent.x + own.x;
}
