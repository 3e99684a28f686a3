// Places the nine knots of a texel's code by least squares over points of its curve, first freely,
// then rounded. src/shadow/coded/nested/fit.rs explains it.
#import kernel/nested

const COUNT: u32 = 64u;
const KNOTS: u32 = 9u;
const LAST: u32 = 8u;
// How often every knot moves, and by how many points at most at a time.
const SWEEPS: u32 = 2u;
const FARTHEST: u32 = 4u;
// The weight that every point has in addition to the share of depth that it stands for.
const POINT_WEIGHT: f32 = 1.0;
// Lengths are raised to this before a division.
const SMALLEST: f32 = 1e-30;
// A weight that matters only where no point has influence.
const TIE: f32 = 1e-9;

// Points of opacity over depth: x and y as in a knot, z the weight of squared errors.
var<private> points: array<vec3<f32>, COUNT>;
// The point at which each knot stands before it is rounded.
var<private> stands: array<u32, KNOTS>;
// The knots by rising depth.
var<private> knots: array<vec2<f32>, KNOTS>;

// The slope of the line through two knots.
fn slope_between(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return (b.y - a.y) / max(b.x - a.x, SMALLEST);
}

// Sets each point's weight by the depth halfway to its neighbours. A point within a jump stands for
// no depth.
fn weigh() {
    let half = 0.5 / max(points[COUNT - 1u].x - points[0].x, SMALLEST);
    var before = points[0].x;
    for (var i: u32 = 0u; i < COUNT; i++) {
        let here = points[i].x;
        let part = (points[min(i + 1u, COUNT - 1u)].x - before) * half;
        points[i].z = part + select(0.0, POINT_WEIGHT / f32(COUNT), part > 1e-6);
        before = here;
    }
}

// How far the point between two others is that is farthest from the line through them, and its
// index; less than 0 if there is none.
fn farthest_between(first: u32, last: u32) -> vec2<f32> {
    if (first + 1u >= last) {
        return vec2<f32>(-1.0, f32(first));
    }
    let a = points[first].xy;
    let slope = slope_between(a, points[last].xy);
    var found = vec2<f32>(0.0, f32(first + 1u));
    for (var i = first + 1u; i < last; i++) {
        let p = points[i];
        // Points within a jump lie on a vertical line between its ends, which needs no knots.
        let off = select(0.0, abs(p.y - (a.y + (p.x - a.x) * slope)), p.z > 0.0);
        if (off > found.x) {
            found = vec2<f32>(off, f32(i));
        }
    }
    return found;
}

// Puts the knots at the ends, then repeatedly at the point farthest from the polyline so far.
fn farthest_points() {
    // For each piece of the polyline what is farthest from it.
    var farthest: array<vec2<f32>, KNOTS>;
    stands[0] = 0u;
    stands[1] = COUNT - 1u;
    farthest[0] = farthest_between(0u, COUNT - 1u);
    for (var count: u32 = 2u; count < KNOTS; count++) {
        var piece: u32 = 0u;
        for (var j: u32 = 1u; j < count - 1u; j++) {
            if (farthest[j].x > farthest[piece].x) {
                piece = j;
            }
        }
        let first = stands[piece];
        let last = stands[piece + 1u];
        let between = u32(farthest[piece].y);
        for (var j = count; j > piece + 1u; j--) {
            stands[j] = stands[j - 1u];
        }
        for (var j = count - 1u; j > piece + 1u; j--) {
            farthest[j] = farthest[j - 1u];
        }
        stands[piece + 1u] = between;
        farthest[piece] = farthest_between(first, between);
        farthest[piece + 1u] = farthest_between(between, last);
    }
    for (var j: u32 = 0u; j < KNOTS; j++) {
        knots[j] = points[stands[j]].xy;
    }
}

