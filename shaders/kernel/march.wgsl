// Marches camera rays through the volume, lights each step through the shadow map, and continues to
// the ground or the background.
#import kernel/light
#import kernel/medium
#import kernel/occupancy
#import kernel/ray
#import kernel/shadow
#import kernel/view
#import layers
#import media

// The part of a camera ray inside the volume, cut into steps.
struct Steps {
    // The ray in the space that media are sampled in.
    ray: Ray,
    enter: f32,
    exit: f32,
    // The number of steps if all had the shortest length.
    count: u32,
}

fn steps_of(ray: Ray, farthest: f32) -> Steps {
    let index_ray = index_ray_of(ray);
    let media_ray = media_ray_of(index_ray);
    let inside = intersect_box(index_ray, frame.media.domain_min, frame.media.domain_max);
    let extent = min(inside.y, farthest) - inside.x;
    if (extent <= 0.0) {
        return Steps(media_ray, inside.x, inside.x, 1u);
    }
    let voxel_lengths = voxels_over(index_ray, extent, extent);
    let count = step_count(voxel_lengths, frame.view.march.per_voxel, frame.view.march.least, frame.view.march.most);
    return Steps(media_ray, inside.x, inside.x + extent, count);
}

// Four steps of equal length along a ray in the space that media are sampled in, with two density
// samples each.
struct Batch {
    ray: Ray,
    begin: f32,
    step: f32,
}

// Distance of sample k, 0 to 7; k may lie between two samples.
fn sample_distance(batch: Batch, k: f32) -> f32 {
    return batch.begin + (0.25 + 0.5 * k) * batch.step;
}

// Optical depths of samples `first` to `first` + 3.
fn four_samples(batch: Batch, first: f32) -> vec4<f32> {
    let at = batch.begin + (0.25 + 0.5 * (first + vec4<f32>(0.0, 1.0, 2.0, 3.0))) * batch.step;
    let densities = four_along(batch.ray, at, vec4<f32>(0.25 * batch.step));
    return densities * (frame.media.extinction * (0.5 * batch.step));
}

// Radiance that the samples emit and that reaches the camera, attenuated by the samples in front of
// each. `before` is the transmittance from the camera to the first sample.
fn emitted(batch: Batch, early: vec4<f32>, late: vec4<f32>, before: f32) -> vec3<f32> {
    let reach = 0.25 * batch.step;
    var sum = vec3<f32>(0.0);
    var through = before;
    for (var k: u32 = 0u; k < 8u; k++) {
        let tau = select(early[k & 3u], late[k & 3u], k > 3u);
        let seen = through * mean_transmittance(tau) * 2.0 * reach;
        sum += emission_along(batch.ray, sample_distance(batch, f32(k)), reach) * seen;
        through *= exp(-tau);
    }
    return sum;
}

// Transmittances of the channels where that of the least extinct one is `through`.
fn colours(through: f32) -> vec3<f32> {
    return pow(vec3<f32>(max(through, 1e-30)), frame.media.ratios);
}

// The same as `emitted` for each channel.
fn emitted_colours(batch: Batch, early: vec4<f32>, late: vec4<f32>, before: f32) -> vec3<f32> {
    let reach = 0.25 * batch.step;
    var sum = vec3<f32>(0.0);
    var through = colours(before);
    for (var k: u32 = 0u; k < 8u; k++) {
        let tau = select(early[k & 3u], late[k & 3u], k > 3u) * frame.media.ratios;
        let mean = vec3<f32>(
            mean_transmittance(tau.x),
            mean_transmittance(tau.y),
            mean_transmittance(tau.z),
        );
        sum += emission_along(batch.ray, sample_distance(batch, f32(k)), reach)
            * through * mean * (2.0 * reach);
        through *= exp(-tau);
    }
    return sum;
}

// For parallel light, points of a ray lie on a ray in the map's (u, v, depth) as well: this one.
fn light_coordinates_of(ray: Ray) -> Ray {
    let d = vec4<f32>(ray.direction, 0.0);
    let rows = frame.light.from_frame;
    return Ray(light_coordinates(ray.origin), vec3<f32>(dot(rows[0], d), dot(rows[1], d), dot(rows[2], d)));
}

