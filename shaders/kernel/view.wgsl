// The camera's rays, sample positions within pixels, and the ground.
#import kernel/light

// The camera ray through picture position (x, y), each 0..1 from the upper left corner.
fn camera_ray(x: f32, y: f32) -> Ray {
    let o = frame.view.origin + x * frame.view.origin_x + y * frame.view.origin_y;
    let d = frame.view.direction + x * frame.view.direction_x + y * frame.view.direction_y;
    return Ray(o.xyz, normalize(d.xyz));
}

// Position of sample i of a pixel within it, 0..1.
fn pixel_offset(i: u32, samples: u32) -> vec2<f32> {
    if (samples == 1u) {
        return vec2<f32>(0.5);
    }
    let golden = fract(f32(i) * 0.618034 + 0.5);
    return vec2<f32>((f32(i) + 0.5) / f32(samples), golden);
}

// Distance along a ray to the ground; negative if the ray misses it.
fn ground_distance(ray: Ray) -> f32 {
    if (frame.view.ground.exists == 0u || abs(ray.direction.y) < 1e-20) {
        return -1.0;
    }
    let t = (frame.view.ground.height - ray.origin.y) / ray.direction.y;
    let from_middle = abs(ray_at(ray, t) - frame.view.world_origin);
    let hit = t > 0.0 && t < 1e30 && max(from_middle.x, from_middle.z) <= frame.view.ground.half_extent;
    return select(-1.0, t, hit);
}

// Radiance of the ground at a point, per channel, where the given transmittance of the light
// arrives.
fn ground_radiance(point: vec3<f32>, transmittance: f32) -> vec3<f32> {
    let cosine = max(-light_direction_at(point).y, 0.0);
    let direct = irradiance_at(point) * (cosine * transmittance * 0.31830987);
    return frame.view.ground.albedo * (direct + frame.view.ambient);
}
