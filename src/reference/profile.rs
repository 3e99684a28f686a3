//! Transmittance along the light's rays: the function that every shadow map approximates.

use super::extinction::{Extinction, WorldRay};
use crate::scene::LightView;

/// Transmittance over depth along one light ray.
#[derive(Clone, Debug)]
pub struct TexelProfile {
    /// Transmittance at each of the requested depths, 0..1.
    pub transmittance: Vec<f64>,
    /// Transmittance behind everything, 0..1.
    pub last: f64,
    /// Depths in world lengths where the ray enters the first and leaves the last volume or surface;
    /// equal if it misses all.
    pub extent: [f64; 2],
}

impl TexelProfile {
    /// Transmittance at the rising `depths`, in world lengths, along the light ray through `(u, v)`
    /// of `view`.
    pub fn trace(
        extinction: &Extinction<'_>,
        view: &LightView,
        [u, v]: [f64; 2],
        depths: &[f64],
    ) -> Self {
        let (origin, direction) = view.ray(u, v);
        let mut taus = vec![0.0; depths.len()];
        let ray = WorldRay { origin, direction };
        let (total, extent) = extinction.profile(ray, depths, &mut taus);
        // Exponentials are not recomputed along empty cells.
        let (mut last_tau, mut reached) = (0.0, 1.0);
        let mut transmittance_of = |tau: f64| {
            if tau != last_tau {
                (last_tau, reached) = (tau, (-tau).exp());
            }
            reached
        };
        let mut transmittance: Vec<f64> = taus.into_iter().map(&mut transmittance_of).collect();
        let mut last = transmittance_of(total);
        let crossed = extinction.crossings().along(origin, direction, [0.0, f64::INFINITY]);
        for &[at, opacity] in &crossed {
            let behind = depths.partition_point(|&depth| depth < at);
            transmittance[behind..].iter_mut().for_each(|value| *value *= 1.0 - opacity);
            last *= 1.0 - opacity;
        }
        let ends = extent.into_iter().flatten().chain(crossed.iter().map(|[at, _]| *at));
        let extent = ends.fold(None, |extent: Option<[f64; 2]>, at| {
            let [enter, exit] = extent.unwrap_or([at; 2]);
            Some([enter.min(at), exit.max(at)])
        });
        Self { transmittance, last, extent: extent.unwrap_or_default() }
    }
}