// (u, v, depth) in the map of the point of a ray at distance `at`. For parallel light it lies on
// `lookups`, from light_coordinates_of.
fn light_place(ray: Ray, lookups: Ray, at: f32) -> vec3<f32> {
    if (USUAL) {
        return ray_at(lookups, at);
    }
    return light_coordinates(ray_at(ray, at));
}

// Light that arrives over a piece of a ray; for parallel light it is `anywhere`, the same at every
// point.
fn arriving_at(ray: Ray, anywhere: Arriving, at: f32, reach: f32) -> Arriving {
    if (USUAL || frame.light.spread == 0u) {
        return anywhere;
    }
    return arriving_over(ray, at, reach);
}

// Radiance that step k of a batch scatters towards the camera, in channels of different extinction.
fn lit_colours(
    ray: Ray,
    steps: Steps,
    lookups: Ray,
    arrives: Arriving,
    batch: Batch,
    added: Scattered,
    through: f32,
    k: u32,
) -> vec3<f32> {
    let weight = added.weights[k];
    if (weight <= 0.0) {
        return vec3<f32>(0.0);
    }
    // What the steps in front take.
    let front = dot(added.weights, vec4<f32>(vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(k)));
    let before = through - front;
    let share = colours(before) - colours(before - weight);
    let at = added.places[k];
    let reach = 0.5 * batch.step * f32(shared_steps(added.weights, k));
    let transmittances = shadow_lookup_colours(light_place(ray, lookups, at));
    let light = arriving_at(ray, arrives, at, reach);
    if (!USUAL && frame.view.octaves > 0u) {
        return share * vec3<f32>(
            source_along(steps.ray, at, reach, light, transmittances.x).x,
            source_along(steps.ray, at, reach, light, transmittances.y).y,
            source_along(steps.ray, at, reach, light, transmittances.z).z,
        );
    }
    // Single scattering is linear in transmittance.
    let dark = source_along(steps.ray, at, reach, light, 0.0);
    let lit = source_along(steps.ray, at, reach, light, 1.0);
    return share * (dark + transmittances * (lit - dark));
}

// Radiance scattered towards the camera by steps k and k + 2 of a batch. Their two shadow lookups
// are fetched at once. A step with weight 0 has no light sample, so it repeats the other step's
// lookup.
fn lit_pair(
    ray: Ray,
    steps: Steps,
    lookups: Ray,
    arrives: Arriving,
    batch: Batch,
    added: Scattered,
    k: u32,
) -> vec3<f32> {
    let weights = select(added.weights.xz, added.weights.yw, k == 1u);
    if (weights.x + weights.y <= 0.0) {
        return vec3<f32>(0.0);
    }
    let held = select(added.places.xz, added.places.yw, k == 1u);
    let places = select(held.yx, held, weights > vec2<f32>(0.0));
    let transmittances = vec2<f32>(
        shadow_lookup(light_place(ray, lookups, places.x)),
        shadow_lookup(light_place(ray, lookups, places.y)),
    );
    let reaches = 0.5 * batch.step * vec2<f32>(
        f32(shared_steps(added.weights, k)),
        f32(shared_steps(added.weights, k + 2u)),
    );
    let near = arriving_at(ray, arrives, places.x, reaches.x);
    let far = arriving_at(ray, arrives, places.y, reaches.y);
    return weights.x * source_along(steps.ray, places.x, reaches.x, near, transmittances.x)
        + weights.y * source_along(steps.ray, places.y, reaches.y, far, transmittances.y);
}

