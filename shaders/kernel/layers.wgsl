// Pass shade_view: surfaces along a camera ray as layers in order of distance, lit through the map,
// with the medium between them (src/cpu/layers.rs, src/cpu/shade_view.rs).
#import kernel/seen
#import kernel/surface
#import kernel/triangle

const AMONG_SURFACES: bool = true;
// Surfaces hide the ground up to this share of its distance behind it.
const ON_GROUND: f32 = 1e-5;
const UNMET: f32 = 3e38;
// Strands share a lookup that together take less than so many times what counts as nothing.
const SHARED: f32 = 8.0;
// The ray in a pixel's middle, among the rays that meet triangles.
const CENTRAL: u32 = 0xffffffffu;
const NO_TRIANGLE: u32 = 0xffffffffu;

// What is left of the light in each of a pixel's cells, four by four.
var<private> left_in_cells: array<vec4<f32>, 16>;
// What the ray's layers let through.
var<private> clear_behind: f32;
// The first layer that does not lie in front of the present step, and the first whose light has not
// been added.
var<private> layer_ahead: u32;
var<private> layer_unseen: u32;

// Transmittances per channel where that of the least extinct one is `through`.
fn channels(through: f32) -> vec3<f32> {
    if (COLOURED && through > 0.0) {
        return colours(through);
    }
    return vec3<f32>(through);
}

// Takes a share of what is left in each of some cells, and returns the sum. Without a loop, of which
// software drivers allow only so many turns.
fn take(bits: vec2<u32>, alpha: f32) -> f32 {
    let taken = take_four(0u, bits.x, alpha)
        + take_four(1u, bits.x >> 4u, alpha)
        + take_four(2u, bits.x >> 8u, alpha)
        + take_four(3u, bits.x >> 12u, alpha)
        + take_four(4u, bits.x >> 16u, alpha)
        + take_four(5u, bits.x >> 20u, alpha)
        + take_four(6u, bits.x >> 24u, alpha)
        + take_four(7u, bits.x >> 28u, alpha)
        + take_four(8u, bits.y, alpha)
        + take_four(9u, bits.y >> 4u, alpha)
        + take_four(10u, bits.y >> 8u, alpha)
        + take_four(11u, bits.y >> 12u, alpha)
        + take_four(12u, bits.y >> 16u, alpha)
        + take_four(13u, bits.y >> 20u, alpha)
        + take_four(14u, bits.y >> 24u, alpha)
        + take_four(15u, bits.y >> 28u, alpha);
    return taken.x + taken.y + taken.z + taken.w;
}

// The same for four cells, of which the lowest bits say which.
fn take_four(four: u32, bits: u32, alpha: f32) -> vec4<f32> {
    if ((bits & 15u) == 0u) {
        return vec4<f32>(0.0);
    }
    let own = vec4<f32>((vec4<u32>(bits) >> vec4<u32>(0u, 1u, 2u, 3u)) & vec4<u32>(1u));
    let left = left_in_cells[four];
    left_in_cells[four] = left * (1.0 - alpha * own);
    return alpha * own * left;
}

fn triangle_corners(triangle: u32) -> array<vec3<f32>, 3> {
    return array<vec3<f32>, 3>(
        triangle_look(triangle, 0u).xyz,
        triangle_look(triangle, 1u).xyz,
        triangle_look(triangle, 2u).xyz,
    );
}

// A triangle that a ray meets.
struct Hit {
    // Index of its part plus one; 0 for none.
    part: u32,
    triangle: u32,
    depth: f32,
}

// The first of a list of triangles that a ray meets behind another. Those of one depth are in order
// of their numbers.
fn hit_behind(list: u32, which: u32, ray: Ray, last: Hit) -> Hit {
    var found = Hit(0u, NO_TRIANGLE, UNMET);
    for (var at = list; at != 0u; at = seen[at - 1u].next) {
        let part = seen[at - 1u];
        let bits = select(part.low_bits, part.high_bits, which > 31u);
        let is_met = select((bits >> (which & 31u)) & 1u, u32(part.share), which == CENTRAL);
        if (is_met == 0u) {
            continue;
        }
        let triangle = part.what & WHAT;
        let own = triangle_corners(triangle);
        let depth = plane_depth(own[0], cross(own[1] - own[0], own[2] - own[0]), ray);
        let is_behind = depth > last.depth || (depth == last.depth && triangle > last.triangle);
        let is_first = depth < found.depth || (depth == found.depth && triangle < found.triangle);
        if (depth >= 0.0 && (last.part == 0u || is_behind) && is_first) {
            found = Hit(at, triangle, depth);
        }
    }
    return found;
}

