//! The threshold map as data: four numbers a texel.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::ShadowMap;
use crate::frame::Frame;
use crate::kernel::light::light_extent;
use crate::kernel::threshold::{Curve, curve, optical_depth_at, transmittance_paper};
use crate::scene::LightView;
use crate::settings::{Lookup, Settings};

/// Depths at three opacities and the largest opacity, of each texel (volumetric deep shadow maps,
/// "Implementation"). What unset channels hold: `kernel::threshold`.
#[derive(Clone, Debug)]
pub struct ThresholdMap {
    size: u32,
    /// `size * size` texels, row 0 at v = 0: R, G, B = depths in world lengths along the texel's
    /// ray, A = largest opacity.
    texels: Vec<[f32; 4]>,
    thresholds: [f64; 3],
    lookup: Lookup,
    view: LightView,
    /// What the default lookup reads, made once; empty for the paper's.
    curves: Vec<Curve>,
}

impl ThresholdMap {
    /// A map of `settings.map_size` squared `texels`, built with `settings` from `view` for `frame`.
    ///
    /// # Panics
    /// If the number of texels is another one.
    pub fn new(texels: Vec<[f32; 4]>, settings: &Settings, view: LightView, frame: &Frame) -> Self {
        let size = settings.map_size;
        assert_eq!(texels.len(), size as usize * size as usize, "texels of a {size}^2 map");
        let curve_of = |i: usize| {
            let at = |c: usize| (c as f32 + 0.5) / size as f32;
            let (enter, exit) = light_extent(frame, at(i % size as usize), at(i / size as usize));
            let depths = frame.threshold_depths.truncate();
            curve(Vec4::from(texels[i]), frame.thresholds.truncate(), depths, [enter, exit])
        };
        let curves = match settings.lookup {
            Lookup::Default => (0..texels.len()).into_par_iter().map(curve_of).collect(),
            Lookup::Paper => Vec::new(),
        };
        let lookup = settings.lookup;
        Self { size, texels, thresholds: settings.thresholds, lookup, view, curves }
    }

    /// The texels, row 0 at v = 0: depths R, G, B in world lengths along the ray, opacity A.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// The opacities whose depths R, G, B hold.
    pub fn thresholds(&self) -> [f64; 3] {
        self.thresholds
    }

    /// The lookup that the map is made for.
    pub fn lookup(&self) -> Lookup {
        self.lookup
    }

    /// How the map lies in the world.
    pub fn view(&self) -> &LightView {
        &self.view
    }
}

impl ShadowMap for ThresholdMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let i = y as usize * self.size as usize + x as usize;
        match self.lookup {
            Lookup::Default => (-optical_depth_at(&self.curves[i], depth)).exp(),
            Lookup::Paper => {
                let thresholds = Vec3::from_array(self.thresholds.map(|t| t as f32));
                transmittance_paper(Vec4::from(self.texels[i]), thresholds, depth)
            }
        }
    }
}
