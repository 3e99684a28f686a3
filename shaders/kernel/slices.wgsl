// A light ray cut into slabs, and the optical depth of each.
#import kernel/density
#import kernel/light

// Slab i lies between depths start + i step and start + (i + 1) step, clipped to enter..exit.
struct Slabs {
    ray: Ray,
    enter: f32,
    exit: f32,
    start: f32,
    step: f32,
    first: u32,
    last: u32,
}

// The slabs of the ray through (u, v): of the ray's own, from entry to exit, or between planes across
// the light's axis that all rays share.
fn slabs_of(u: f32, v: f32) -> Slabs {
    let ray = index_ray_of(light_ray(u, v));
    let inside = intersect_box(ray, frame.domain_min.xyz, frame.domain_max.xyz);
    let extent = inside.y - inside.x;
    if (extent <= 0.0) {
        return Slabs(ray, inside.x, inside.y, inside.x, 0.0, 0u, 0u);
    }
    let planes = frame.counts.y;
    if (planes == 0u) {
        let voxel_lengths = extent * length(ray.direction);
        let count = step_count(voxel_lengths, SLABS_PER_VOXEL, frame.steps.x, frame.steps.y);
        return Slabs(ray, inside.x, inside.y, inside.x, extent / f32(count), 0u, count);
    }
    // How much longer a way along this ray is than along the axis.
    let direction = frame.light_direction + u * frame.light_direction_u + v * frame.light_direction_v;
    let along = length(direction.xyz);
    let start = frame.slices.x * along;
    let step = (frame.slices.y - frame.slices.x) * along / f32(planes);
    let first = min(u32(max((inside.x - start) / step, 0.0)), planes - 1u);
    let last = u32(max(ceil((inside.y - start) / step), 0.0));
    return Slabs(ray, inside.x, inside.y, start, step, first, clamp(last, first + 1u, planes));
}

// Depths of the front and the back of slab i in the volume; empty if the second is not greater.
fn slab_bounds(slabs: Slabs, i: u32) -> vec2<f32> {
    let front = slabs.start + f32(i) * slabs.step;
    let back = slabs.start + f32(i + 1u) * slabs.step;
    return vec2<f32>(max(front, slabs.enter), min(back, slabs.exit));
}

// Optical depth of the ray between two depths: midpoints, as many as its voxels ask for.
fn slab_optical_depth(ray: Ray, bounds: vec2<f32>) -> f32 {
    let extent = bounds.y - bounds.x;
    let voxel_lengths = extent * length(ray.direction);
    let count = clamp(ceil(voxel_lengths * SLAB_SAMPLES_PER_VOXEL - 0.01), 1.0, 65536.0);
    let step = extent / count;
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i < u32(count); i++) {
        sum += sample_density(ray_at(ray, bounds.x + (f32(i) + 0.5) * step));
    }
    return sum * step * frame.domain_min.w;
}
