//! The threshold map as data: four numbers per texel.

use std::sync::OnceLock;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{Shadow, TexelMap};
use crate::frame::Frame;
use crate::kernel::light::light_extent;
use crate::kernel::threshold::{Curve, curve, optical_depth_at, transmittance_paper};
use crate::math::Each;
use crate::scene::LightView;
use crate::settings::{Lookup, Settings};

/// For each texel, the depths R, G, B at three opacities (the thresholds), and the largest opacity
/// A ("Volumetric Deep Shadow Maps", section "Implementation").
///
/// Where a texel never reaches a threshold, its channel holds something else. In a map for
/// [`Lookup::Default`] that is the depth where opacity reaches a fixed share of the texel's own A,
/// one of 10, 50 and 85 %; A tells which thresholds are reached, and so what each channel holds.
/// In a map for [`Lookup::Paper`] it is the depth where the ray leaves the volume.
#[derive(Clone, Debug)]
pub struct ThresholdMap {
    size: u32,
    /// `size * size` texels, row 0 at v = 0: R, G, B = depths along the texel's ray in units of the
    /// view, A = largest opacity.
    texels: Vec<[f32; 4]>,
    thresholds: [f64; 3],
    lookup: Lookup,
    view: LightView,
    /// The curves that the default lookup reads, computed at the first lookup.
    curves: OnceLock<Vec<Curve>>,
    frame: Box<Frame>,
}

impl ThresholdMap {
    /// A map with `texels`, `settings.map.size` squared of them, row 0 at v = 0, built with
    /// `settings` from `view` for `frame`.
    ///
    /// # Panics
    /// If the number of texels is another one.
    pub fn new(texels: Vec<[f32; 4]>, settings: &Settings, view: LightView, frame: &Frame) -> Self {
        let size = settings.map.size;
        assert_eq!(texels.len(), size as usize * size as usize, "texels of a {size}^2 map");
        let lookup = settings.map.threshold.lookup;
        let thresholds = settings.map.threshold.levels;
        let (curves, frame) = (OnceLock::new(), Box::new(*frame));
        Self { size, texels, thresholds, lookup, view, curves, frame }
    }

    /// The curve of every texel. They are computed on one thread unless the map is prepared,
    /// because the first lookup may come from any thread.
    fn curves(&self) -> &[Curve] {
        self.curves.get_or_init(|| (0..self.texels.len()).map(|i| self.curve(i)).collect())
    }

    /// The curve of a texel.
    fn curve(&self, texel: usize) -> Curve {
        let (size, frame) = (self.size as usize, &*self.frame);
        let depths = frame.map.threshold_depths;
        let at = |c: usize| (c as f32 + 0.5) / size as f32;
        let (enter, exit) = light_extent(frame, at(texel % size), at(texel / size));
        let texel = Vec4::from(self.texels[texel]);
        curve(texel, frame.map.thresholds, depths, [enter, exit])
    }

    /// The texels, row by row, row 0 at v = 0: depths R, G, B along the texel's ray in units of the
    /// view ([`LightView::unit`]), world lengths for scenes of ordinary size, and opacity A.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// The opacities whose depths R, G, B hold, where they are reached.
    pub fn thresholds(&self) -> [f64; 3] {
        self.thresholds
    }

    /// The lookup that the map was made for.
    pub fn lookup(&self) -> Lookup {
        self.lookup
    }

    /// The light's view that the map was built from.
    pub fn view(&self) -> &LightView {
        &self.view
    }
}

impl Shadow for ThresholdMap {
    fn prepare(&self) {
        if self.lookup == Lookup::Default && self.curves.get().is_none() {
            let texels = (0..self.texels.len()).into_par_iter();
            // Another thread may have set the same curves first.
            let _ = self.curves.set(texels.map(|i| self.curve(i)).collect());
        }
    }

    fn bytes(&self) -> u64 {
        size_of_val(self.texels()) as u64
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for ThresholdMap {
    fn size(&self) -> u32 {
        self.size
    }

    fn front(&self, x: u32, y: u32) -> Option<f32> {
        let [_, middle, _, a] = self.texels[y as usize * self.size as usize + x as usize];
        // Only where all thresholds are reached: other channels hold depths at shares of the
        // texel's own opacity.
        (a >= self.thresholds[2] as f32).then_some(middle)
    }

    fn reach(&self) -> f32 {
        self.frame.map.surface_reach
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let i = y as usize * self.size as usize + x as usize;
        match self.lookup {
            Lookup::Default => (-optical_depth_at(&self.curves()[i], depth)).exp(),
            Lookup::Paper => {
                let thresholds = Vec3::from_array(self.thresholds.each(|t| t as f32));
                transmittance_paper(Vec4::from(self.texels[i]), thresholds, depth)
            }
        }
    }
}
