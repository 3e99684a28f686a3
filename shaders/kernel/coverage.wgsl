// Segments of strands as the texels of a map see them: the area of a texel that a segment covers,
// and the depths between which it does. src/kernel/coverage.rs explains them.
#import kernel/light

const NEAREST: f32 = 1e-4;
const NEAREST_RADII: f32 = 1.5;
const FAR_RADII: f32 = 40.0;
const LEAST_SQUARE: f32 = 0.5;
const SHORTEST: f32 = 1e-30;
const LEAST_AREA: f32 = 1e-6;
const QUARTER_PI: f32 = 0.7853982;

// The four sides of an outline: where they begin and end, and how u changes over v along each (0 for
// level ones). u and v are the outline's corners, in order around it.
struct Sides {
    u: vec4<f32>,
    v: vec4<f32>,
    end: vec4<f32>,
    slopes: vec4<f32>,
}

// A segment of a strand in a map. Lengths are in texels.
struct Stroke {
    sides: Sides,
    // The ends of its axis.
    ends: array<vec2<f32>, 2>,
    // How far its outline reaches beyond its axis along u and v, at most.
    reach: vec2<f32>,
    // The ends of its axis in frame space.
    points: array<vec3<f32>, 2>,
    // Their distances along the axis of the light's view; 1 for parallel light.
    distances: vec2<f32>,
    // The shares of the segment where its ends are.
    shares: vec2<f32>,
    // Whether it is in front of the light.
    exists: bool,
}

// One end of a stroke: the tip of its axis, and the corners beside it in texels.
struct StrokeEnd {
    tip: vec3<f32>,
    right: vec2<f32>,
    left: vec2<f32>,
}

// A point's place in the map, in texels.
fn texel_place(point: vec3<f32>) -> vec2<f32> {
    return light_coordinates(point).xy * f32(frame.map.size);
}

// A point's distance from the light along the axis of its view; 1 for parallel light.
fn distance_of(point: vec3<f32>) -> f32 {
    return select(dot(frame.light.from_frame[3], vec4<f32>(point, 1.0)), 1.0, frame.light.spread == 0u);
}

// A vector's direction; where it has none, one across `ray`.
fn direction_or_across(vector: vec3<f32>, ray: vec3<f32>) -> vec3<f32> {
    let size = length(vector);
    if (size > SHORTEST) {
        return vector / size;
    }
    let along_x = abs(ray.x) < abs(ray.y);
    let across = cross(ray, select(vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(1.0, 0.0, 0.0), along_x));
    return across / max(length(across), SHORTEST);
}

// How much wider than its radius a strand appears from a light so close that rays which touch it
// pass in front of its axis; `ray` goes from the light to a point of the axis.
fn widening(along: vec3<f32>, ray: vec3<f32>, radius: f32) -> f32 {
    if (frame.light.spread == 0u) {
        return 1.0;
    }
    let distance = length(cross(ray, along)) / max(length(along), SHORTEST);
    let share = radius / max(distance, SHORTEST);
    return 1.0 / sqrt(max(1.0 - share * share, LEAST_SQUARE));
}

// The end of the segment from a to b at `point`, of which the strand begins (-1) or ends (1) or goes
// on (0) there.
fn stroke_end(a: vec4<f32>, b: vec4<f32>, point: vec4<f32>, outwards: f32) -> StrokeEnd {
    let parallel = frame.light.spread == 0u;
    let axis = (b - a).xyz;
    let ray = select(point.xyz - frame.light.position, frame.light.direction.xyz, parallel);
    let side = direction_or_across(cross(axis, ray), ray);
    let along = direction_or_across(cross(ray, side), ray);
    // Close to a light, rays spread so much that what sticks out would have other flanks.
    let far = parallel || length(ray) > FAR_RADII * point.w;
    let beyond = select(0.0, outwards * QUARTER_PI * point.w, far);
    let ahead = dot(along, axis);
    let tip = point.xyz + along * (beyond * select(1.0, -1.0, ahead < 0.0));
    // What sticks out goes on as the strand does, so that its flanks stay where they are.
    let slope = (b.w - a.w) / max(max(abs(ahead), max(b.w, a.w)), SHORTEST);
    let wide = max(point.w + slope * beyond, 0.0) * widening(axis, ray, point.w);
    return StrokeEnd(tip, texel_place(tip - side * wide), texel_place(tip + side * wide));
}

