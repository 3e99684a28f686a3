// The light's rays, where a point lies in its map, and how bright it shines there.
#import kernel/ray

// The light ray through map position (u, v), 0..1. Distances along it are the map's depths.
fn light_ray(u: f32, v: f32) -> Ray {
    let o = frame.light_origin + u * frame.light_origin_u + v * frame.light_origin_v;
    let d = frame.light_direction + u * frame.light_direction_u + v * frame.light_direction_v;
    return Ray(o.xyz, normalize(d.xyz));
}

// Depths where the light ray through (u, v) enters and leaves the volume.
fn light_extent(u: f32, v: f32) -> vec2<f32> {
    let ray = index_ray_of(light_ray(u, v));
    return intersect_box(ray, frame.domain_min.xyz, frame.domain_max.xyz);
}

// (u, v, depth) of a point; u = -1 (outside of every map) behind a point or spot light.
fn light_coordinates(point: vec3<f32>) -> vec3<f32> {
    let p = vec4<f32>(point, 1.0);
    let u = dot(frame.light_from_frame[0], p);
    let v = dot(frame.light_from_frame[1], p);
    let depth = dot(frame.light_from_frame[2], p);
    let w = dot(frame.light_from_frame[3], p);
    if (frame.light_position.w == 0.0) {
        return vec3<f32>(u, v, depth);
    }
    if (w <= 0.0) {
        return vec3<f32>(-1.0, -1.0, 0.0);
    }
    return vec3<f32>(u / w, v / w, length(point - frame.light_position.xyz));
}

// The way light travels at a point, unit length.
fn light_direction_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light_position.w == 0.0) {
        return frame.light_direction.xyz;
    }
    let from_light = point - frame.light_position.xyz;
    let distance = length(from_light);
    if (distance == 0.0) {
        return vec3<f32>(0.0);
    }
    return from_light / distance;
}

// Unshadowed irradiance at a point on a plane that faces the light, per channel.
fn irradiance_at(point: vec3<f32>) -> vec3<f32> {
    if (frame.light_position.w == 0.0) {
        return frame.irradiance.xyz;
    }
    let from_light = point - frame.light_position.xyz;
    let squared = max(dot(from_light, from_light), 1e-30);
    let cosine = dot(light_direction_at(point), frame.light_axis.xyz);
    let inner = frame.light_axis.w;
    let outer = frame.irradiance.w;
    let x = clamp((cosine - outer) / max(inner - outer, 1e-6), 0.0, 1.0);
    return frame.irradiance.xyz * (x * x * (3.0 - 2.0 * x) / squared);
}
