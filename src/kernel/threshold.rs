//! The threshold map's four numbers: what they hold and how transmittance is read from them.
//!
//! A texel holds (R, G, B, A): the depths where opacity first reaches three thresholds (10, 50 and
//! 90 %), and the largest opacity A (volumetric deep shadow maps, "Implementation").
//!
//! **Unset channels.** Most texels never reach the last threshold. The paper leaves open what their
//! channels hold; here it depends on the lookup that the map is made for:
//! - `paper`: the ray's exit from the volume.
//! - `default`: the depth where opacity reaches a fixed share of the texel's own A ([`levels`]).
//!   From A a reader knows which thresholds were reached, and so what each channel holds.
//!
//! **Reconstruction** (`default`): optical depth as a monotone piecewise cubic through the three
//! points, with slopes limited as by Fritsch and Carlson 1980, a quadratic onset in front of the
//! first point and a quadratic end behind the last. The onset's length comes from the slope between
//! the first two points and not from where the ray enters the volume, so empty space stays
//! unshadowed. The end flattens out, as media do, with two exceptions. A medium that is dark long
//! before its end is seen only at its front, so its curve continues as it changed between the
//! points. A medium whose slopes between the points are equal continues straight.

use glam::{Vec3, Vec4};

use crate::math::Each;

/// Shares of A whose depths unset channels hold.
pub const UNSET_SHARES: Vec3 = Vec3::new(0.1, 0.5, 0.85);
/// The largest share is kept if it is at least this many times the last reached threshold.
pub const LAST_SHARE_ABOVE: f32 = 1.26;
/// The middle share is kept if it is at least this many times the first threshold.
pub const MIDDLE_SHARE_ABOVE: f32 = 1.65;
/// Largest optical depth at which a reconstruction ends; in f32, 1 - A is zero soon after.
pub const LARGEST_OPTICAL_DEPTH: f32 = 16.0;
/// The end flattens out up to this optical depth of a texel; at the largest it is straight.
pub const BENT_OPTICAL_DEPTH: f32 = 8.0;
/// Opacity below which a texel is empty.
pub const SMALLEST_OPACITY: f32 = 1e-6;

/// The opacities whose depths the three channels of a texel with largest opacity `a` hold, for the
/// `default` lookup: the thresholds where reached, else shares of `a`. They need not rise.
pub fn levels(a: f32, thresholds: Vec3) -> Vec3 {
    let shares = a * UNSET_SHARES;
    let [t1, t2, t3] = thresholds.to_array();
    if a >= t3 {
        thresholds
    } else if a >= t2 {
        let above = shares.z >= LAST_SHARE_ABOVE * t2;
        Vec3::new(t1, t2, if above { shares.z } else { shares.y })
    } else if a >= t1 {
        if shares.y >= MIDDLE_SHARE_ABOVE * t1 {
            Vec3::new(t1, shares.y, shares.z)
        } else if shares.z >= LAST_SHARE_ABOVE * t1 {
            Vec3::new(t1, shares.x, shares.z)
        } else {
            Vec3::new(t1, shares.x, shares.y)
        }
    } else {
        shares
    }
}

/// Optical depth of an opacity, at most [`LARGEST_OPTICAL_DEPTH`].
#[inline]
pub fn optical_depth_of(opacity: f32) -> f32 {
    (-(1.0 - opacity).max(1e-30).ln()).min(LARGEST_OPTICAL_DEPTH)
}

/// The depth in a step from `z0` to `z1` where optical depth reaches `tau`. `tau0` and `tau1` are
/// the optical depths at the step's ends, and `bend` is how much more optical depth the next step
/// holds than this one. `crossing`: 0 exact, 1 smoothstep, 2 the step's front (bucket).
#[inline]
pub fn crossing_depth(
    crossing: u32,
    z: [f32; 2],
    tau: f32,
    [tau0, tau1]: [f32; 2],
    bend: f32,
) -> f32 {
    let [z0, z1] = z;
    let share = match crossing {
        0 => {
            let rise = (tau1 - tau0).max(1e-30);
            parabola_share(((tau - tau0) / rise).clamp(0.0, 1.0), bend / rise)
        }
        1 => smoothstep(1.0 - (-tau0).exp(), 1.0 - (-tau1).exp(), 1.0 - (-tau).exp()),
        _ => 0.0,
    };
    z0 + (z1 - z0) * share
}

