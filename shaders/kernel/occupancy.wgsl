// Places of a ray that need not be sampled, because they lie in empty bricks, and how long steps
// may be elsewhere, as media change more or less.
#import kernel/frame
#import kernel/ray

// For each brick: from EMPTY on how many bricks it is to the next one that holds anything, less
// one; else how much longer steps may be, in eighths, than where the media change most.
@group(0) @binding(22) var codes: texture_3d<u32>;

const EMPTY: u32 = 192u;
const ROUGHEST: u32 = 8u;
// Steps that a pass takes after each look, one after the other and all as long as each other.
const BATCH: f32 = 4.0;
// How far beyond an empty brick a ray goes on, in shortest steps: rounding must not leave it
// inside.
const LEAP: f32 = 0.1;
// Steps at least, as a share of the ray's end: what rounding still tells apart.
const LEAST_SHARE: f32 = 2e-6;
// What the samples of cut steps of a camera ray aim at, as a share of the limit.
const CUT_SHARE: f32 = 0.33;
// What they may hold.
const CUT_LIMIT: f32 = 0.5;
// How much longer than made for the steepest place steps may be before ends of batches are looked
// at.
const HIDING: f32 = 3.0;
// What steps that are cut become at least and at most, as a share of themselves.
const SHORTEST_CUT: f32 = 0.125;
const LONGEST_CUT: f32 = 0.75;

// A ray in the space that media are sampled in, on its way through the bricks.
struct Walk {
    ray: Ray,
    // One over its direction in bricks.
    inverse: vec3<f32>,
    // Where the ray ends.
    exit: f32,
    // World lengths of a step: at least, where the media change most, at most.
    lengths: vec3<f32>,
    // Up to here along the ray nothing changes.
    end: f32,
    // Length of a step there.
    step: f32,
}

fn walk_of(ray: Ray, exit: f32, lengths: vec3<f32>) -> Walk {
    let direction = ray.direction * frame.media.brick_scale;
    let tiny = vec3<f32>(1e-30);
    let inverse = 1.0 / select(direction, tiny, abs(direction) < tiny);
    let least = max(lengths.x, LEAST_SHARE * exit);
    return Walk(ray, inverse, exit, vec3<f32>(least, lengths.yz), -3e38, least);
}

// Whether the brick at distance t is empty; the walk's end becomes where the ray leaves it, or the
// empty block around it.
fn look(walk: ptr<function, Walk>, t: f32) -> bool {
    let place = ray_at((*walk).ray, t) * frame.media.brick_scale + frame.media.brick_offset;
    let last = vec3<f32>(textureDimensions(codes) - 1u);
    let brick = clamp(floor(place), vec3<f32>(0.0), last);
    let code = textureLoad(codes, vec3<u32>(brick), 0).x;
    let around = f32(max(code, EMPTY) - EMPTY);
    let border = select(brick - around, brick + (1.0 + around), (*walk).inverse > vec3<f32>(0.0));
    let left = (border - place) * (*walk).inverse;
    (*walk).end = t + max(min(left.x, min(left.y, left.z)), 0.0);
    let longer = f32(code) / f32(ROUGHEST);
    let lengths = (*walk).lengths;
    (*walk).step = max(min(longer * lengths.y, lengths.z), lengths.x);
    return code >= EMPTY;
}

// The first place from `start` on that may hold anything; the ray's end or more if none before
// does.
fn next_place(walk: ptr<function, Walk>, start: f32) -> f32 {
    let leap = LEAP * (*walk).lengths.x;
    var t = start;
    while (t < (*walk).exit * (1.0 - LEAST_SHARE)) {
        if (t < (*walk).end || !look(walk, t)) {
            return max(t - leap, start);
        }
        t = max((*walk).end, t) + leap;
    }
    return max((*walk).exit, start);
}

// How long the steps of a batch from t on are. The last one ends where the ray does, rounding or
// not.
fn step_from(walk: Walk, t: f32) -> f32 {
    let left = (walk.exit - t) / BATCH;
    return select(walk.step, left, left < 1.001 * walk.step);
}

// What steps of a length become that must be cut to a share of it.
fn cut(walk: Walk, step: f32, share: f32) -> f32 {
    if (share >= 1.0) {
        return step;
    }
    return min(max(step * clamp(share, SHORTEST_CUT, LONGEST_CUT), LEAST_SHARE * walk.exit), step);
}

// Whether steps are so long that something dense may begin between the last one's middle and its
// end.
fn hides(walk: Walk, step: f32) -> bool {
    return step > HIDING * walk.lengths.y;
}

// What four steps of a light ray become so that optical depth, `taus` over them, bends no more from
// step to step than `limit` over the share of light that gets to them, behind the optical depth
// `tau`. Half of a step's length is a quarter of the bend. `end` is the optical depth of a step
// like the place where they end.
fn cut_to_bend(walk: Walk, step: f32, taus: vec4<f32>, end: f32, limit: f32, tau: f32) -> f32 {
    let bends = abs(taus.yzw - taus.xyz);
    let bend = max(max(bends.x, 2.0 * abs(end - taus.w)), max(bends.y, bends.z));
    if (bend <= limit) {
        return step;
    }
    return cut(walk, step, sqrt(limit / (bend * exp(-tau))));
}
