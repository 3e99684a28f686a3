// The threshold map's four numbers per texel: what they hold, and how transmittance is read from
// them. src/kernel/threshold.rs explains the method.
#import kernel/frame

const UNSET_SHARES: vec3<f32> = vec3<f32>(0.1, 0.5, 0.85);
const LAST_SHARE_ABOVE: f32 = 1.26;
const MIDDLE_SHARE_ABOVE: f32 = 1.65;
const LARGEST_OPTICAL_DEPTH: f32 = 16.0;
const BENT_OPTICAL_DEPTH: f32 = 8.0;
const SMALLEST_OPACITY: f32 = 1e-6;

// The opacities whose depths the three channels of a texel hold; a is the texel's largest opacity.
fn levels(a: f32, thresholds: vec3<f32>) -> vec3<f32> {
    let shares = a * UNSET_SHARES;
    if (a >= thresholds.z) {
        return thresholds;
    }
    if (a >= thresholds.y) {
        let above = shares.z >= LAST_SHARE_ABOVE * thresholds.y;
        return vec3<f32>(thresholds.xy, select(shares.y, shares.z, above));
    }
    if (a >= thresholds.x) {
        if (shares.y >= MIDDLE_SHARE_ABOVE * thresholds.x) {
            return vec3<f32>(thresholds.x, shares.yz);
        }
        if (shares.z >= LAST_SHARE_ABOVE * thresholds.x) {
            return vec3<f32>(thresholds.x, shares.xz);
        }
        return vec3<f32>(thresholds.x, shares.xy);
    }
    return shares;
}

// Optical depth of an opacity, capped at LARGEST_OPTICAL_DEPTH.
fn optical_depth_of(opacity: f32) -> f32 {
    return min(-log(max(1.0 - opacity, 1e-30)), LARGEST_OPTICAL_DEPTH);
}

