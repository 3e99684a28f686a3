// Media of several bodies: extinctions add up, and the scattered light is the mean of the bodies'
// weighted by extinction. `ray` is in the media's index space; a piece of it extends by `reach`
// before and behind the distance `at`.
#import fields
#import kernel/media
#import kernel/ray

const MIXED: bool = true;

// A grid of numbers.
struct Field {
    index_from_media: array<vec4<f32>, 3>,
    domain_min: vec4<f32>,
    domain_max: vec4<f32>,
    voxel_share: vec4<f32>,
}

// A body.
struct Part {
    albedo: vec4<f32>,
    strength: vec4<f32>,
    transfer: vec4<f32>,
    emission: vec4<f32>,
    fields: vec4<u32>,
}

struct Mixture {
    // x is the number of bodies; the rest is unused.
    counts: vec4<u32>,
    parts: array<Part, MOST_PARTS>,
    fields: array<Field, MOST_FIELDS>,
}

const MOST_PARTS: u32 = 8u;
const MOST_FIELDS: u32 = 8u;
const TABLE_CELLS: u32 = 1024u;
const LEAST_CELLS: f32 = 1.0;
const FARTHEST_CELL: f32 = 16777216.0;

@group(0) @binding(2) var trilinear: sampler;
@group(0) @binding(12) var<uniform> mixture: Mixture;
@group(0) @binding(13) var<storage, read> tables: array<vec4<f32>>;
// The value of a field at a position in the field's own voxel indices.
fn sample_field(field: u32, index: vec3<f32>) -> f32 {
    let place = (index + 0.5) * mixture.fields[field].voxel_share.xyz;
    return stored_number(field, place) * mixture.fields[field].domain_min.w;
}

// The part of a piece that lies in a field: its two ends in the field's indices, and its share of
// the piece's length, 0 if there is none.
struct Inside {
    begin: vec3<f32>,
    end: vec3<f32>,
    share: f32,
}

fn inside(field: u32, ray: Ray, at: f32, reach: f32) -> Inside {
    let rows = mixture.fields[field].index_from_media;
    let own = transformed(ray, rows[0], rows[1], rows[2]);
    let lowest = mixture.fields[field].domain_min.xyz;
    let highest = mixture.fields[field].domain_max.xyz;
    let begin = ray_at(own, at - reach);
    let end = ray_at(own, at + reach);
    if (all(min(begin, end) >= lowest) && all(max(begin, end) <= highest)) {
        return Inside(begin, end, 1.0);
    }
    let ends = intersect_box(own, lowest, highest);
    let enter = max(ends.x, at - reach);
    let exit = min(ends.y, at + reach);
    let share = max((exit - enter) / max(2.0 * reach, SMALLEST_WEIGHT), 0.0);
    return Inside(ray_at(own, enter), ray_at(own, exit), share);
}

// The value of a field in the middle of a piece; 0 outside of the field.
fn field_value(field: u32, ray: Ray, at: f32, reach: f32) -> f32 {
    let part = inside(field, ray, at, reach);
    if (part.share <= 0.0) {
        return 0.0;
    }
    return sample_field(field, 0.5 * (part.begin + part.end));
}

// A position in a table, which is linear over each cell: the function's value there, and its
// integral up to there, in units of cells.
struct TablePlace {
    cell: f32,
    value: vec4<f32>,
    integral: vec4<f32>,
}

fn table_place(table: u32, place: f32) -> TablePlace {
    let cell = clamp(floor(place), -1.0, f32(TABLE_CELLS));
    let first = max(cell, 0.0);
    let value = tables[table + u32(first)];
    let rise = (tables[table + min(u32(cell + 1.0), TABLE_CELLS)] - value) * (place - first);
    let up_to = tables[table + TABLE_CELLS + 1u + u32(first)];
    return TablePlace(cell, value + rise, up_to + (value + 0.5 * rise) * (place - first));
}