/// The x at which a parabola from (0, 0) to (1, 1), whose slope rises by `bend`, has the value `y`.
/// A line would place all levels in a dense medium's front too early, losing half a percent of
/// light.
#[inline]
fn parabola_share(y: f32, bend: f32) -> f32 {
    // At most as much as keeps the parabola monotone.
    let bend = bend.clamp(-2.0, 2.0);
    let first = 1.0 - 0.5 * bend;
    2.0 * y / (first + (first * first + 2.0 * bend * y).max(0.0).sqrt()).max(1e-30)
}

/// 0 below `a`, 1 above `b`, 3 t^2 - 2 t^3 between; a step where the two are equal.
#[inline]
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    if b <= a {
        return if x >= b { 1.0 } else { 0.0 };
    }
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Optical depth over depth along a texel's ray: zero, four cubic pieces, `total`.
///
/// ```text
///  tau                          ______ total      piece 0: onset, before the first point
///                        ___---                   piece 1: from the first to the second
///                  __--o z.z                      piece 2: from the second to the third
///              _-o z.y                            piece 3: end, behind the third
///   ______--o z.x
///        |<>| onset                  |<-  end  ->| from z.z
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Depths where the pieces end; the first three are those of the three points.
    pub ends: Vec4,
    /// Coefficients of x + u (y + u (z + u w)) over the share u of each piece's length. The first
    /// begins at an optical depth of zero, and its x holds the depth where it begins.
    pub cubics: [Vec4; 4],
}

/// The curve of an empty texel.
pub const EMPTY: Curve = Curve { ends: Vec4::W, cubics: [Vec4::ZERO; 4] };

/// The curve that a texel's four numbers define; `enter` and `exit` are the depths where its ray
/// enters and leaves the volume.
pub fn curve(
    texel: Vec4,
    thresholds: Vec3,
    threshold_depths: Vec3,
    [enter, exit]: [f32; 2],
) -> Curve {
    let a = texel.w;
    if a < SMALLEST_OPACITY {
        return EMPTY;
    }
    let (z, tau) = if a >= thresholds.z {
        (texel.truncate(), threshold_depths)
    } else {
        let levels = sorted(levels(a, thresholds));
        (sorted(texel.truncate()), -(Vec3::ONE - levels).map(f32::ln))
    };
    let total = optical_depth_of(a);
    let [h1, h2] = gaps(z);
    let d1 = ((tau.y - tau.x) / h1).max(1e-12);
    let d2 = ((tau.z - tau.y) / h2).max(1e-12);
    let onset = run_out(tau.x, d1, [0.6 * d1, 0.0], z.x - enter);
    let last = end_slopes([d1, d2], [h1, h2], total, total - threshold_depths.z);
    let end = run_out((total - tau.z).max(0.0), d2, last, exit - z.z);
    let lengths = [onset.x, end.x].each(|length| length.max(1e-30));
    let slope = Vec3::new(onset.y, slope_between(d1, d2), end.y);
    let mut first = cubic([0.0, tau.x], [onset.z * lengths[0], slope.x * lengths[0]]);
    first.x = z.x - lengths[0];
    Curve {
        ends: z.extend(z.z + lengths[1]),
        cubics: [
            first,
            cubic([tau.x, tau.y], [slope.x * h1, slope.y * h1]),
            cubic([tau.y, tau.z], [slope.y * h2, slope.z * h2]),
            cubic([tau.z, total.max(tau.z)], [slope.z * lengths[1], end.z * lengths[1]]),
        ],
    }
}

/// The slopes wanted at the last point and at the far end. `d1`, `d2` are the slopes between the
/// points, `h1`, `h2` their distances, `above` how far `total` lies above the last threshold.
fn end_slopes([d1, d2]: [f32; 2], [h1, h2]: [f32; 2], total: f32, above: f32) -> [f32; 2] {
    // The parabola's slope, and, where the medium may end soon, the slope that proved best.
    let [ahead, bent] = [d2 + (d2 - d1) * (h2 / (h1 + h2)), 1.25 * (d1 * d2).sqrt()]
        .each(|slope| slope.max(0.5 * d2).min(3.0 * d2));
    let most = LARGEST_OPTICAL_DEPTH - BENT_OPTICAL_DEPTH;
    let dark = ((total - BENT_OPTICAL_DEPTH) / most).clamp(0.0, 1.0);
    let even = (1.0 - 10.0 * (d2 - d1).abs() / (d1 + d2)).max(0.0) * above.clamp(0.0, 1.0);
    let straight = dark.max(even);
    let near = bent + (ahead - bent) * straight;
    [near, near * straight]
}