// Radiance scattered towards the camera, and the transmittance of the whole ray. Each step takes
// two density samples, and eight of them are fetched at once. Each step, or several together that
// add little, takes one light sample at the weighted mean position of its density samples.
fn single_scattering(ray: Ray, steps: Steps) -> vec4<f32> {
    let emits = frame.media.emits == 1u;
    let arrives = arriving(ray, ray.origin);
    let lookups = light_coordinates_of(ray);
    var light = vec3<f32>(0.0);
    var through: f32 = 1.0;
    let shortest = (steps.exit - steps.enter) / f32(steps.count);
    let lengths = vec3<f32>(shortest, frame.view.march.rough, frame.view.march.longest);
    var walk = walk_of(steps.ray, steps.exit, lengths);
    var t = steps.enter;
    while (through >= frame.view.opaque) {
        // Called in one place only: the pass took a tenth longer with a call in front of the loop
        // and another at its end.
        t = next_place(&walk, t);
        if (!(t < steps.exit)) {
            break;
        }
        var batch = Batch(steps.ray, t, step_from(walk, t));
        var early = vec4<f32>(0.0);
        var late = vec4<f32>(0.0);
        var limit = frame.view.march.limit;
        // In a dense medium, shorten the steps until no sample is thicker than the limit. Density is
        // sampled in one place only, because drivers copy the code of media to each.
        loop {
            early = four_samples(batch, 0.0);
            late = four_samples(batch, 4.0);
            let most = max(early, late);
            var thickest = max(max(most.x, most.y), max(most.z, most.w));
            if (batch.step > frame.view.march.hiding) {
                let end = density_along(batch.ray, t + BATCH * batch.step, 0.25 * batch.step);
                thickest = max(thickest, end * (frame.media.extinction * (0.5 * batch.step)));
            }
            let visible = thickest * sqrt(through);
            if (visible <= limit) {
                break;
            }
            limit = CUT_LIMIT * frame.view.march.limit;
            let shorter = cut(walk, batch.step, CUT_SHARE * frame.view.march.limit / visible);
            if (shorter >= batch.step) {
                break;
            }
            batch.step = shorter;
        }
        let first = sample_distance(batch, 0.0);
        let added = scattered(through, early, late, first, 0.5 * batch.step);
        if (AMONG_SURFACES) {
            var emission = vec3<f32>(0.0);
            if (MIXED && emits) {
                if (COLOURED) {
                    emission = emitted_colours(batch, early, late, through);
                } else {
                    emission = emitted(batch, early, late, through);
                }
            }
            light += lit_among_layers(ray, steps, lookups, arrives, batch, added, through, emission);
            through = added.through;
            t += BATCH * batch.step;
            continue;
        }
        // Unrolling the two pairs makes views through lists up to a tenth faster, and views through
        // curves as much slower; for other settings it takes twice as long to compile.
        if (COLOURED) {
            for (var k: u32 = 0u; k < 4u; k++) {
                light += lit_colours(ray, steps, lookups, arrives, batch, added, through, k);
            }
        } else if (LISTS && USUAL) {
            light += lit_pair(ray, steps, lookups, arrives, batch, added, 0u);
            light += lit_pair(ray, steps, lookups, arrives, batch, added, 1u);
        } else {
            for (var k: u32 = 0u; k < 2u; k++) {
                light += lit_pair(ray, steps, lookups, arrives, batch, added, k);
            }
        }
        if (MIXED && emits) {
            if (COLOURED) {
                light += emitted_colours(batch, early, late, through);
            } else {
                light += emitted(batch, early, late, through);
            }
        }
        through = added.through;
        t += BATCH * batch.step;
    }
    return vec4<f32>(light, select(0.0, through, through >= frame.view.opaque));
}

