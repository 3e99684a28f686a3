// The light's rays, where a point lies in its map, and how bright it shines there.
#import kernel/ray

// The light ray through map position (u, v), 0..1. Distances along it are the map's depths.
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

// (u, v, depth) of a point; u = -1 (outside of every map) behind a point or spot light.
fn light_coordinates(point: vec3<f32>) -> vec3<f32> {
    let p = vec4<f32>(point, 1.0);
    let u = dot(frame.light.from_frame[0], p);
    let v = dot(frame.light.from_frame[1], p);
    let depth = dot(frame.light.from_frame[2], p);
    let w = dot(frame.light.from_frame[3], p);
    if (frame.light.has_position == 0u) {
        return vec3<f32>(u, v, depth);
    }
    if (w <= 0.0) {
        return vec3<f32>(-1.0, -1.0, 0.0);
    }
    return vec3<f32>(u / w, v / w, length(point - frame.light.position));
}

// The way light travels at a point, unit length.
fn light_direction_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light.has_position == 0u) {
        return frame.light.direction.xyz;
    }
    let from_light = point - frame.light.position;
    let distance = length(from_light);
    if (distance == 0.0) {
        return vec3<f32>(0.0);
    }
    return from_light / distance;
}

// Unshadowed irradiance at a point on a plane that faces the light, per channel.
fn irradiance_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light.has_position == 0u) {
        return frame.light.irradiance;
    }
    let from_light = point - frame.light.position;
    let squared = max(dot(from_light, from_light), 1e-30);
    let cosine = dot(light_direction_at(point), frame.light.axis);
    let inner = frame.light.cone_inner;
    let outer = frame.light.cone_outer;
    let x = clamp((cosine - outer) / max(inner - outer, 1e-6), 0.0, 1.0);
    return frame.light.irradiance * (x * x * (3.0 - 2.0 * x) / squared);
}
