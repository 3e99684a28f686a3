// Intersections of rays and boxes, and the number of steps along a ray.
#import kernel/frame

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

fn ray_at(ray: Ray, t: f32) -> vec3<f32> {
    return ray.origin + t * ray.direction;
}

// The same ray in another space, given the rows of the transform to that space; t still counts
// frame-space lengths.
fn transformed(ray: Ray, x: vec4<f32>, y: vec4<f32>, z: vec4<f32>) -> Ray {
    let o = vec4<f32>(ray.origin, 1.0);
    let d = vec4<f32>(ray.direction, 0.0);
    return Ray(
        vec3<f32>(dot(x, o), dot(y, o), dot(z, o)),
        vec3<f32>(dot(x, d), dot(y, d), dot(z, d)),
    );
}

// The same ray in voxel indices.
fn index_ray_of(ray: Ray) -> Ray {
    let rows = frame.media.index_from_frame;
    return transformed(ray, rows[0], rows[1], rows[2]);
}

// The part of a ray inside a box, as distances (enter, exit); empty if exit <= enter.
fn intersect_box(ray: Ray, lowest: vec3<f32>, highest: vec3<f32>) -> vec2<f32> {
    let tiny = vec3<f32>(1e-30);
    let d = select(ray.direction, tiny, abs(ray.direction) < tiny);
    let a = (lowest - ray.origin) / d;
    let b = (highest - ray.origin) / d;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, max(near.y, near.z)), 0.0);
    return vec2<f32>(enter, min(far.x, min(far.y, far.z)));
}

// The number of voxel lengths along `along`, a vector in voxel indices, of a ray that is `extent`
// long in the medium; at most as many as the frame allows for the whole ray.
fn voxels_over(ray: Ray, along: f32, extent: f32) -> f32 {
    let most = frame.media.most_voxels / max(max(extent, along), 1.1754944e-38);
    return along * min(length(ray.direction), most);
}

fn step_count(voxels: f32, per_voxel: f32, least: u32, most: u32) -> u32 {
    return clamp(u32(min(ceil(voxels * per_voxel), 16777216.0)), least, most);
}
