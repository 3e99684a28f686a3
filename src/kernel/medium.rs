//! What steps through the medium do to light.

use glam::{Vec2, Vec4};

use crate::frame::LOOKUP_WEIGHT;

/// The whole sphere's solid angle.
pub const FOUR_PI: f32 = 4.0 * std::f32::consts::PI;
/// Keeps 0 / 0 out where nothing is scattered.
pub const SMALLEST_WEIGHT: f32 = 1e-30;

/// Opacity of a step of optical depth `tau`: 1 - exp(-tau).
#[inline]
pub fn step_opacity(tau: f32) -> f32 {
    1.0 - (-tau).exp()
}

/// Share of light scattered per steradian into an angle of the given cosine between the ways that
/// light travels before and after (Henyey and Greenstein 1941); 1 / (4 pi) for g = 0.
pub fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (FOUR_PI * spread * spread.sqrt())
}

/// Light scattered into an angle of the given cosine behind `transmittance`, per steradian, with `count`
/// octaves more (Wrenninge, Kulla and Lundqvist 2013): each carries half of the light of the one before,
/// through the square root of its transmittance, with half of its mean cosine. Here their shares add up to
/// 1, so that what lies in the light keeps its brightness. It looks like light that was scattered more than
/// once; no energy is accounted for.
pub fn octaves(count: u32, g: f32, cosine: f32, transmittance: f32) -> f32 {
    let (mut share, mut g, mut through) = (1.0, g, transmittance);
    let (mut sum, mut shares) = (phase(g, cosine) * through, 1.0);
    for _ in 0..count {
        share *= 0.5;
        g *= 0.5;
        through = through.sqrt();
        sum += share * phase(g, cosine) * through;
        shares += share;
    }
    sum / shares
}

/// What two steps of a ray add to a picture: where to sample the light for each of them, or for both at
/// once, which then weighs nothing in the second place.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Share of the ray's light.
    pub weights: Vec2,
    /// Distances along the ray: what the samples hold, on average.
    pub places: Vec2,
    /// Transmittance from the camera to the end of the two steps.
    pub through: f32,
}

/// Two steps with two samples each: optical depths and distances in order, and the transmittance from
/// the camera in front of them. They share a place if they add at most [`LOOKUP_WEIGHT`] together.
pub fn scattered(through: f32, taus: Vec4, distances: Vec4) -> Scattered {
    let kept = (-taus).exp();
    let half = kept.x * kept.y;
    let behind = through * Vec4::new(kept.x, half, half * kept.z, half * kept.z * kept.w);
    let taken = Vec4::new(through, behind.x, behind.y, behind.z) - behind;
    let held = taken * distances;
    let mut weights = Vec2::new(taken.x + taken.y, taken.z + taken.w);
    let mut moments = Vec2::new(held.x + held.y, held.z + held.w);
    if weights.x + weights.y <= LOOKUP_WEIGHT {
        weights = Vec2::new(weights.x + weights.y, 0.0);
        moments.x += moments.y;
    }
    let places = moments / weights.max(Vec2::splat(SMALLEST_WEIGHT));
    Scattered { weights, places, through: behind.w }
}
