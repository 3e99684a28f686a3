// Steps of a ray that need not be taken, because they lie in empty bricks.
#import kernel/frame
#import kernel/ray

// For each brick how many bricks it is to the next one that holds anything, along any axis: 0 if it does.
@group(0) @binding(22) var distances: texture_3d<u32>;

// A ray in index space cut into equal steps, of which those in empty bricks are jumped over.
struct Walk {
    ray: Ray,
    // One over its direction, bricks and not voxels.
    inverse: vec3<f32>,
    enter: f32,
    step: f32,
    // Up to here along the ray nothing changes.
    end: f32,
}

fn walk_of(ray: Ray, enter: f32, step: f32) -> Walk {
    let direction = ray.direction / frame.bricks.w;
    let tiny = vec3<f32>(1e-30);
    let inverse = 1.0 / select(direction, tiny, abs(direction) < tiny);
    return Walk(ray, inverse, enter, step, -3e38);
}

// Whether the brick at distance t is empty; the walk's end becomes where the ray leaves it, or the empty
// block around it.
fn look(walk: ptr<function, Walk>, t: f32) -> bool {
    let place = (ray_at((*walk).ray, t) - frame.bricks.xyz) / frame.bricks.w;
    let last = vec3<f32>(textureDimensions(distances) - 1u);
    let brick = clamp(floor(place), vec3<f32>(0.0), last);
    let distance = textureLoad(distances, vec3<u32>(brick), 0).x;
    let around = f32(max(distance, 1u) - 1u);
    let border = select(brick - around, brick + (1.0 + around), (*walk).inverse > vec3<f32>(0.0));
    let left = (border - place) * (*walk).inverse;
    (*walk).end = t + max(min(left.x, min(left.y, left.z)), 0.0);
    return distance > 0u;
}

// The first step from i on that may hold anything; `count` or more if none before does.
fn next_step(walk: ptr<function, Walk>, first: u32, count: u32) -> u32 {
    var i = first;
    while (i < count) {
        let t = (*walk).enter + f32(i) * (*walk).step;
        if (t < (*walk).end) {
            return i;
        }
        let empty = look(walk, t);
        let next = u32(max(((*walk).end - (*walk).enter) / (*walk).step, 0.0));
        if (!empty || next <= i) {
            return i;
        }
        i = next;
    }
    return i;
}