// Chains the layers of a ray in front of `end`, lit. `cells` are those that it stands for. Returns
// where nothing behind is seen.
fn find_layers(strands: u32, triangles: u32, which: u32, ray: Ray, cells: vec2<u32>, end: f32) -> f32 {
    for (var four = 0u; four < 16u; four++) {
        left_in_cells[four] = vec4<f32>(1.0);
    }
    let share = 1.0 / f32(countOneBits(cells.x) + countOneBits(cells.y));
    var clear: f32 = 1.0;
    var last = 0u;
    var strand = strands;
    var hit = Hit(0u, 0u, 0.0);
    var is_passed = true;
    shared_shadow = vec3<f32>(1.0);
    // What strands have taken since a shadow was looked up.
    var since = UNMET;
    // As much as is left behind them can be seen.
    while (clear >= frame.view.opaque) {
        if (is_passed) {
            hit = hit_behind(triangles, which, ray, hit);
            is_passed = false;
        }
        var of_strand = UNMET;
        if (strand != 0u) {
            of_strand = seen[strand - 1u].depth;
        }
        // A surface on the ground hides it, whatever rounding says.
        if (min(of_strand, hit.depth) >= end * (1.0 + ON_GROUND)) {
            break;
        }
        var own = hit.part;
        var weight: f32;
        // Chromium 156 does not empty a variable that is declared in a loop without a value.
        var coming = Coming();
        if (of_strand <= hit.depth) {
            own = strand;
            let part = seen[own - 1u];
            strand = part.next;
            let bits = vec2<u32>(part.low_bits, part.high_bits);
            weight = take(bits & cells, part.alpha) * share;
            if (part.rest > 0.0) {
                weight += take(~bits & cells, part.rest) * share;
            }
            if (weight <= 0.0) {
                continue;
            }
            since += weight;
            if ((part.what & IS_SHADED) == 0u) {
                coming = coming_to_strand(part, ray.direction);
                coming.is_own = since >= SHARED * frame.view.opaque;
                // With a shadow of its own it is lit for all rays of the pixel.
                if (coming.is_own) {
                    since = 0.0;
                    seen[own - 1u].what = part.what | IS_SHADED;
                }
            }
        } else {
            is_passed = true;
            seen[own - 1u].depth = hit.depth;
            coming = coming_to_triangle(hit, ray);
            weight = take(cells, coming.alpha) * share;
        }
        if (coming.exists) {
            let radiance = arriving_on(coming) + coming.albedo * frame.view.ambient;
            seen[own - 1u].red = radiance.x;
            seen[own - 1u].green = radiance.y;
            seen[own - 1u].blue = radiance.z;
        }
        seen[own - 1u].clear = clear;
        seen[own - 1u].weight = weight;
        seen[own - 1u].behind = 0u;
        if (last == 0u) {
            layer_ahead = own;
        } else {
            seen[last - 1u].behind = own;
        }
        last = own;
        clear -= weight;
    }
    clear_behind = clear;
    layer_unseen = layer_ahead;
    if (clear >= frame.view.opaque) {
        return end;
    }
    clear_behind = 0.0;
    return seen[last - 1u].depth;
}

// The light that comes to a part of a strand.
fn coming_to_strand(part: SeenPart, direction: vec3<f32>) -> Coming {
    let a = part.what & WHAT;
    let place = mix(point_look(a, 0u), point_look(a + 1u, 0u), part.share);
    let along = mix(point_look(a, 1u).xyz, point_look(a + 1u, 1u).xyz, part.share);
    let first = point_look(a, 2u);
    let albedo = mix(first.xyz, point_look(a + 1u, 2u).xyz, part.share);
    let coat = coat_look(first.w);
    let tangent = along / max(length(along), 1e-30);
    let to_light = -light_direction_at(place.xyz);
    let off = within(place.xyz, max(frame.map.bias, OFF_RADII * place.w));
    let reflected = strand_reflectance(tangent, to_light, -direction, albedo, coat.y, coat.z);
    return Coming(true, place.xyz, place.xyz + off * to_light, reflected, albedo, coat.x, 0.0, true);
}

