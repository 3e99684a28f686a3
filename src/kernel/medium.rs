//! How steps through the medium change light.

use glam::Vec4;

use super::exponential::{four_transmitted, transmitted};

/// Solid angle of the whole sphere.
pub const FOUR_PI: f32 = 4.0 * std::f32::consts::PI;
/// Weights are raised to this before a division, so that steps that scatter nothing do not give 0 /
/// 0.
pub const SMALLEST_WEIGHT: f32 = 1e-30;

/// Opacity of a step of optical depth `tau`: 1 - exp(-tau).
#[inline]
pub fn step_opacity(tau: f32) -> f32 {
    1.0 - transmitted(tau)
}

/// Mean over a step of optical depth `tau` of the transmittance from each point to the step's
/// front: (1 - exp(-tau)) / tau. For small `tau`, where the difference loses its digits, by its
/// series.
#[inline]
pub fn mean_transmittance(tau: f32) -> f32 {
    if tau < 0.01 { 1.0 - tau * (0.5 - tau / 6.0) } else { step_opacity(tau) / tau }
}

/// The phase function of Henyey and Greenstein (1941): share of light scattered per steradian,
/// where `cosine` is that of the angle between the directions of light before and after; 1 / (4 pi)
/// for g = 0.
#[inline]
pub fn phase(g: f32, cosine: f32) -> f32 {
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (FOUR_PI * spread * spread.sqrt())
}

/// Light scattered per steradian behind `transmittance`, with `count` octaves beside single
/// scattering (Wrenninge, Kulla and Lundqvist 2013); `g` and `cosine` as for [`phase`]. Each octave
/// carries half of the light of the one before, uses the square root of its transmittance and half
/// of its mean cosine. Here the shares add up to 1, so that fully lit parts keep their brightness.
/// The result looks like multiple scattering, but no energy balance is kept.
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

/// What four steps of a ray add to a picture, and where to sample the light for them. Steps that
/// share a light sample have their weight in the first of them; the others have weight 0.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Share of the camera ray's light that each step contributes, 0..1.
    pub weights: Vec4,
    /// Distances along the ray: the weighted mean positions of the density samples that they stand
    /// for.
    pub places: Vec4,
    /// Transmittance from the camera to the end of the four steps.
    pub through: f32,
}

/// Combines four steps with two density samples each. `through` is the transmittance from the
/// camera to their front, `early` and `late` are the samples' optical depths in order, `first` is
/// the distance of the first sample and `spacing` that between samples. Steps share a light sample
/// if they add at most `weight` together: all four if together they are no longer than `length`,
/// else the first two and the last two.
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
    /// How many steps share the light sample of step `k`, 0 to 3.
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

/// The share of light that each of four samples takes, and the transmittance behind them.
#[inline]
fn taken(through: f32, taus: Vec4) -> (Vec4, f32) {
    let kept = four_transmitted(taus);
    let half = kept.x * kept.y;
    let behind = through * Vec4::new(kept.x, half, half * kept.z, half * kept.z * kept.w);
    (Vec4::new(through, behind.x, behind.y, behind.z) - behind, behind.w)
}
