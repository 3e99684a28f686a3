// The threshold map's four numbers: what they hold and how transmittance is read from them.
// The method stands in src/kernel/threshold.rs.
#import kernel/frame

const UNSET_SHARES: vec3<f32> = vec3<f32>(0.1, 0.5, 0.85);
const LAST_SHARE_ABOVE: f32 = 1.26;
const MIDDLE_SHARE_ABOVE: f32 = 1.65;
const LARGEST_OPTICAL_DEPTH: f32 = 16.0;
const SMALLEST_OPACITY: f32 = 1e-6;

// The opacities whose depths the channels of a texel with largest opacity a hold.
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

// Optical depth of an opacity, capped.
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

// Where within a step from depth z.x to z.y a level of optical depth tau is crossed.
fn crossing_depth(crossing: u32, z: vec2<f32>, tau: f32, ends: vec2<f32>) -> f32 {
    var share: f32 = 0.0;
    if (crossing == 0u) {
        share = clamp((tau - ends.x) / max(ends.y - ends.x, 1e-30), 0.0, 1.0);
    } else if (crossing == 1u) {
        share = smooth_step(1.0 - exp(-ends.x), 1.0 - exp(-ends.y), 1.0 - exp(-tau));
    }
    return z.x + (z.y - z.x) * share;
}

struct Nodes {
    z: vec3<f32>,
    tau: vec3<f32>,
    total: f32,
}

fn sorted(v: vec3<f32>) -> vec3<f32> {
    let low = min(v.x, v.y);
    let high = max(v.x, v.y);
    return vec3<f32>(min(low, v.z), max(low, min(high, v.z)), max(high, v.z));
}

// The points that a texel's four numbers say.
fn nodes(texel: vec4<f32>) -> Nodes {
    let a = texel.w;
    if (a < SMALLEST_OPACITY) {
        return Nodes(vec3<f32>(0.0), vec3<f32>(0.0), 0.0);
    }
    if (a >= frame.thresholds.z) {
        return Nodes(texel.xyz, frame.threshold_depths.xyz, optical_depth_of(a));
    }
    let held = sorted(levels(a, frame.thresholds.xyz));
    return Nodes(sorted(texel.xyz), -log(1.0 - held), optical_depth_of(a));
}

// Optical depth from the light to a depth: monotone, continuous.
fn optical_depth_at(points: Nodes, depth: f32) -> f32 {
    let z = points.z;
    let tau = points.tau;
    let nearest = 1e-6 * z.z + 1e-30;
    let h1 = max(z.y - z.x, nearest);
    let h2 = max(z.z - z.y, nearest);
    let d1 = max((tau.y - tau.x) / h1, 1e-12);
    let d2 = max((tau.z - tau.y) / h2, 1e-12);
    let m1 = 0.6 * d1;
    let m3 = min(max(1.25 * sqrt(d1 * d2), 0.5 * d2), 3.0 * d2);
    if (depth < z.x) {
        let u = max(1.0 - (z.x - depth) * m1 / max(2.0 * tau.x, 1e-12), 0.0);
        return tau.x * u * u;
    }
    if (depth >= z.z) {
        let rest = max(points.total - tau.z, 0.0);
        let u = max(1.0 - (depth - z.z) * m3 / max(2.0 * rest, 1e-12), 0.0);
        return tau.z + rest * (1.0 - u * u);
    }
    let m2 = min(0.5 * (d1 + d2), 2.5 * min(d1, d2));
    let first = depth < z.y;
    let z0 = select(z.y, z.x, first);
    let width = select(h2, h1, first);
    let p = select(tau.y, tau.x, first);
    let q = select(tau.z, tau.y, first);
    let mp = select(m2, m1, first);
    let mq = select(m3, m2, first);
    let u = min((depth - z0) / width, 1.0);
    let v = 1.0 - u;
    return p * (1.0 + 2.0 * u) * v * v + q * u * u * (3.0 - 2.0 * u)
        + width * u * v * (mp * v - mq * u);
}

fn transmittance_default(texel: vec4<f32>, depth: f32) -> f32 {
    return exp(-optical_depth_at(nodes(texel), depth));
}

// The paper's lookup; see src/kernel/threshold.rs for what it leaves open.
fn transmittance_paper(texel: vec4<f32>, depth: f32) -> f32 {
    let t = frame.thresholds.xyz;
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
