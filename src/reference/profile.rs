//! Transmittance along the light's rays: the function that every shadow map approximates.

use glam::DVec3;

use super::integral::{Cells, optical_depth};
use crate::scene::{Light, LightView};

/// Transmittance over depth along one light ray.
#[derive(Clone, Debug)]
pub struct TexelProfile {
    /// Transmittance at each of the depths asked for.
    pub transmittance: Vec<f64>,
    /// Transmittance behind the volume.
    pub last: f64,
    /// Depths where the ray enters and leaves the volume; equal if it misses.
    pub extent: [f64; 2],
}

impl TexelProfile {
    /// Transmittance at the rising `depths` along the light ray through `(u, v)` of `view`, under a
    /// density scale (extinction per density).
    pub fn trace(
        cells: &Cells<'_>,
        view: &LightView,
        density_scale: f64,
        [u, v]: [f64; 2],
        depths: &[f64],
    ) -> Self {
        let (origin, direction) = view.ray(u, v);
        let mut transmittance = Vec::with_capacity(depths.len());
        // The integral of density so far, and the transmittance that goes with it: a ray through
        // empty cells takes no exponentials.
        let (mut before, mut reached) = (0.0, 1.0);
        let mut extent: Option<[f64; 2]> = None;
        cells.walk(origin, direction, [0.0, f64::INFINITY], |stretch| {
            let begin = extent.map_or(stretch.enter, |[begin, _]| begin);
            extent = Some([begin, stretch.exit]);
            let empty = stretch.is_empty();
            while let Some(&depth) = depths.get(transmittance.len())
                && depth < stretch.exit
            {
                transmittance.push(if empty || depth <= stretch.enter {
                    reached
                } else {
                    (-density_scale * (before + stretch.integral_to(depth))).exp()
                });
            }
            if !empty {
                before += stretch.integral();
                reached = (-density_scale * before).exp();
            }
            true
        });
        transmittance.resize(depths.len(), reached);
        Self { transmittance, last: reached, extent: extent.unwrap_or_default() }
    }
}

/// Transmittance from `light` to `point`, exact to rounding.
pub fn light_transmittance(
    cells: &Cells<'_>,
    light: &Light,
    density_scale: f64,
    point: DVec3,
) -> f64 {
    let farthest = light.position().map_or(f64::INFINITY, |position| (point - position).length());
    let towards_light = -light.direction_at(point);
    (-density_scale * optical_depth(cells, point, towards_light, [0.0, farthest])).exp()
}