// The paper's shading: accumulates the sampled value without shadows, then darkens it by the plain
// average of the opacities looked up at equal distances along the ray.
fn paper_shading(ray: Ray, steps: Steps) -> vec4<f32> {
    let extent = steps.exit - steps.enter;
    if (extent <= 0.0) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let step = extent / f32(steps.count);
    let extinction_step = frame.media.extinction * step;
    let brightest = max(frame.media.largest, 1e-30);
    var colour: f32 = 0.0;
    var through: f32 = 1.0;
    for (var i: u32 = 0u; i < steps.count; i++) {
        let t = steps.enter + (f32(i) + 0.5) * step;
        let density = density_along(steps.ray, t, 0.5 * step);
        let opacity = step_opacity(density * extinction_step);
        colour += through * opacity * (density / brightest);
        through *= 1.0 - opacity;
    }
    let lookups = frame.view.light_samples;
    var shadow: f32 = 0.0;
    for (var i: u32 = 0u; i < lookups; i++) {
        let t = steps.enter + (f32(i) + 0.5) / f32(lookups) * extent;
        shadow += 1.0 - shadow_lookup(light_coordinates(ray_at(ray, t)));
    }
    return vec4<f32>(vec3<f32>(colour * (1.0 - shadow / f32(lookups))), through);
}

// Radiance of the ground at a point, in channels of different extinction.
fn lit_ground_of_colours(point: vec3<f32>) -> vec3<f32> {
    let light = light_coordinates(point);
    let transmittances = shadow_lookup_colours(vec3<f32>(light.xy, surface_depth(light)));
    let dark = ground_radiance(point, 0.0);
    return dark + transmittances * (ground_radiance(point, 1.0) - dark);
}

// The ground, if its distance is above 0, or the background.
fn behind_all(ray: Ray, ground: f32) -> vec4<f32> {
    if (ground <= 0.0) {
        return frame.view.background;
    }
    let point = ray_at(ray, ground);
    if (COLOURED) {
        return vec4<f32>(lit_ground_of_colours(point), 1.0);
    }
    let light = light_coordinates(point);
    let transmittance = shadow_lookup(vec3<f32>(light.xy, surface_depth(light)));
    return vec4<f32>(ground_radiance(point, transmittance), 1.0);
}

// What ray `i` of a pixel sees, and how much of the pixel it stands for.
fn march(ray: Ray, pixel: PixelRays, i: u32) -> RayColour {
    let ground = ground_distance(ray);
    let ends = layers_of(pixel, i, ray, select(1e30, ground, ground > 0.0));
    let steps = steps_of(ray, ends.x);
    var seen: vec4<f32>;
    if (!AMONG_SURFACES && !USUAL && frame.view.shading == 1u) {
        seen = paper_shading(ray, steps);
    } else {
        seen = single_scattering(ray, steps);
    }
    if (AMONG_SURFACES) {
        return RayColour(with_layers(seen, ray, ground), ends.y);
    }
    let behind = behind_all(ray, ground);
    if (COLOURED) {
        let through = select(vec3<f32>(0.0), colours(seen.w), seen.w > 0.0);
        let covered = 1.0 - dot(through, vec3<f32>(1.0 / 3.0));
        let light = seen.xyz + through * behind.xyz;
        return RayColour(vec4<f32>(light, covered + (1.0 - covered) * behind.w), ends.y);
    }
    return RayColour(vec4<f32>(seen.xyz, 1.0 - seen.w) + seen.w * behind, ends.y);
}

struct RayColour {
    colour: vec4<f32>,
    weight: f32,
}

// How a pixel is seen: whether it sees surfaces, with how many rays, and the lists of its strands and
// triangles.
struct PixelRays {
    sees: bool,
    rays: u32,
    strands: u32,
    triangles: u32,
}

// The ray through sample i of a pixel.
fn ray_within(place: vec2<u32>, i: u32, samples: u32) -> Ray {
    let size = vec2<f32>(f32(frame.view.width), f32(frame.view.height));
    let at = (vec2<f32>(place) + pixel_offset(i, samples)) / size;
    return camera_ray(at.x, at.y);
}

// The pixel (x, y), with a number of rays.
fn pixel(place: vec2<u32>, samples: u32) -> vec4<f32> {
    let own = rays_of(place, samples);
    var sum = vec4<f32>(0.0);
    var weights: f32 = 0.0;
    for (var i: u32 = 0u; i < own.rays; i++) {
        let marched = march(ray_within(place, i, own.rays), own, i);
        sum += marched.weight * marched.colour;
        weights += marched.weight;
    }
    return sum / weights;
}
