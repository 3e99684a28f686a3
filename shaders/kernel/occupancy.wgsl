// Steps of a ray that need not be taken, because they lie in empty bricks, and steps that may be joined,
// because the media hardly change.
#import kernel/frame
#import kernel/ray

// For each brick: from EMPTY on how many bricks it is to the next one that holds anything, less one; else how
// much longer steps may be, in eighths, than where the media change most.
@group(0) @binding(22) var codes: texture_3d<u32>;

const EMPTY: u32 = 192u;
const ROUGHEST: u32 = 8u;
// Steps that a pass takes after each look, one after the other and all as long as each other.
const BATCH: u32 = 4u;

// A ray in index space cut into equal steps, of which those in empty bricks are jumped over and others are
// joined.
struct Walk {
    ray: Ray,
    // One over its direction, bricks and not voxels.
    inverse: vec3<f32>,
    enter: f32,
    step: f32,
    // How many steps may be joined where the media change most; less than 1 where they are too long.
    least: f32,
    // Up to here along the ray nothing changes.
    end: f32,
    joined: u32,
}

// Where the media change most, steps may be as long as `length`.
fn walk_of(ray: Ray, enter: f32, step: f32, length: f32) -> Walk {
    let direction = ray.direction / frame.bricks.w;
    let tiny = vec3<f32>(1e-30);
    let inverse = 1.0 / select(direction, tiny, abs(direction) < tiny);
    return Walk(ray, inverse, enter, step, length / step, -3e38, 1u);
}

// Whether the brick at distance t is empty; the walk's end becomes where the ray leaves it, or the empty
// block around it.
fn look(walk: ptr<function, Walk>, t: f32) -> bool {
    let place = (ray_at((*walk).ray, t) - frame.bricks.xyz) / frame.bricks.w;
    let last = vec3<f32>(textureDimensions(codes) - 1u);
    let brick = clamp(floor(place), vec3<f32>(0.0), last);
    let code = textureLoad(codes, vec3<u32>(brick), 0).x;
    let around = f32(max(code, EMPTY) - EMPTY);
    let border = select(brick - around, brick + (1.0 + around), (*walk).inverse > vec3<f32>(0.0));
    let left = (border - place) * (*walk).inverse;
    (*walk).end = t + max(min(left.x, min(left.y, left.z)), 0.0);
    let empty = code >= EMPTY;
    let longer = f32(select(code, ROUGHEST, empty)) / f32(ROUGHEST);
    let most = frame.lengths.w / (*walk).step;
    (*walk).joined = u32(max(min(longer * (*walk).least, most), 1.0));
    return empty;
}

// The first step from `first` on that may hold anything; `count` or more if none before does. As many as the
// walk says may be joined to one there, and BATCH of those taken before the next look.
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