// The stroke of a segment between two points of a strand (position and radius); `caps` says where
// the strand ends.
fn stroke_of(from_point: vec4<f32>, to_point: vec4<f32>, caps: vec2<bool>) -> Stroke {
    var stroke: Stroke;
    var a = from_point;
    var b = to_point;
    stroke.shares = vec2<f32>(0.0, 1.0);
    if (frame.light.spread != 0u) {
        let near = distance_of(a.xyz);
        let far = distance_of(b.xyz);
        // What is as wide as the strand must not reach behind the light either.
        let nearest = NEAREST * length((b - a).xyz) + NEAREST_RADII * max(a.w, b.w);
        if (max(near, far) <= nearest) {
            return stroke;
        }
        let share = (nearest - near) / (far - near);
        let between = a + (b - a) * share;
        if (near < nearest) {
            a = between;
            stroke.shares.x = share;
        } else if (far < nearest) {
            b = between;
            stroke.shares.y = share;
        }
    }
    let first = stroke_end(a, b, a, select(0.0, -1.0, caps.x));
    let last = stroke_end(a, b, b, select(0.0, 1.0, caps.y));
    stroke.exists = true;
    stroke.points = array<vec3<f32>, 2>(first.tip, last.tip);
    let ends = array<vec2<f32>, 2>(texel_place(first.tip), texel_place(last.tip));
    stroke.ends = ends;
    let of_first = max(abs(first.right - ends[0]), abs(first.left - ends[0]));
    let of_last = max(abs(last.right - ends[1]), abs(last.left - ends[1]));
    stroke.reach = max(of_first, of_last);
    stroke.sides = sides_of(
        vec4<f32>(first.right.x, first.left.x, last.left.x, last.right.x),
        vec4<f32>(first.right.y, first.left.y, last.left.y, last.right.y),
    );
    stroke.distances = vec2<f32>(distance_of(first.tip), distance_of(last.tip));
    return stroke;
}

// The sides of a convex quadrangle.
fn sides_of(u: vec4<f32>, v: vec4<f32>) -> Sides {
    let end = v.yzwx;
    let rises = end - v;
    let level = rises == vec4<f32>(0.0);
    let slopes = (u.yzwx - u) / select(rises, vec4<f32>(1.0), level);
    return Sides(u, v, end, select(slopes, vec4<f32>(0.0), level));
}

// The range of u of an outline between the rows' borders y and y + 1, in texels; empty if x > y.
fn row_extent(sides: Sides, y: f32) -> vec2<f32> {
    let top = min(sides.v, sides.end);
    let bottom = max(sides.v, sides.end);
    let ends = sides.u.yzwx;
    let level = sides.v == sides.end;
    let upper = sides.u + (clamp(vec4<f32>(y), top, bottom) - sides.v) * sides.slopes;
    let at_lower = sides.u + (clamp(vec4<f32>(y + 1.0), top, bottom) - sides.v) * sides.slopes;
    let lower = select(at_lower, ends, level);
    let touches = (bottom >= vec4<f32>(y)) & (top <= vec4<f32>(y + 1.0));
    let low = select(vec4<f32>(3e38), min(upper, lower), touches);
    let high = select(vec4<f32>(-3e38), max(upper, lower), touches);
    return vec2<f32>(
        min(min(low.x, low.y), min(low.z, low.w)),
        max(max(high.x, high.y), max(high.z, high.w)),
    );
}

// The area that a convex quadrangle covers of the texel whose upper left corner is `texel`, 0..1.
fn covered(sides: Sides, texel: vec2<f32>) -> f32 {
    let zero = vec4<f32>(0.0);
    let one = vec4<f32>(1.0);
    let u = sides.u - texel.x;
    let v = sides.v - texel.y;
    let top = clamp(v, zero, one);
    let bottom = clamp(sides.end - texel.y, zero, one);
    let at_top = u + (top - v) * sides.slopes;
    let at_bottom = u + (bottom - v) * sides.slopes;
    let low = min(at_top, at_bottom);
    let high = max(at_top, at_bottom);
    let left = clamp(low, zero, one);
    let right = clamp(high, zero, one);
    let lengths = high - low;
    // The mean of each side's u, clamped to the texel.
    let beyond = max(high - max(low, one), zero);
    let sums = (right - left) * (right + left) * 0.5 + beyond;
    let upright = lengths < vec4<f32>(1e-6);
    let means = select(sums / select(lengths, one, upright), left, upright);
    return min(abs(dot(means, bottom - top)), 1.0);
}