// Moves inner knot j to the best of the points nearby, between its neighbours.
fn move_inner(j: u32) {
    let a = knots[j - 1u];
    let b = knots[j + 1u];
    let slope = slope_between(a, b);
    let first = stands[j - 1u] + 1u;
    let end = stands[j + 1u];
    let here = stands[j];
    // Weight times a neighbour's way to each point, times that way and times the point's distance
    // from the chord: of the points so far, and of those behind them.
    var before = vec2<f32>(0.0);
    var later = vec2<f32>(0.0);
    for (var i = first; i < end; i++) {
        let p = points[i];
        let left = b.x - p.x;
        later += p.z * left * vec2<f32>(left, p.y - (a.y + (p.x - a.x) * slope));
    }
    let near = max(first, here - min(here, FARTHEST));
    var most = -1.0;
    for (var i = first; i < min(end, here + FARTHEST); i++) {
        let p = points[i];
        let ahead = p.x - a.x;
        let left = b.x - p.x;
        let chord = a.y + ahead * slope;
        before += p.z * ahead * vec2<f32>(ahead, p.y - chord);
        later -= p.z * left * vec2<f32>(left, p.y - chord);
        if (i < near) {
            continue;
        }
        let rise = 1.0 / max(ahead, SMALLEST);
        let fall = 1.0 / max(left, SMALLEST);
        let steep = (before.x * rise) * rise + (later.x * fall) * fall + TIE;
        let pull = before.y * rise + later.y * fall + TIE * (0.5 * (a.y + b.y) - chord);
        let opacity = clamp(chord + pull / steep, a.y, b.y);
        let above = opacity - chord;
        let gain = max((2.0 * pull - steep * above) * above, 0.0);
        if (gain >= most) {
            most = gain;
            stands[j] = i;
            knots[j] = vec2<f32>(p.x, opacity);
        }
    }
}

// Moves the first knot, of opacity 0, to the best point in front of the next one.
fn move_first() {
    let b = knots[1];
    let end = stands[1];
    // Of all points: weight times the way to the knot, squared, and times the opacity below it; and
    // times the square of that.
    var rest = vec3<f32>(0.0);
    for (var i: u32 = 0u; i < end; i++) {
        let p = points[i];
        let off = vec2<f32>(b.x - p.x, b.y - p.y);
        rest += p.z * vec3<f32>(off.x * off.x, off.x * off.y, off.y * off.y);
    }
    var front = 0.0;
    var least = 1e30;
    for (var i: u32 = 0u; i < end; i++) {
        let p = points[i];
        let off = vec2<f32>(b.x - p.x, b.y - p.y);
        rest -= p.z * vec3<f32>(off.x * off.x, off.x * off.y, off.y * off.y);
        front += p.z * p.y * p.y;
        let slope = b.y / max(off.x, SMALLEST);
        let error = max(front + rest.z + slope * (slope * rest.x - 2.0 * rest.y), TIE);
        if (error <= least) {
            least = error;
            stands[0] = i;
            knots[0].x = p.x;
        }
    }
}

// Moves the last knot, of opacity 1, to the best point behind the one before.
fn move_last() {
    let a = knots[LAST - 1u];
    let first = stands[LAST - 1u] + 1u;
    // Of the points behind: weight times the square of the opacity that is missing.
    var behind = 0.0;
    for (var i = first; i < COUNT; i++) {
        let p = points[i];
        behind += p.z * (1.0 - p.y) * (1.0 - p.y);
    }
    // As in `move_first`, of the points so far.
    var rest = vec3<f32>(0.0);
    var least = 1e30;
    for (var i = first; i < COUNT; i++) {
        let p = points[i];
        let off = p.xy - a;
        rest += p.z * vec3<f32>(off.x * off.x, off.x * off.y, off.y * off.y);
        behind -= p.z * (1.0 - p.y) * (1.0 - p.y);
        let slope = (1.0 - a.y) / max(off.x, SMALLEST);
        let error = max(behind + rest.z + slope * (slope * rest.x - 2.0 * rest.y), TIE);
        if (error <= least) {
            least = error;
            stands[LAST] = i;
            knots[LAST].x = p.x;
        }
    }
}

// The free fit of the points.
fn fit_knots() {
    farthest_points();
    for (var sweep: u32 = 0u; sweep < SWEEPS; sweep++) {
        move_first();
        for (var j: u32 = 2u; j < LAST; j += 2u) {
            move_inner(j);
        }
        for (var j: u32 = 1u; j < LAST; j += 2u) {
            move_inner(j);
        }
        move_last();
    }
}