/// The cubic from value `p` to value `q` with slopes `mp` and `mq` per piece length.
#[inline]
fn cubic([p, q]: [f32; 2], [mp, mq]: [f32; 2]) -> Vec4 {
    let rise = q - p;
    Vec4::new(p, mp, 3.0 * rise - 2.0 * mp - mq, mp + mq - 2.0 * rise)
}

#[inline]
fn sorted(v: Vec3) -> Vec3 {
    let (low, high) = (v.x.min(v.y), v.x.max(v.y));
    Vec3::new(low.min(v.z), low.max(high.min(v.z)), high.max(v.z))
}

/// Depth differences of the three points, at least as large as f32 can resolve.
#[inline]
fn gaps(z: Vec3) -> [f32; 2] {
    let nearest = 1e-6 * z.z.abs() + 1e-30;
    [(z.y - z.x).max(nearest), (z.z - z.y).max(nearest)]
}

/// A slope at a point between two secants, limited so that both cubics stay monotone.
pub(crate) fn slope_between(a: f32, b: f32) -> f32 {
    (0.5 * (a + b)).min(2.5 * a.min(b))
}

/// How the curve continues beyond an outermost point: (length, slope at the point, slope at the far
/// end). `rest` is the remaining optical depth, `secant` the slope on the point's other side,
/// `slope` and `far` the slopes wanted at the point and at the far end, `room` the length to the
/// volume's border.
///
/// A free end is a parabola, which flattens out where `far` is 0. Where the border comes first, the
/// curve ends there. The nearer the border, the straighter the curve, up to a straight line where
/// the density stays the same: a uniform medium is reproduced exactly.
pub(crate) fn run_out(rest: f32, secant: f32, [slope, far]: [f32; 2], room: f32) -> Vec3 {
    let free = 2.0 * rest / (slope + far);
    let room = room.max(1e-6 * free);
    if free <= room {
        return Vec3::new(free, slope, far);
    }
    let mean = rest / room;
    let bent = 0.5 * (slope + far) / secant;
    let straight = ((mean / secant - bent) / (1.0 - bent).max(0.1)).clamp(0.0, 1.0);
    let near = (2.0 * mean - far).min(3.0 * secant) * (1.0 - straight)
        + slope_between(mean, secant) * straight;
    Vec3::new(room, near, far + (mean - far) * straight)
}

/// Cubic from (0, `p`) to (1, `q`) at `u`, with slopes `mp` and `mq` per unit of `u`.
pub(crate) fn hermite(u: f32, [p, q]: [f32; 2], [mp, mq]: [f32; 2]) -> f32 {
    let v = 1.0 - u;
    p * (1.0 + 2.0 * u) * v * v + q * u * u * (3.0 - 2.0 * u) + u * v * (mp * v - mq * u)
}

/// Optical depth from the light to `depth`: monotone, continuous, 0 far in front of the points,
/// `total` far behind.
#[inline]
pub fn optical_depth_at(curve: &Curve, depth: f32) -> f32 {
    let [a, b, c, d] = curve.ends.to_array();
    let [onset, first, second, end] = &curve.cubics;
    let (begin, back, cubic) = if depth < a {
        // The first cubic's x holds the depth where it begins; its value there is zero.
        (onset.x, a, onset.with_x(0.0))
    } else if depth < b {
        (a, b, *first)
    } else if depth < c {
        (b, c, *second)
    } else {
        (c, d, *end)
    };
    let length = (back - begin).max(1e-6 * c.abs() + 1e-30);
    let u = ((depth - begin) / length).clamp(0.0, 1.0);
    cubic.x + u * (cubic.y + u * (cubic.z + u * cubic.w))
}

/// Transmittance at `depth` by the paper's lookup: opacity is 0 in front of the first reached
/// threshold, follows smoothsteps between reached ones and is A behind the last. Where none is
/// reached the first channel holds the ray's exit, so A counts only behind the volume.
pub fn transmittance_paper(texel: Vec4, thresholds: Vec3, depth: f32) -> f32 {
    let [r, g, b, a] = texel.to_array();
    let [t1, t2, t3] = thresholds.to_array();
    let opacity = if depth < r {
        0.0
    } else if a < t2 {
        a
    } else if depth < g {
        t1 + (t2 - t1) * smoothstep(r, g, depth)
    } else if a < t3 {
        a
    } else if depth < b {
        t2 + (t3 - t2) * smoothstep(g, b, depth)
    } else {
        a
    };
    1.0 - opacity
}

#[cfg(test)]
mod tests;
