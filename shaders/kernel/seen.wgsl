// What pixels see of surfaces: for each pixel a list of strands and a list of triangles; and what
// surfaces look like.
#import kernel/heads
#import kernel/tile

// A part of a strand, or a triangle, in a pixel.
struct SeenPart {
    // The point where the segment in the part's middle begins, or a triangle, with a flag.
    what: u32,
    // Distance along the camera's rays: of a strand in its middle, of a triangle where the present ray
    // meets it.
    depth: f32,
    // Of a strand: the share of the way to the next point. Of a triangle: 1 if the pixel's central ray
    // meets it.
    share: f32,
    // Of a strand: the share of light that it takes of each of its cells, and of each of the others.
    alpha: f32,
    rest: f32,
    // Of a strand: the cells of the pixel that it covers. Of a triangle: the rays that meet it.
    low_bits: u32,
    high_bits: u32,
    // Index of the next part of the list plus one.
    next: u32,
    // Of the present ray: index of the layer behind this one plus one, the share of light that the
    // layers in front let through, and the share that this one takes.
    behind: u32,
    clear: f32,
    weight: f32,
    // Radiance per unit of opacity.
    red: f32,
    green: f32,
    blue: f32,
}

// Whether the radiance of a strand is known.
const IS_SHADED: u32 = 0x40000000u;
const WHAT: u32 = 0x3fffffffu;

@group(0) @binding(10) var<storage, read_write> seen: array<SeenPart>;
// The number of a pixel's rays, and for each ray the cells that it stands for, 16 bits a number. For
// each point of a strand: position and radius, direction and opacity, albedo and index of its coat.
// For each triangle: three corners, of which the first has the optical depth of a crossing in w, their
// normals, albedo and index of its coat. For each coat: 1 if shadows fall on it, specular, shininess.
@group(0) @binding(36) var<storage, read> looks: array<vec4<f32>>;

// Numbers of each point and of each triangle.
const OF_POINT: u32 = 3u;
const OF_TRIANGLE: u32 = 7u;

fn ray_count() -> u32 {
    return u32(looks[0].x);
}

fn cells_around(ray: u32) -> vec2<u32> {
    let bits = vec4<u32>(looks[1u + ray]);
    return bits.xz | (bits.yw << vec2<u32>(16u));
}

fn point_look(point: u32, which: u32) -> vec4<f32> {
    return looks[1u + ray_count() + OF_POINT * point + which];
}

fn triangle_look(triangle: u32, which: u32) -> vec4<f32> {
    return looks[1u + ray_count() + OF_POINT * tile.points + OF_TRIANGLE * triangle + which];
}

fn coat_look(coat: f32) -> vec4<f32> {
    let before = OF_POINT * tile.points + OF_TRIANGLE * tile.triangles;
    return looks[1u + ray_count() + before + u32(coat)];
}

// The index of a pixel of the picture in the tile.
fn pixel_in_tile(pixel: vec2<u32>) -> u32 {
    let own = pixel - tile.origin;
    return own.y * tile.extent.x + own.x;
}