// Rounds inner knot j to the best codes, of so many bits for depth and opacity, between the already
// rounded knots at distance `reach` to either side. Returns the codes.
fn settle(j: u32, reach: u32, bits: vec2<u32>) -> vec2<u32> {
    let a = knots[j - reach];
    let b = knots[j + reach];
    let before = clamp(knots[j - 1u], a, b);
    let behind = clamp(knots[j + 1u], a, b);
    let most = vec2<f32>((vec2<u32>(1u) << bits) - 1u);
    let wanted = trunc(unit((knots[j].x - a.x) / max(b.x - a.x, SMALLEST)) * most.x);
    // Opacity has coarser codes, and a knot at a nearby depth may lie closer to one.
    let codes = clamp(wanted + vec4<f32>(-1.0, 0.0, 1.0, 2.0), vec4<f32>(0.0), vec4<f32>(most.x));
    let depths = a.x + (b.x - a.x) * (codes / most.x);
    let held = min(max(depths, vec4<f32>(before.x)), vec4<f32>(behind.x));
    let rise = 1.0 / max(held - before.x, vec4<f32>(SMALLEST));
    let fall = 1.0 / max(behind.x - held, vec4<f32>(SMALLEST));
    let slope = slope_between(before, behind);
    var steep = vec4<f32>(TIE);
    var pull = vec4<f32>(0.0);
    for (var i = stands[j - 1u] + 1u; i < stands[j + 1u]; i++) {
        let p = points[i];
        let ahead = p.x - before.x;
        let influence = max(min(ahead * rise, (behind.x - p.x) * fall), vec4<f32>(0.0));
        steep += p.z * influence * influence;
        pull += p.z * influence * (p.y - (before.y + ahead * slope));
    }
    let chord = before.y + (held - before.x) * slope;
    pull += TIE * (0.5 * (before.y + behind.y) - chord);
    let height = b.y - a.y;
    let shares = (chord + pull / steep - a.y) / max(height, SMALLEST);
    let opacity_codes = round(clamp(shares, vec4<f32>(0.0), vec4<f32>(1.0)) * most.y);
    let opacities = a.y + height * (opacity_codes / most.y);
    let above = opacities - chord;
    // A depth beyond a neighbour is taken only if there is no other.
    let beyond = select(vec4<f32>(1e3), vec4<f32>(0.0), held == depths);
    let gains = (2.0 * pull - steep * above) * above - beyond;
    var gain = gains.x;
    var found = vec4<f32>(depths.x, opacities.x, codes.x, opacity_codes.x);
    if (gains.y > gain) {
        gain = gains.y;
        found = vec4<f32>(depths.y, opacities.y, codes.y, opacity_codes.y);
    }
    if (gains.z > gain) {
        gain = gains.z;
        found = vec4<f32>(depths.z, opacities.z, codes.z, opacity_codes.z);
    }
    if (gains.w > gain) {
        found = vec4<f32>(depths.w, opacities.w, codes.w, opacity_codes.w);
    }
    knots[j] = found.xy;
    return vec2<u32>(found.zw);
}

// The words of a texel with a largest opacity, whose code is not 0, from its points.
fn words_of(largest: u32) -> vec4<u32> {
    fit_knots();
    // Rounded inwards, so that nothing is shadowed in front of the medium.
    let first = clamp(ceil(knots[0].x * 1023.0 - 1e-4), 0.0, 1023.0);
    let last = clamp(floor(knots[LAST].x * 1023.0 + 1e-4), first, 1023.0);
    knots[0] = vec2<f32>(first / 1023.0, 0.0);
    knots[LAST] = vec2<f32>(last / 1023.0, 1.0);
    let middle = settle(4u, 4u, vec2<u32>(8u, 8u));
    let left = settle(2u, 2u, vec2<u32>(8u, 6u));
    let right = settle(6u, 2u, vec2<u32>(8u, 6u));
    var eighths: array<u32, 4>;
    for (var k: u32 = 0u; k < 4u; k++) {
        let codes = settle(2u * k + 1u, 1u, vec2<u32>(7u, 6u));
        eighths[k] = codes.x | (codes.y << 7u);
    }
    return vec4<u32>(
        largest | (u32(first) << 12u) | (u32(last) << 22u),
        middle.x | (middle.y << 8u) | (left.x << 16u) | (right.x << 24u),
        left.y | (eighths[0] << 6u) | (eighths[1] << 19u),
        right.y | (eighths[2] << 6u) | (eighths[3] << 19u),
    );
}
