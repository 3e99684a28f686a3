// What a step through the medium does to light.

const FOUR_PI: f32 = 12.566370614359172;

// Opacity of a step of optical depth tau.
fn step_opacity(tau: f32) -> f32 {
    return 1.0 - exp(-tau);
}

// Share of light scattered per steradian (Henyey and Greenstein 1941).
fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (FOUR_PI * spread * sqrt(spread));
}
