//! Volumes made from others: of their values one by one, and of how they change.

use std::sync::OnceLock;

use glam::DVec3;
use ndarray::Array3;
use rayon::prelude::*;

use super::Volume;

impl Volume {
    /// The same volume with every density replaced; what is negative or not finite becomes 0.
    #[must_use]
    pub fn mapped(&self, replace: impl Fn(f32) -> f32 + Sync) -> Self {
        let mut values = self.values.clone();
        if let Some(all) = values.as_slice_mut() {
            all.par_iter_mut().for_each(|v| {
                let replaced = replace(*v);
                *v = if replaced.is_finite() { replaced.max(0.0) } else { 0.0 };
            });
        }
        self.holding(values)
    }

    /// Length of the density's gradient (central differences, one-sided at the border, world lengths) as
    /// a share of the largest, 0..1.
    #[must_use]
    pub fn gradient_magnitude(&self) -> Self {
        let [nx, ny, nz] = self.dims();
        // From changes a voxel to changes a world length: the transposed inverse.
        let to_world = self.world_from_index.inverse().transpose();
        let mut lengths = Array3::zeros((nz, ny, nx));
        let value = |x: usize, y: usize, z: usize| f64::from(self.values[[z, y, x]]);
        let plane = ny * nx;
        if let Some(all) = lengths.as_slice_mut() {
            all.par_iter_mut().enumerate().for_each(|(i, length)| {
                let at = [i % nx, i / nx % ny, i / plane];
                let change = |axis: usize, n: usize| {
                    let (mut low, mut high) = (at, at);
                    low[axis] = at[axis].saturating_sub(1);
                    high[axis] = (at[axis] + 1).min(n - 1);
                    let voxels = (high[axis] - low[axis]).max(1) as f64;
                    (value(high[0], high[1], high[2]) - value(low[0], low[1], low[2])) / voxels
                };
                let gradient = DVec3::new(change(0, nx), change(1, ny), change(2, nz));
                *length = to_world.transform_vector3(gradient).length() as f32;
            });
        }
        let largest = lengths.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        lengths.mapv_inplace(|length| length / largest);
        self.holding(lengths)
    }

    /// The same volume with other values of the same shape, finite and at least 0.
    fn holding(&self, values: Array3<f32>) -> Self {
        let largest = values.iter().copied().fold(0.0, f32::max);
        let (name, bricks) = (self.name.clone(), OnceLock::new());
        Self { name, values, largest, replaced: 0, bricks, ..*self }
    }
}
