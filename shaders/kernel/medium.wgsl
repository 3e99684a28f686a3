// How steps through the medium change light.
#import kernel/frame

const FOUR_PI: f32 = 12.566370614359172;
const SMALLEST_WEIGHT: f32 = 1e-30;

// Opacity of a step of optical depth tau: 1 - exp(-tau).
fn step_opacity(tau: f32) -> f32 {
    return 1.0 - exp(-tau);
}

// Mean over a step of optical depth tau of the transmittance from each point to the step's front.
fn mean_transmittance(tau: f32) -> f32 {
    if (tau < 0.01) {
        return 1.0 - tau * (0.5 - tau / 6.0);
    }
    return step_opacity(tau) / tau;
}

// The phase function: share of light scattered per steradian (Henyey and Greenstein 1941).
fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (FOUR_PI * spread * sqrt(spread));
}

// Light scattered by an angle with the given cosine, behind a transmittance, with `count` further
// octaves (src/kernel/medium.rs).
fn octaves(count: u32, g: f32, cosine: f32, transmittance: f32) -> f32 {
    var share: f32 = 1.0;
    var narrow = g;
    var through = transmittance;
    var sum = phase(g, cosine) * through;
    var shares: f32 = 1.0;
    for (var i: u32 = 0u; i < count; i++) {
        share *= 0.5;
        narrow *= 0.5;
        through = sqrt(through);
        sum += share * phase(narrow, cosine) * through;
        shares += share;
    }
    return sum / shares;
}

// What four steps of a ray add to a picture, and where to sample the light for them. Steps that
// share a light sample have their weight in the first of them; the others have weight 0.
struct Scattered {
    // Share of the camera ray's light that each step contributes.
    weights: vec4<f32>,
    // Distances along the ray: the weighted mean positions of the density samples that they stand
    // for.
    places: vec4<f32>,
    // Transmittance from the camera to the end of the four steps.
    through: f32,
}

// Combines four steps with two density samples each. `through` is the transmittance from the camera
// to their front, `early` and `late` are the samples' optical depths in order, `first` is the
// distance of the first sample and `spacing` that between samples.
fn scattered(
    through: f32,
    early: vec4<f32>,
    late: vec4<f32>,
    first: f32,
    spacing: f32,
) -> Scattered {
    let near = left_behind(through, early);
    let far = left_behind(near.w, late);
    let taken_near = vec4<f32>(through, near.xyz) - near;
    let taken_far = vec4<f32>(near.w, far.xyz) - far;
    let along = first + spacing * vec4<f32>(0.0, 1.0, 2.0, 3.0);
    let held_near = taken_near * along;
    let held_far = taken_far * (along + 4.0 * spacing);
    var weights = vec4<f32>(taken_near.xz + taken_near.yw, taken_far.xz + taken_far.yw);
    var moments = vec4<f32>(held_near.xz + held_near.yw, held_far.xz + held_far.yw);
    let sums = weights.xz + weights.yw;
    if (sums.x + sums.y <= frame.view.shared_weight && 8.0 * spacing <= frame.view.shared_length) {
        weights = vec4<f32>(sums.x + sums.y, 0.0, 0.0, 0.0);
        moments.x += moments.y + moments.z + moments.w;
    } else {
        if (sums.x <= frame.view.shared_weight) {
            weights = vec4<f32>(sums.x, 0.0, weights.zw);
            moments.x += moments.y;
        }
        if (sums.y <= frame.view.shared_weight) {
            weights = vec4<f32>(weights.xy, sums.y, 0.0);
            moments.z += moments.w;
        }
    }
    return Scattered(weights, moments / max(weights, vec4<f32>(SMALLEST_WEIGHT)), far.w);
}

// How many steps share the light sample of step k.
fn shared_steps(weights: vec4<f32>, k: u32) -> u32 {
    if (weights.y + weights.z + weights.w <= 0.0) {
        return 4u;
    }
    let partner = select(weights.y, weights.w, k > 1u);
    return select(1u, 2u, partner <= 0.0);
}

// Transmittance from the camera to behind each of four samples.
fn left_behind(through: f32, taus: vec4<f32>) -> vec4<f32> {
    let kept = exp(-taus);
    let half = kept.x * kept.y;
    return through * vec4<f32>(kept.x, half, half * kept.z, half * kept.z * kept.w);
}
