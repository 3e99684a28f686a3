// How surfaces reflect light, and where shadows fall on them. src/kernel/surface.rs names the sources.
#import kernel/coverage
#import kernel/shadow

const REACH: f32 = 0.75;
const LEAST_WIDTH: f32 = 2.0;
const LEAST_OFF: f32 = 0.1;
// Points on strands are looked up this many radii nearer to the light.
const OFF_RADII: f32 = 2.2;
const ONE_OVER_PI: f32 = 0.31830987;

// The share of white light that a triangle reflects per unit of solid angle.
fn triangle_reflectance(normal: vec3<f32>, to_light: vec3<f32>) -> f32 {
    return max(dot(normal, to_light), 0.0) * ONE_OVER_PI;
}

// A point of a triangle raised to the smooth surface that the triangle stands for.
fn smooth_place(
    corners: array<vec3<f32>, 3>,
    normals: array<vec3<f32>, 3>,
    weights: vec3<f32>,
    point: vec3<f32>,
) -> vec3<f32> {
    return weights.x * raised(corners[0], normals[0], point)
        + weights.y * raised(corners[1], normals[1], point)
        + weights.z * raised(corners[2], normals[2], point);
}

fn raised(corner: vec3<f32>, normal: vec3<f32>, point: vec3<f32>) -> vec3<f32> {
    return point - min(dot(point - corner, normal), 0.0) * normal;
}

// The share of light that a strand reflects per unit of solid angle, per channel.
fn strand_reflectance(
    tangent: vec3<f32>,
    to_light: vec3<f32>,
    to_camera: vec3<f32>,
    albedo: vec3<f32>,
    specular: f32,
    shininess: f32,
) -> vec3<f32> {
    let lit = dot(tangent, to_light);
    let view = dot(tangent, to_camera);
    let sine_lit = sqrt(max(1.0 - lit * lit, 0.0));
    let sine_view = sqrt(max(1.0 - view * view, 0.0));
    let cone = max(sine_lit * sine_view - lit * view, 0.0);
    var highlight: f32 = 0.0;
    if (specular > 0.0 && cone > 0.0) {
        highlight = specular * pow(cone, shininess);
    }
    return (albedo * sine_lit + highlight) * ONE_OVER_PI;
}

// The weights of a triangle's corners at a point of it.
fn corner_weights(corners: array<vec3<f32>, 3>, point: vec3<f32>) -> vec3<f32> {
    let a = corners[0] - point;
    let b = corners[1] - point;
    let c = corners[2] - point;
    let normal = cross(b - a, c - a);
    let parts = max(
        vec3<f32>(dot(cross(b, c), normal), dot(cross(c, a), normal), dot(cross(a, b), normal)),
        vec3<f32>(0.0),
    );
    return parts / max(parts.x + parts.y + parts.z, 1.1754944e-38);
}

// How far to move a point of a triangle off its plane, so that the texels that a lookup reads do not
// take the plane for something in front of it.
fn off_plane(point: vec3<f32>, plane: vec3<f32>, to_light: vec3<f32>) -> f32 {
    let reach = REACH * max(f32(frame.map.window), LEAST_WIDTH);
    let cosine = dot(plane, to_light);
    return texel_length(point) * (LEAST_OFF + reach * sqrt(max(1.0 - cosine * cosine, 0.0)));
}

// The longer edge of a map's texel at a point.
fn texel_length(point: vec3<f32>) -> f32 {
    var across = length(frame.light.origin_u.xyz);
    var down = length(frame.light.origin_v.xyz);
    if (frame.light.spread != 0u) {
        let distance = distance_of(point);
        across = length(frame.light.direction_u.xyz * distance);
        down = length(frame.light.direction_v.xyz * distance);
    }
    return max(across, down) / f32(frame.map.size);
}

// A way towards the light that does not lead past it: at most half of the whole one.
fn within(position: vec3<f32>, way: f32) -> f32 {
    if (frame.light.spread == 0u) {
        return way;
    }
    return min(way, 0.5 * length(frame.light.position - position));
}

// What light does at a place of a surface.
struct Coming {
    exists: bool,
    // Where it arrives, and on what its shadow falls.
    position: vec3<f32>,
    place: vec3<f32>,
    // The share that is reflected towards the camera, and the albedo.
    reflected: vec3<f32>,
    albedo: vec3<f32>,
    // Whether shadows fall on it, if not 0.
    receives: f32,
    // The opacity of a triangle.
    alpha: f32,
    // Whether its shadow is looked up, or is that of the surface before.
    is_own: bool,
}

// The shadow of the surfaces of a ray that was looked up last.
var<private> shared_shadow: vec3<f32>;

// The light that is reflected.
fn arriving_on(coming: Coming) -> vec3<f32> {
    let unshadowed = irradiance_at(coming.position) * coming.reflected;
    if (coming.receives == 0.0 || all(unshadowed == vec3<f32>(0.0))) {
        return unshadowed;
    }
    if (coming.is_own) {
        let light = light_coordinates(coming.place);
        if (COLOURED) {
            shared_shadow = shadow_lookup_colours(light);
        } else {
            shared_shadow = vec3<f32>(shadow_lookup(light));
        }
    }
    return unshadowed * shared_shadow;
}
