// What steps through the medium do to light.
#import kernel/frame

const FOUR_PI: f32 = 12.566370614359172;
const SMALLEST_WEIGHT: f32 = 1e-30;

// Opacity of a step of optical depth tau.
fn step_opacity(tau: f32) -> f32 {
    return 1.0 - exp(-tau);
}

// Share of light scattered per steradian (Henyey and Greenstein 1941).
fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (FOUR_PI * spread * sqrt(spread));
}

// Light scattered into an angle of the given cosine behind a transmittance, with `count` octaves more.
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

// What two steps of a ray add to a picture: where to sample the light for each of them, or for both
// at once, which then weighs nothing in the second place.
struct Scattered {
    // Share of the ray's light.
    weights: vec2<f32>,
    // Distances along the ray: what the samples hold, on average.
    places: vec2<f32>,
    // Transmittance from the camera to the end of the two steps.
    through: f32,
}

// Two steps with two samples each: optical depths and distances in order, and the transmittance from the
// camera in front of them.
fn scattered(through: f32, taus: vec4<f32>, distances: vec4<f32>) -> Scattered {
    let kept = exp(-taus);
    let half = kept.x * kept.y;
    let behind = through * vec4<f32>(kept.x, half, half * kept.z, half * kept.z * kept.w);
    let taken = vec4<f32>(through, behind.xyz) - behind;
    let held = taken * distances;
    var weights = taken.xz + taken.yw;
    var moments = held.xz + held.yw;
    if (weights.x + weights.y <= LOOKUP_WEIGHT) {
        weights = vec2<f32>(weights.x + weights.y, 0.0);
        moments.x += moments.y;
    }
    return Scattered(weights, moments / max(weights, vec2<f32>(SMALLEST_WEIGHT)), behind.w);
}
