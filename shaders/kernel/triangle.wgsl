// Triangles as the texels of a map see them: which texels' central rays meet one, and at what depth.
#import kernel/coverage

// A triangle in a map. A part behind a light with a position is cut off, which leaves up to four
// corners.
struct MapTriangle {
    // Its corners in texels, in order around it; the last one is repeated where there are three.
    sides: Sides,
    // A point of its plane in frame space, and the plane's normal, of any length.
    point: vec3<f32>,
    normal: vec3<f32>,
    // Optical depth of a crossing.
    optical_depth: f32,
    // Whether it is in front of the light and has an area.
    exists: bool,
}

// The triangle between three corners (frame space) in the map.
fn triangle_of(corners: array<vec3<f32>, 3>, optical_depth: f32) -> MapTriangle {
    var triangle: MapTriangle;
    let a = corners[0];
    let b = corners[1];
    let c = corners[2];
    triangle.point = a;
    triangle.normal = cross(b - a, c - a);
    triangle.optical_depth = optical_depth;
    if (optical_depth <= 0.0 || all(triangle.normal == vec3<f32>(0.0))) {
        return triangle;
    }
    var kept: array<vec2<f32>, 4>;
    if (frame.light.spread == 0u) {
        kept[0] = texel_place(a);
        kept[1] = texel_place(b);
        kept[2] = texel_place(c);
        kept[3] = kept[2];
    } else {
        let distances = array<f32, 3>(distance_of(a), distance_of(b), distance_of(c));
        let nearest = NEAREST * max(length(b - a), length(c - a));
        if (max(distances[0], max(distances[1], distances[2])) <= nearest) {
            return triangle;
        }
        var held = corners;
        var count = 0u;
        for (var i = 0u; i < 3u; i++) {
            let next = (i + 1u) % 3u;
            let near = distances[i];
            let far = distances[next];
            if (near >= nearest) {
                kept[count] = texel_place(held[i]);
                count++;
            }
            if ((near >= nearest) != (far >= nearest)) {
                let share = (nearest - near) / (far - near);
                kept[count] = texel_place(held[i] + (held[next] - held[i]) * share);
                count++;
            }
        }
        for (var i = count; i < 4u; i++) {
            kept[i] = kept[max(count, 1u) - 1u];
        }
    }
    let u = vec4<f32>(kept[0].x, kept[1].x, kept[2].x, kept[3].x);
    let v = vec4<f32>(kept[0].y, kept[1].y, kept[2].y, kept[3].y);
    // Comparisons are false for what is not a number.
    triangle.exists = all(abs(u) < vec4<f32>(3e38)) && all(abs(v) < vec4<f32>(3e38));
    triangle.sides = sides_of(u, v);
    return triangle;
}

// The depth where the ray through a place, in texels, meets a triangle. Negative if it passes by. Of
// the triangles at an edge only one is met.
fn triangle_depth(triangle: MapTriangle, place: vec2<f32>, ray: Ray) -> f32 {
    if (!triangle_holds(triangle.sides, place)) {
        return -1.0;
    }
    return plane_depth(triangle.point, triangle.normal, ray);
}

// Whether a place is in a triangle. At an edge it is in only one of two.
fn triangle_holds(sides: Sides, place: vec2<f32>) -> bool {
    var left = false;
    var right = false;
    for (var i = 0u; i < 4u; i++) {
        let a = vec2<f32>(sides.u[i], sides.v[i]);
        let b = vec2<f32>(sides.u[(i + 1u) % 4u], sides.v[(i + 1u) % 4u]);
        if (any(a != b)) {
            let on_left = is_left(a, b, place);
            left = left || on_left;
            right = right || !on_left;
        }
    }
    return !(left && right);
}

// The depth where a ray meets the plane through a point, across a normal of any length; negative
// where it does not.
fn plane_depth(point: vec3<f32>, normal: vec3<f32>, ray: Ray) -> f32 {
    let depth = dot(normal, point - ray.origin) / dot(normal, ray.direction);
    return select(-1.0, depth, depth >= 0.0 && depth < 3e38);
}

// Whether a place is on the left of a line. One on it counts as a little above it or, where the line
// is upright, on its right. Lines in opposite directions give opposite answers.
fn is_left(start: vec2<f32>, end: vec2<f32>, place: vec2<f32>) -> bool {
    let forward = start.x < end.x || (start.x == end.x && start.y <= end.y);
    let a = select(end, start, forward) - place;
    let b = select(start, end, forward) - place;
    let area = a.x * b.y - a.y * b.x;
    let left = area > 0.0 || (area == 0.0 && b.x > a.x);
    return left == forward;
}
