// Empty-space skipping and adaptive step lengths: a ray jumps over empty bricks, and takes longer
// steps where the media change less.
#import kernel/frame
#import kernel/ray

// A code for each brick. EMPTY or more: the brick is empty, and the next occupied one is code -
// EMPTY + 1 bricks away. Below EMPTY: the length of steps, in eighths of that where the media
// change most.
@group(0) @binding(22) var codes: texture_3d<u32>;

const EMPTY: u32 = 192u;
const ROUGHEST: u32 = 8u;
// Steps of equal length that a pass takes in a row before it looks at the bricks again.
const BATCH: f32 = 4.0;
// How far a ray continues beyond an empty brick, in shortest steps, so that rounding does not leave
// it inside.
const LEAP: f32 = 0.1;
// Length of the shortest step as a share of the distance to the ray's end: f32 cannot resolve
// shorter ones.
const LEAST_SHARE: f32 = 2e-6;
// The optical depth that samples of shortened steps of a camera ray aim at, as a share of the
// limit.
const CUT_SHARE: f32 = 0.33;
// The largest optical depth of those samples, as a share of the limit.
const CUT_LIMIT: f32 = 0.5;
// Steps that are more than this many times as long as those made for the steepest place also sample
// the density at the end of their batch.
const HIDING: f32 = 3.0;
// Shortest and longest result of one shortening, as a share of the step's length.
const SHORTEST_CUT: f32 = 0.125;
const LONGEST_CUT: f32 = 0.75;

// A ray on its way through the bricks, in the space that media are sampled in.
struct Walk {
    ray: Ray,
    // One over the ray's direction in bricks.
    inverse: vec3<f32>,
    // Distance where the ray ends.
    exit: f32,
    // World lengths of steps: the shortest, that where the media change most, and the longest.
    lengths: vec3<f32>,
    // Up to this distance along the ray the current brick, or empty block, goes on.
    end: f32,
    // Length of a step up to there.
    step: f32,
}

fn walk_of(ray: Ray, exit: f32, lengths: vec3<f32>) -> Walk {
    let direction = ray.direction * frame.media.brick_scale;
    let tiny = vec3<f32>(1e-30);
    let inverse = 1.0 / select(direction, tiny, abs(direction) < tiny);
    let least = max(lengths.x, LEAST_SHARE * exit);
    return Walk(ray, inverse, exit, vec3<f32>(least, lengths.yz), -3e38, least);
}

// Whether the brick at distance t is empty. Sets the walk's end to where the ray leaves the brick,
// or the empty block around it.
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

// The first distance from `start` on where the media may not be empty; the distance of the ray's
// end, or more, if there is none.
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

// Length of the steps of a batch that begins at t. The last one ends exactly at the ray's end,
// whatever rounding does.
fn step_from(walk: Walk, t: f32) -> f32 {
    let left = (walk.exit - t) / BATCH;
    return select(walk.step, left, left < 1.001 * walk.step);
}

// The new length of steps that must be shortened to a share of their length.
fn cut(walk: Walk, step: f32, share: f32) -> f32 {
    if (share >= 1.0) {
        return step;
    }
    return min(max(step * clamp(share, SHORTEST_CUT, LONGEST_CUT), LEAST_SHARE * walk.exit), step);
}

// Whether steps are so long that something dense may begin between the last one's middle and its
// end and be missed.
fn hides(walk: Walk, step: f32) -> bool {
    return step > HIDING * walk.lengths.y;
}

// The length that four steps of a light ray must have so that optical depth bends from step to step
// by no more than `limit` over the share of light that reaches them. `taus` are their optical
// depths, `tau` is the optical depth in front of them, and `end` is the optical depth of a step
// with the density found where the four end. Halving a step's length quarters the bend.
fn cut_to_bend(walk: Walk, step: f32, taus: vec4<f32>, end: f32, limit: f32, tau: f32) -> f32 {
    let bends = abs(taus.yzw - taus.xyz);
    let bend = max(max(bends.x, 2.0 * abs(end - taus.w)), max(bends.y, bends.z));
    if (bend <= limit) {
        return step;
    }
    return cut(walk, step, sqrt(limit / (bend * exp(-tau))));
}