// The light that comes to a triangle where a ray meets it.
fn coming_to_triangle(hit: Hit, ray: Ray) -> Coming {
    let corners = triangle_corners(hit.triangle);
    let across = cross(corners[1] - corners[0], corners[2] - corners[0]);
    var plane = across / max(length(across), 1e-30);
    plane = select(plane, -plane, dot(plane, ray.direction) > 0.0);
    let position = ray_at(ray, hit.depth);
    let weights = corner_weights(corners, position);
    let normals = array<vec3<f32>, 3>(
        triangle_look(hit.triangle, 3u).xyz,
        triangle_look(hit.triangle, 4u).xyz,
        triangle_look(hit.triangle, 5u).xyz,
    );
    let mean = normals[0] * weights.x + normals[1] * weights.y + normals[2] * weights.z;
    let size = length(mean);
    var normal = plane;
    if (size > 1e-30) {
        normal = mean / size;
    }
    // Both sides are alike.
    let side = select(1.0, -1.0, dot(normal, plane) < 0.0);
    let outwards = array<vec3<f32>, 3>(side * normals[0], side * normals[1], side * normals[2]);
    let smoothed = smooth_place(corners, outwards, weights, position);
    let look = triangle_look(hit.triangle, 6u);
    let to_light = -light_direction_at(position);
    let reflected = look.xyz * triangle_reflectance(side * normal, to_light);
    let off = off_plane(position, plane, to_light) * plane;
    let bias = within(position, frame.map.bias) * to_light;
    let alpha = 1.0 - exp(-triangle_look(hit.triangle, 0u).w);
    let place = smoothed + off + bias;
    return Coming(true, position, place, reflected, look.xyz, coat_look(look.w).x, alpha, true);
}

// The light of a layer, of which layers in front and the medium's transmittances let a share through.
fn layer_light(layer: u32, medium: vec3<f32>) -> vec3<f32> {
    let part = seen[layer - 1u];
    return medium * vec3<f32>(part.red, part.green, part.blue) * part.weight;
}

fn clear_at(layer: u32) -> f32 {
    if (layer == 0u) {
        return clear_behind;
    }
    return seen[layer - 1u].clear;
}

// What the camera sees of a piece of the medium between two distances, which sends `radiance` and
// takes the share `weight` of the ray's light, of which `through` arrives there; and of the layers in
// it, if it takes any.
fn among_layers(part: vec2<f32>, weight: f32, through: f32, radiance: vec3<f32>) -> vec3<f32> {
    while (layer_ahead != 0u && seen[layer_ahead - 1u].depth < part.x) {
        layer_ahead = seen[layer_ahead - 1u].behind;
    }
    // The medium's light is dimmed by the layers in front of it.
    var at = part.x;
    var visible: f32 = 0.0;
    var layer = layer_ahead;
    while (layer != 0u && seen[layer - 1u].depth < part.y) {
        let depth = seen[layer - 1u].depth;
        visible += seen[layer - 1u].clear * (depth - at);
        at = depth;
        layer = seen[layer - 1u].behind;
    }
    visible = (visible + clear_at(layer) * (part.y - at)) / max(part.y - part.x, 1e-30);
    var light = visible * radiance;
    if (weight <= 0.0) {
        return light;
    }
    // Layers are dimmed by the medium in front of them.
    let kept = max(1.0 - weight / max(through, 1e-30), 1e-30);
    while (layer_unseen != 0u && seen[layer_unseen - 1u].depth < part.y) {
        let share = clamp((seen[layer_unseen - 1u].depth - part.x) / (part.y - part.x), 0.0, 1.0);
        light += layer_light(layer_unseen, channels(through * pow(kept, share)));
        layer_unseen = seen[layer_unseen - 1u].behind;
    }
    return light;
}