// 0 below a, 1 above b, 3 t^2 - 2 t^3 between; a step where the two are equal.
fn smooth_step(a: f32, b: f32, x: f32) -> f32 {
    if (b <= a) {
        return select(0.0, 1.0, x >= b);
    }
    let t = clamp((x - a) / (b - a), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// The share x of the way at which a parabola from (0, 0) to (1, 1), whose slope rises by `bend`,
// has the value y.
fn parabola_share(y: f32, bend: f32) -> f32 {
    let limited = clamp(bend, -2.0, 2.0);
    let first = 1.0 - 0.5 * limited;
    return 2.0 * y / max(first + sqrt(max(first * first + 2.0 * limited * y, 0.0)), 1e-30);
}

// The depth in a step from depth z.x to z.y where optical depth reaches tau. `ends` are the optical
// depths at the step's ends, and `bend` is how much more optical depth the next step holds than
// this one.
fn crossing_depth(crossing: u32, z: vec2<f32>, tau: f32, ends: vec2<f32>, bend: f32) -> f32 {
    var share: f32 = 0.0;
    if (crossing == 0u) {
        let rise = max(ends.y - ends.x, 1e-30);
        share = parabola_share(clamp((tau - ends.x) / rise, 0.0, 1.0), bend / rise);
    } else if (crossing == 1u) {
        share = smooth_step(1.0 - exp(-ends.x), 1.0 - exp(-ends.y), 1.0 - exp(-tau));
    }
    return z.x + (z.y - z.x) * share;
}

// Optical depth over depth along a texel's ray: zero, then four cubic pieces, then constant.
struct Curve {
    // Depths where the pieces end.
    ends: vec4<f32>,
    // Coefficients of x + u (y + u (z + u w)) over the share u of each piece's length. The first
    // cubic begins at an optical depth of zero, and its x holds the depth where it begins.
    cubics: array<vec4<f32>, 4>,
}

// The cubic from value p to value q with slopes mp and mq per piece length.
fn cubic(p: f32, q: f32, mp: f32, mq: f32) -> vec4<f32> {
    let rise = q - p;
    return vec4<f32>(p, mp, 3.0 * rise - 2.0 * mp - mq, mp + mq - 2.0 * rise);
}

fn sorted(v: vec3<f32>) -> vec3<f32> {
    let low = min(v.x, v.y);
    let high = max(v.x, v.y);
    return vec3<f32>(min(low, v.z), max(low, min(high, v.z)), max(high, v.z));
}

// Depth differences between the three points.
fn gaps(z: vec3<f32>) -> vec2<f32> {
    let nearest = 1e-6 * abs(z.z) + 1e-30;
    return max(vec2<f32>(z.y - z.x, z.z - z.y), vec2<f32>(nearest));
}

// A slope at a point between two secants, limited so that the cubics on both sides are monotone.
fn slope_between(a: f32, b: f32) -> f32 {
    return min(0.5 * (a + b), 2.5 * min(a, b));
}

// How the curve continues beyond an outermost point: (length, slope at the point, slope at the far
// end). `slopes` are those wanted at the two places; src/kernel/threshold.rs explains the
// parameters.
fn run_out(rest: f32, secant: f32, slopes: vec2<f32>, border: f32) -> vec3<f32> {
    let slope = slopes.x;
    let far = slopes.y;
    let free = 2.0 * rest / (slope + far);
    let room = max(border, 1e-6 * free);
    if (free <= room) {
        return vec3<f32>(free, slope, far);
    }
    let mean = rest / room;
    let bent = 0.5 * (slope + far) / secant;
    let straight = clamp((mean / secant - bent) / max(1.0 - bent, 0.1), 0.0, 1.0);
    let near = min(2.0 * mean - far, 3.0 * secant) * (1.0 - straight)
        + slope_between(mean, secant) * straight;
    return vec3<f32>(room, near, far + (mean - far) * straight);
}

// The slopes wanted at the last point and at the far end. d are the slopes between the points, h
// the distances between them, and `above` is how far total lies above the optical depth of the last
// threshold.
fn end_slopes(d: vec2<f32>, h: vec2<f32>, total: f32, above: f32) -> vec2<f32> {
    // The slope of the parabola through the three points, and, where the medium may end soon, the
    // slope that proved best.
    let wanted = vec2<f32>(d.y + (d.y - d.x) * (h.y / (h.x + h.y)), 1.25 * sqrt(d.x * d.y));
    let slopes = min(max(wanted, vec2<f32>(0.5 * d.y)), vec2<f32>(3.0 * d.y));
    let most = LARGEST_OPTICAL_DEPTH - BENT_OPTICAL_DEPTH;
    let dark = clamp((total - BENT_OPTICAL_DEPTH) / most, 0.0, 1.0);
    let even = max(1.0 - 10.0 * abs(d.y - d.x) / (d.x + d.y), 0.0) * clamp(above, 0.0, 1.0);
    let straight = max(dark, even);
    let near = slopes.y + (slopes.x - slopes.y) * straight;
    return vec2<f32>(near, near * straight);
}

// The curve that a texel's four numbers define; extent holds the depths where its ray enters and
// leaves the volume.
fn curve(texel: vec4<f32>, extent: vec2<f32>) -> Curve {
    let a = texel.w;
    if (a < SMALLEST_OPACITY) {
        return Curve(vec4<f32>(0.0, 0.0, 0.0, 1.0), array<vec4<f32>, 4>());
    }
    var z = texel.xyz;
    var tau = frame.map.threshold_depths;
    if (a < frame.map.thresholds.z) {
        z = sorted(z);
        tau = -log(1.0 - sorted(levels(a, frame.map.thresholds)));
    }
    let total = optical_depth_of(a);
    let h = gaps(z);
    let d1 = max((tau.y - tau.x) / h.x, 1e-12);
    let d2 = max((tau.z - tau.y) / h.y, 1e-12);
    let onset = run_out(tau.x, d1, vec2<f32>(0.6 * d1, 0.0), z.x - extent.x);
    let last = end_slopes(vec2<f32>(d1, d2), h, total, total - frame.map.threshold_depths.z);
    let end = run_out(max(total - tau.z, 0.0), d2, last, extent.y - z.z);
    let lengths = max(vec2<f32>(onset.x, end.x), vec2<f32>(1e-30));
    let slope = vec3<f32>(onset.y, slope_between(d1, d2), end.y);
    var first = cubic(0.0, tau.x, onset.z * lengths.x, slope.x * lengths.x);
    first.x = z.x - lengths.x;
    return Curve(
        vec4<f32>(z, z.z + lengths.y),
        array<vec4<f32>, 4>(
            first,
            cubic(tau.x, tau.y, slope.x * h.x, slope.y * h.x),
            cubic(tau.y, tau.z, slope.y * h.y, slope.z * h.y),
            cubic(tau.z, max(total, tau.z), slope.z * lengths.y, end.z * lengths.y),
        ),
    );
}

// Index of the piece, 0 to 3, that contains a depth.
fn piece_of(ends: vec4<f32>, depth: f32) -> u32 {
    let in_front = vec3<f32>(depth) < ends.xyz;
    return select(select(select(3u, 2u, in_front.z), 1u, in_front.y), 0u, in_front.x);
}

// Optical depth from the light to a depth in piece k with the given cubic.
fn optical_depth_in(ends: vec4<f32>, k: u32, cubic: vec4<f32>, depth: f32) -> f32 {
    let first = k == 0u;
    let front = select(select(ends.x, ends.y, k > 1u), ends.z, k > 2u);
    let begin = select(front, cubic.x, first);
    let back = select(select(ends.y, ends.z, k > 1u), ends.w, k > 2u);
    let length = max(select(back, ends.x, first) - begin, 1e-6 * abs(ends.z) + 1e-30);
    let u = clamp((depth - begin) / length, 0.0, 1.0);
    return select(cubic.x, 0.0, first) + u * (cubic.y + u * (cubic.z + u * cubic.w));
}

// Transmittance at a depth by the default reconstruction from a texel's four numbers.
fn transmittance_default(texel: vec4<f32>, extent: vec2<f32>, depth: f32) -> f32 {
    var c = curve(texel, extent);
    let k = piece_of(c.ends, depth);
    return exp(-optical_depth_in(c.ends, k, c.cubics[k], depth));
}

// Transmittance at a depth by the paper's lookup; src/kernel/threshold.rs says what the paper
// leaves open.
fn transmittance_paper(texel: vec4<f32>, depth: f32) -> f32 {
    let t = frame.map.thresholds;
    var opacity = texel.w;
    if (depth < texel.x) {
        opacity = 0.0;
    } else if (texel.w < t.y) {
        opacity = texel.w;
    } else if (depth < texel.y) {
        opacity = t.x + (t.y - t.x) * smooth_step(texel.x, texel.y, depth);
    } else if (texel.w < t.z) {
        opacity = texel.w;
    } else if (depth < texel.z) {
        opacity = t.y + (t.z - t.y) * smooth_step(texel.y, texel.z, depth);
    }
    return 1.0 - opacity;
}
