//! What a step through the medium does to light.

/// Opacity of a step of optical depth `tau`: 1 - exp(-tau).
#[inline]
pub fn step_opacity(tau: f32) -> f32 {
    1.0 - (-tau).exp()
}

/// Share of light scattered per steradian into an angle of the given cosine between the ways that
/// light travels before and after (Henyey and Greenstein 1941); 1 / (4 pi) for g = 0.
pub fn phase(g: f32, cosine: f32) -> f32 {
    const FOUR_PI: f32 = 4.0 * std::f32::consts::PI;
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (FOUR_PI * spread * spread.sqrt())
}