// What a batch of steps adds among layers; `emission` is what its samples emit.
fn lit_among_layers(
    ray: Ray,
    steps: Steps,
    lookups: Ray,
    arrives: Arriving,
    batch: Batch,
    added: Scattered,
    through: f32,
    emission: vec3<f32>,
) -> vec3<f32> {
    let ahead = layer_ahead;
    var light = vec3<f32>(0.0);
    var before = through;
    var front: f32 = 0.0;
    for (var k = 0u; k < 4u; k++) {
        let weight = added.weights[k];
        if (weight <= 0.0) {
            continue;
        }
        let count = f32(shared_steps(added.weights, k));
        var radiance: vec3<f32>;
        if (COLOURED) {
            radiance = lit_colours(ray, steps, lookups, arrives, batch, added, through, k);
        } else {
            let at = added.places[k];
            let reach = 0.5 * batch.step * count;
            let transmittance = shadow_lookup(light_place(ray, lookups, at));
            let own = arriving_at(ray, arrives, at, reach);
            radiance = weight * source_along(steps.ray, at, reach, own, transmittance);
        }
        let back = f32(k) + count;
        let part = batch.begin + vec2<f32>(front, back) * batch.step;
        light += among_layers(part, weight, before, radiance);
        before -= weight;
        front = back;
    }
    if (any(emission > vec3<f32>(0.0))) {
        layer_ahead = ahead;
        let part = batch.begin + vec2<f32>(0.0, BATCH) * batch.step;
        light += among_layers(part, 0.0, through, emission);
    }
    return light;
}

// The radiance and opacity of a ray: of the medium, which sends `scattered` (w: what it lets
// through), of the layers behind it, and of what is behind both.
fn with_layers(scattered: vec4<f32>, ray: Ray, ground: f32) -> vec4<f32> {
    let medium = channels(scattered.w);
    var light = scattered.xyz;
    while (layer_unseen != 0u) {
        light += layer_light(layer_unseen, medium);
        layer_unseen = seen[layer_unseen - 1u].behind;
    }
    let through = clear_behind * medium;
    var behind = vec4<f32>(0.0);
    if (any(through > vec3<f32>(0.0))) {
        behind = behind_all(ray, ground);
    }
    let covered = 1.0 - dot(through, vec3<f32>(1.0 / 3.0));
    return vec4<f32>(light + through * behind.xyz, covered + (1.0 - covered) * behind.w);
}

// Whether a row of a dispatch is one of the tile's, which may have fewer than whole workgroups.
fn is_in_part(row: u32) -> bool {
    return row < tile.extent.y;
}

// Whether the picture of one ray a pixel holds all rays of a pixel already.
fn is_complete(place: vec2<u32>) -> bool {
    let own = rays_of(place, 1u);
    return own.sees && own.rays == ray_count();
}

// How a pixel is seen: with all its rays where it sees surfaces, but where one sees what the others
// do and only one is asked for.
fn rays_of(place: vec2<u32>, samples: u32) -> PixelRays {
    let lists = 2u * pixel_in_tile(place);
    let strands = atomicLoad(&heads[lists]);
    let triangles = atomicLoad(&heads[lists + 1u]);
    let all = ray_count();
    if (strands != 0u) {
        return PixelRays(true, all, strands, triangles);
    }
    var first = NO_TRIANGLE;
    var is_met = false;
    var is_same = true;
    for (var i = 0u; i < all && triangles != 0u; i++) {
        let ray = ray_within(place, i, all);
        let triangle = hit_behind(triangles, i, ray, Hit(0u, 0u, 0.0)).triangle;
        if (i == 0u) {
            first = triangle;
        }
        is_met = is_met || triangle != NO_TRIANGLE;
        is_same = is_same && triangle == first;
    }
    let rays = select(all, 1u, is_same && samples < all);
    return PixelRays(is_met, select(samples, rays, is_met), strands, triangles);
}

// Chains the layers of ray `i` of a pixel in front of `farthest`. Returns where nothing behind is
// seen, and how much of the pixel the ray stands for.
fn layers_of(pixel: PixelRays, i: u32, ray: Ray, farthest: f32) -> vec2<f32> {
    layer_ahead = 0u;
    layer_unseen = 0u;
    clear_behind = 1.0;
    if (!pixel.sees) {
        return vec2<f32>(farthest, 1.0);
    }
    var cells = vec2<u32>(0xffffffffu);
    var which = CENTRAL;
    if (pixel.rays == ray_count()) {
        cells = cells_around(i);
        which = i;
    }
    let end = find_layers(pixel.strands, pixel.triangles, which, ray, cells, farthest);
    return vec2<f32>(end, f32(countOneBits(cells.x) + countOneBits(cells.y)));
}