// Which of the 8 x 8 cells of the texel whose upper left corner is `texel` have their middle in a
// convex quadrangle; bit 8 y + x for column x and row y, of two words.
fn cells_of(sides: Sides, texel: vec2<f32>) -> vec2<u32> {
    var cells = vec2<u32>(0u);
    for (var row = 0u; row < 8u; row++) {
        let at = vec4<f32>(texel.y + (f32(row) + 0.5) / 8.0);
        let crosses = (sides.v <= at) != (sides.end <= at);
        let u = sides.u + (at - sides.v) * sides.slopes;
        let low = select(vec4<f32>(3e38), u, crosses);
        let high = select(vec4<f32>(-3e38), u, crosses);
        let first = cell_at(min(min(low.x, low.y), min(low.z, low.w)) - texel.x);
        let end = cell_at(max(max(high.x, high.y), max(high.z, high.w)) - texel.x);
        if (first < end) {
            let bits = ((1u << (end - first)) - 1u) << (8u * (row % 4u) + first);
            if (row < 4u) {
                cells.x |= bits;
            } else {
                cells.y |= bits;
            }
        }
    }
    return cells;
}

// The first cell of a row whose middle is behind a place.
fn cell_at(u: f32) -> u32 {
    return u32(clamp(u * 8.0 + 0.5, 0.0, 8.0));
}

// The range of a stroke's axis, as shares of its length, in the texel whose upper left corner is
// `texel` and as far around it as the stroke is wide, as far as places of the texel are nearest to
// it. Where the axis passes by, it is the place nearest to the texel's middle.
fn range_over(stroke: Stroke, texel: vec2<f32>) -> vec2<f32> {
    let a = stroke.ends[0];
    let axis = stroke.ends[1] - a;
    let low = texel - stroke.reach - a;
    let high = texel + 1.0 + stroke.reach - a;
    let square = max(dot(axis, axis), SHORTEST);
    let middle = dot(texel + 0.5 - a, axis) / square;
    let half = 0.5 * (abs(axis.x) + abs(axis.y)) / square;
    var from_share = max(middle - half, 0.0);
    var to_share = min(middle + half, 1.0);
    if (abs(axis.x) > 1e-6) {
        from_share = max(from_share, min(low.x / axis.x, high.x / axis.x));
        to_share = min(to_share, max(low.x / axis.x, high.x / axis.x));
    }
    if (abs(axis.y) > 1e-6) {
        from_share = max(from_share, min(low.y / axis.y, high.y / axis.y));
        to_share = min(to_share, max(low.y / axis.y, high.y / axis.y));
    }
    if (from_share <= to_share) {
        return vec2<f32>(from_share, to_share);
    }
    return vec2<f32>(nearest_share(stroke, texel + 0.5));
}

// The share of a stroke's axis, 0..1, at the place nearest to `place`.
fn nearest_share(stroke: Stroke, place: vec2<f32>) -> f32 {
    let a = stroke.ends[0];
    let axis = stroke.ends[1] - a;
    return clamp(dot(place - a, axis) / max(dot(axis, axis), SHORTEST), 0.0, 1.0);
}

// Whether a convex quadrangle, in either order, holds a place.
fn holds(sides: Sides, place: vec2<f32>) -> bool {
    let across = sides.u.yzwx - sides.u;
    let along = sides.end - sides.v;
    let areas = across * (place.y - sides.v) - along * (place.x - sides.u);
    return all(areas >= vec4<f32>(0.0)) || all(areas <= vec4<f32>(0.0));
}

// The share of the way along a stroke's axis, in space, of the place at a share of it as it appears
// in the map.
fn share_along(stroke: Stroke, share: f32) -> f32 {
    let near = stroke.distances.x;
    let far = stroke.distances.y;
    return share * near / max(far + share * (near - far), SHORTEST);
}

// The depth of the place at a share of the way along a stroke's axis, in space.
fn depth_along(stroke: Stroke, share: f32) -> f32 {
    let a = stroke.points[0];
    return light_coordinates(a + (stroke.points[1] - a) * share).z;
}
