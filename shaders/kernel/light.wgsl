// The light's rays, the position of a point in the light's map, and the irradiance there.
#import kernel/ray

// The light ray through map position (u, v), each 0..1. Distances along it are the map's depths.
fn light_ray(u: f32, v: f32) -> Ray {
    let o = frame.light.origin + u * frame.light.origin_u + v * frame.light.origin_v;
    let d = frame.light.direction + u * frame.light.direction_u + v * frame.light.direction_v;
    return Ray(o.xyz, normalize(d.xyz));
}

// Depths where the light ray through (u, v) enters and leaves the volume.
fn light_extent(u: f32, v: f32) -> vec2<f32> {
    let ray = index_ray_of(light_ray(u, v));
    return intersect_box(ray, frame.media.domain_min, frame.media.domain_max);
}

// (u, v, depth) of a point. A point behind a point or spot light has u = -1, which is outside of
// every map.
fn light_coordinates(point: vec3<f32>) -> vec3<f32> {
    let p = vec4<f32>(point, 1.0);
    let u = dot(frame.light.from_frame[0], p);
    let v = dot(frame.light.from_frame[1], p);
    let depth = dot(frame.light.from_frame[2], p);
    let w = dot(frame.light.from_frame[3], p);
    if (frame.light.spread == 0u) {
        return vec3<f32>(u, v, depth);
    }
    if (w <= 0.0) {
        return vec3<f32>(-1.0, -1.0, 0.0);
    }
    return vec3<f32>(u / w, v / w, length(point - frame.light.position));
}

// The direction in which light travels at a point, of unit length.
fn light_direction_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light.spread == 0u) {
        return frame.light.direction.xyz;
    }
    let from_light = point - frame.light.position;
    let distance = length(from_light);
    if (distance == 0.0) {
        return vec3<f32>(0.0);
    }
    return from_light / distance;
}

// Unshadowed irradiance at a point, on a plane that faces the light, per channel.
fn irradiance_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light.spread == 0u) {
        return frame.light.irradiance;
    }
    let from_light = point - frame.light.position;
    if (frame.light.spread > 1u && face_of(from_light) != frame.light.spread - 2u) {
        return vec3<f32>(0.0);
    }
    let squared = max(dot(from_light, from_light), 1e-30);
    return frame.light.irradiance * (cone_share(light_direction_at(point)) / squared);
}

// The share of a spot light's intensity in a direction; 1 for a point light.
fn cone_share(direction: vec3<f32>) -> f32 {
    let inner = frame.light.cone_inner;
    let outer = frame.light.cone_outer;
    let cosine = dot(direction, frame.light.axis);
    let x = clamp((cosine - outer) / max(inner - outer, 1e-6), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// Angle in radians over which one sample of a cone's share stands, and the largest number of such
// samples for a piece of a ray.
const ANGLE: f32 = 0.05;
const MOST_ANGLES: u32 = 64u;

// Mean unshadowed irradiance over a piece of a ray, given its begin, middle and end, for a light
// among the media: close to such a light irradiance changes much over the piece. The integral of
// one over the squared distance is the angle that the piece subtends at the light, divided by the
// light's distance from the ray. The cone's share is averaged over that angle.
fn irradiance_over(begin: vec3<f32>, middle: vec3<f32>, end: vec3<f32>) -> vec3<f32> {
    let a = begin - frame.light.position;
    let m = middle - frame.light.position;
    let b = end - frame.light.position;
    if (face_of(m) != frame.light.spread - 2u) {
        return vec3<f32>(0.0);
    }
    let area = length(cross(a, b));
    let lengths = sqrt(dot(a, a) * dot(b, b));
    if (area <= 1e-3 * lengths) {
        let share = cone_share(light_direction_at(middle));
        return frame.light.irradiance * (share / max(lengths, 1e-30));
    }
    let angle = atan2(area, dot(a, b));
    let along = normalize(a);
    let across = normalize(b - a * (dot(a, b) / dot(a, a)));
    let parts = clamp(u32(ceil(angle / ANGLE)), 1u, MOST_ANGLES);
    var share = 0.0;
    for (var i = 0u; i < parts; i++) {
        let turned = angle * (f32(i) + 0.5) / f32(parts);
        share += cone_share(cos(turned) * along + sin(turned) * across);
    }
    return frame.light.irradiance * (share / f32(parts) * angle / area);
}

// The face of a cube that a direction from its centre passes through: +x, -x, +y, -y, +z, -z are 0
// to 5. Each edge belongs to exactly one face.
fn face_of(direction: vec3<f32>) -> u32 {
    let far = abs(direction);
    if (far.x >= far.y && far.x >= far.z) {
        return select(0u, 1u, direction.x < 0.0);
    }
    if (far.y >= far.z) {
        return select(2u, 3u, direction.y < 0.0);
    }
    return select(4u, 5u, direction.z < 0.0);
}
