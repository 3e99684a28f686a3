// A light ray cut into slabs, and the optical depth of each.
#import kernel/light
#import media

// Slab i lies between the depths start + i step and start + (i + 1) step, clipped to enter..exit.
struct Slabs {
    // In the space that media are sampled in.
    ray: Ray,
    enter: f32,
    exit: f32,
    start: f32,
    step: f32,
    first: u32,
    last: u32,
    // Density samples in each slab.
    samples: u32,
}

// The slabs of the ray through (u, v): either equal parts of the ray between its entry and exit, or
// between planes across the light's axis that all rays share.
fn slabs_of(u: f32, v: f32) -> Slabs {
    let ray = index_ray_of(light_ray(u, v));
    let inside = intersect_box(ray, frame.media.domain_min, frame.media.domain_max);
    let sampled = media_ray_of(ray);
    let extent = inside.y - inside.x;
    if (extent <= 0.0) {
        return Slabs(sampled, inside.x, inside.y, inside.x, 0.0, 0u, 0u, 1u);
    }
    let planes = frame.map.planes;
    if (planes == 0u) {
        let voxel_lengths = voxels_over(ray, extent, extent);
        let count = step_count(voxel_lengths, frame.map.slabs.per_voxel, frame.map.slabs.least, frame.map.slabs.most);
        let step = extent / f32(count);
        return Slabs(sampled, inside.x, inside.y, inside.x, step, 0u, count, samples_over(ray, step, extent));
    }
    // How much longer a distance along this ray is than along the light's axis.
    let direction = frame.light.direction + u * frame.light.direction_u + v * frame.light.direction_v;
    let along = length(direction.xyz);
    let start = frame.map.near * along;
    let step = (frame.map.far - frame.map.near) * along / f32(planes);
    let first = min(u32(max((inside.x - start) / step, 0.0)), planes - 1u);
    let last = u32(max(ceil((inside.y - start) / step), 0.0));
    let samples = samples_over(ray, step, extent);
    return Slabs(sampled, inside.x, inside.y, start, step, first, clamp(last, first + 1u, planes), samples);
}

// The number of samples that a step of a ray needs by its voxel lengths. The small subtraction
// keeps rounding from adding one.
fn samples_over(ray: Ray, step: f32, extent: f32) -> u32 {
    let voxel_lengths = voxels_over(ray, step, extent);
    return u32(clamp(ceil(voxel_lengths * frame.map.slabs.samples - 0.01), 1.0, 65536.0));
}

// Depths of the front and the back of slab i, clipped to the volume; the slab is empty if back <=
// front.
fn slab_bounds(slabs: Slabs, i: u32) -> vec2<f32> {
    let front = slabs.start + f32(i) * slabs.step;
    let back = slabs.start + f32(i + 1u) * slabs.step;
    return vec2<f32>(max(front, slabs.enter), min(back, slabs.exit));
}

// Optical depth of slab i, by the midpoint rule.
fn slab_optical_depth(slabs: Slabs, i: u32) -> f32 {
    let bounds = slab_bounds(slabs, i);
    let step = max(bounds.y - bounds.x, 0.0) / f32(slabs.samples);
    var sum: f32 = 0.0;
    for (var s: u32 = 0u; s < slabs.samples; s++) {
        sum += density_along(slabs.ray, bounds.x + (f32(s) + 0.5) * step, 0.5 * step);
    }
    return sum * step * frame.media.extinction;
}

// The depths where the four slabs of a batch begin and end, clipped to the volume.
struct Batch {
    fronts: vec4<f32>,
    backs: vec4<f32>,
    // Where the last slab ends, not clipped.
    end: f32,
    // With planes: index of the slab that follows the batch.
    next: f32,
}

// Four slabs of length `step` from depth t on. With planes: the four from the slab that contains t
// on, but none in front of slab `next`.
fn batch_of(slabs: Slabs, t: f32, step: f32, next: f32) -> Batch {
    let planes = frame.map.planes > 0u;
    let start = select(t, slabs.start, planes);
    // Rounding must not skip a slab; one too many is empty.
    let holds = floor((t - slabs.start) / slabs.step - 1e-3);
    let first = select(0.0, max(holds, next), planes);
    let length = select(step, slabs.step, planes);
    let fronts = start + (first + vec4<f32>(0.0, 1.0, 2.0, 3.0)) * length;
    let backs = start + (first + vec4<f32>(1.0, 2.0, 3.0, 4.0)) * length;
    let inside = min(backs, vec4<f32>(slabs.exit));
    return Batch(max(fronts, vec4<f32>(slabs.enter)), inside, backs.w, first + 4.0);
}

// Optical depths of a batch's slabs. The passes wait for samples more than they compute, so four
// samples are fetched at once.
fn four_optical_depths(slabs: Slabs, batch: Batch) -> vec4<f32> {
    let steps = max(batch.backs - batch.fronts, vec4<f32>(0.0)) / f32(slabs.samples);
    var sums = vec4<f32>(0.0);
    for (var s: u32 = 0u; s < slabs.samples; s++) {
        let at = batch.fronts + (f32(s) + 0.5) * steps;
        sums += four_along(slabs.ray, at, 0.5 * steps);
    }
    return sums * steps * frame.media.extinction;
}

// Optical depth of a slab as long as the last one of a batch, with the density found at its end.
fn end_optical_depth(slabs: Slabs, batch: Batch) -> f32 {
    let step = max(batch.backs.w - batch.fronts.w, 0.0);
    let half = 0.5 * step / f32(slabs.samples);
    return density_along(slabs.ray, batch.backs.w, half) * (step * frame.media.extinction);
}
