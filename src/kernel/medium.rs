//! What steps through the medium do to light.

use glam::Vec4;

/// The whole sphere's solid angle.
pub const FOUR_PI: f32 = 4.0 * std::f32::consts::PI;
/// Keeps 0 / 0 out where nothing is scattered.
pub const SMALLEST_WEIGHT: f32 = 1e-30;

/// Opacity of a step of optical depth `tau`: 1 - exp(-tau).
#[inline]
pub fn step_opacity(tau: f32) -> f32 {
    1.0 - (-tau).exp()
}

/// Mean transmittance over a step of optical depth `tau` to its front: (1 - exp(-tau)) / tau, by
/// its series where the difference has no digits.
#[inline]
pub fn mean_transmittance(tau: f32) -> f32 {
    if tau < 0.01 { 1.0 - tau * (0.5 - tau / 6.0) } else { step_opacity(tau) / tau }
}

/// Share of light scattered per steradian into an angle of the given cosine between the ways that
/// light travels before and after (Henyey and Greenstein 1941); 1 / (4 pi) for g = 0.
#[inline]
pub fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (FOUR_PI * spread * spread.sqrt())
}

/// Light scattered into an angle of the given cosine behind `transmittance`, per steradian, with
/// `count` octaves more (Wrenninge, Kulla and Lundqvist 2013): each carries half of the light of
/// the one before, through the square root of its transmittance, with half of its mean cosine. Here
/// their shares add up to 1, so that what lies in the light keeps its brightness. It looks like
/// light that was scattered more than once; no energy is accounted for.
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

/// What four steps of a ray add to a picture: where to sample the light for each of them, or for
/// several at once, which then stand in the first one's place and leave the others without weight.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Share of the ray's light.
    pub weights: Vec4,
    /// Distances along the ray: what the samples hold, on average.
    pub places: Vec4,
    /// Transmittance from the camera to the end of the four steps.
    pub through: f32,
}

/// Four steps with two samples each: optical depths in order, the distance of the first sample and
/// the distance between samples, and the transmittance from the camera in front of them. Steps
/// share a place if they add at most `weight` together: all four if they are no longer than
/// `length`, else the first or the last two.
#[inline]
pub fn scattered(
    through: f32,
    [early, late]: [Vec4; 2],
    first: f32,
    spacing: f32,
    [weight, length]: [f32; 2],
) -> Scattered {
    let (first_half, middle) = taken(through, early);
    let (last_half, behind) = taken(middle, late);
    let along = first + spacing * Vec4::new(0.0, 1.0, 2.0, 3.0);
    let (held, held_late) = (first_half * along, last_half * (along + 4.0 * spacing));
    let pairs = |a: Vec4, b: Vec4| Vec4::new(a.x + a.y, a.z + a.w, b.x + b.y, b.z + b.w);
    let mut weights = pairs(first_half, last_half);
    let mut moments = pairs(held, held_late);
    let sums = [weights.x + weights.y, weights.z + weights.w];
    if sums[0] + sums[1] <= weight && 8.0 * spacing <= length {
        weights = Vec4::new(sums[0] + sums[1], 0.0, 0.0, 0.0);
        moments.x += moments.y + moments.z + moments.w;
    } else {
        if sums[0] <= weight {
            (weights.x, weights.y) = (sums[0], 0.0);
            moments.x += moments.y;
        }
        if sums[1] <= weight {
            (weights.z, weights.w) = (sums[1], 0.0);
            moments.z += moments.w;
        }
    }
    let places = moments / weights.max(Vec4::splat(SMALLEST_WEIGHT));
    Scattered { weights, places, through: behind }
}

impl Scattered {
    /// How many steps the place of step `k` stands for.
    #[inline]
    pub fn shared_steps(&self, k: usize) -> u32 {
        let weights = self.weights;
        if weights.y + weights.z + weights.w <= 0.0 {
            return 4;
        }
        let partner = if k > 1 { weights.w } else { weights.y };
        if partner <= 0.0 { 2 } else { 1 }
    }
}

/// What four samples take of the light, and what is left behind them.
#[inline]
fn taken(through: f32, taus: Vec4) -> (Vec4, f32) {
    let kept = (-taus).exp();
    let half = kept.x * kept.y;
    let behind = through * Vec4::new(kept.x, half, half * kept.z, half * kept.z * kept.w);
    (Vec4::new(through, behind.x, behind.y, behind.z) - behind, behind.w)
}