// Mean of a table's function between two values: (red, green, blue) times opacity, and opacity.
fn table_mean(header: vec4<f32>, ends: vec2<f32>) -> vec4<f32> {
    let table = u32(header.x);
    let places = clamp((ends - header.z) * header.w, vec2<f32>(-FARTHEST_CELL), vec2<f32>(FARTHEST_CELL));
    let a = table_place(table, places.x);
    let b = table_place(table, places.y);
    let across = places.y - places.x;
    if (abs(across) >= LEAST_CELLS) {
        return (b.integral - a.integral) / across;
    }
    if (a.cell == b.cell) {
        return 0.5 * (a.value + b.value);
    }
    // The edge between the two cells.
    let edge = max(a.cell, b.cell);
    let middle = tables[table + u32(edge)];
    return 0.5 * (middle + a.value + (b.value - a.value) * ((places.y - edge) / across));
}

// A body's part over a piece: (albedo times extinction, extinction), both means over the piece.
fn part_along(i: u32, ray: Ray, at: f32, reach: f32) -> vec4<f32> {
    let fields = mixture.parts[i].fields;
    let part = inside(fields.x, ray, at, reach);
    if (part.share <= 0.0) {
        return vec4<f32>(0.0);
    }
    var classified: vec4<f32>;
    if (mixture.parts[i].transfer.y > 0.0) {
        let ends = vec2<f32>(
            sample_field(fields.x, part.begin),
            sample_field(fields.x, part.end),
        );
        classified = table_mean(mixture.parts[i].transfer, ends);
    } else {
        classified = vec4<f32>(sample_field(fields.x, 0.5 * (part.begin + part.end)));
    }
    var extinction = mixture.parts[i].strength.x * part.share;
    if (!ONE_FIELD && fields.w > 0u) {
        extinction *= field_value(fields.w - 1u, ray, at, reach);
    }
    var albedo = mixture.parts[i].albedo.xyz;
    if (!ONE_FIELD && fields.y > 0u) {
        albedo *= vec3<f32>(
            field_value(fields.y - 1u, ray, at, reach),
            field_value(fields.y, ray, at, reach),
            field_value(fields.y + 1u, ray, at, reach),
        );
    }
    return extinction * classified * vec4<f32>(albedo, 1.0);
}

// A ray in voxel indices, in the space that media are sampled in.
fn media_ray_of(ray: Ray) -> Ray {
    return ray;
}

// Mean extinction over a piece of a ray, 1 / world length.
fn density_along(ray: Ray, at: f32, reach: f32) -> f32 {
    var sum: f32 = 0.0;
    for (var i: u32 = 0u; i < mixture.counts.x; i++) {
        sum += part_along(i, ray, at, reach).w;
    }
    return sum;
}

// The same over four pieces, one after the other: drivers would copy the code for each.
fn four_along(ray: Ray, at: vec4<f32>, reach: vec4<f32>) -> vec4<f32> {
    var means = vec4<f32>(0.0);
    var places = at;
    var halves = reach;
    for (var k: u32 = 0u; k < 4u; k++) {
        means = vec4<f32>(means.yzw, density_along(ray, places.x, halves.x));
        places = places.yzwx;
        halves = halves.yzwx;
    }
    return means;
}

// Radiance that a piece of a ray scatters towards the camera per unit of opacity, where the given
// transmittance of the light arrives.
fn source_along(ray: Ray, at: f32, reach: f32, light: Arriving, transmittance: f32) -> vec3<f32> {
    let more = frame.view.octaves;
    var lit = vec3<f32>(0.0);
    var albedo = vec3<f32>(0.0);
    var extinction: f32 = 0.0;
    for (var i: u32 = 0u; i < mixture.counts.x; i++) {
        let along = part_along(i, ray, at, reach);
        lit += along.xyz * octaves(more, mixture.parts[i].albedo.w, light.cosine, transmittance);
        albedo += along.xyz;
        extinction += along.w;
    }
    return (light.irradiance * lit + frame.view.ambient * albedo) / max(extinction, SMALLEST_WEIGHT);
}

// Radiance that a piece of a ray emits per world length.
fn emission_along(ray: Ray, at: f32, reach: f32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i: u32 = 0u; i < mixture.counts.x; i++) {
        let field = mixture.parts[i].fields.z;
        if (field == 0u) {
            continue;
        }
        let part = inside(field - 1u, ray, at, reach);
        if (part.share > 0.0) {
            let ends = vec2<f32>(
                sample_field(field - 1u, part.begin),
                sample_field(field - 1u, part.end),
            );
            sum += table_mean(mixture.parts[i].emission, ends).xyz
                * (mixture.parts[i].strength.y * part.share);
        }
    }
    return sum;
}
