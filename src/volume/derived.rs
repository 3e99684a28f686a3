//! Volumes derived from others: with every value replaced, or with the gradient's length.

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use ndarray::Array3;

use super::{Volume, Voxels, place_of};
use crate::parallel;

impl Volume {
    /// The same volume with every density replaced; results that are negative or not finite become
    /// 0.
    #[must_use]
    pub fn mapped(&self, replace: impl Fn(f32) -> f32 + Sync) -> Self {
        let mut voxels = Voxels::clone(&self.voxels);
        voxels.replace(|v| {
            let replaced = replace(v);
            if replaced.is_finite() { replaced.max(0.0) } else { 0.0 }
        });
        self.holding(voxels)
    }

    /// The length of the density's gradient (central differences, one-sided at the border, in world
    /// lengths), relative to the largest, 0..1.
    #[must_use]
    pub fn gradient_magnitude(&self) -> Self {
        // The inverse transpose turns changes per voxel into changes per world length.
        let to_world = self.world_from_index.inverse().transpose();
        let dims = self.dims();
        let value = |[x, y, z]: [usize; 3]| match &*self.voxels {
            Voxels::Dense(values) => f64::from(values[[z, y, x]]),
            Voxels::Sparse(voxels) => f64::from(voxels.get([x, y, z])),
        };
        let length = |at: [usize; 3]| {
            let change = |axis: usize| {
                let (mut low, mut high) = (at, at);
                low[axis] = at[axis].saturating_sub(1);
                high[axis] = (at[axis] + 1).min(dims[axis] - 1);
                let voxels = (high[axis] - low[axis]).max(1) as f64;
                (value(high) - value(low)) / voxels
            };
            let gradient = DVec3::new(change(0), change(1), change(2));
            to_world.transform_vector3(gradient).length() as f32
        };
        let mut lengths = match &*self.voxels {
            Voxels::Dense(values) => {
                let mut lengths = Array3::zeros(values.dim());
                if let Some(all) = lengths.as_slice_mut() {
                    let rows = all.chunks_mut(dims[0]).enumerate();
                    parallel::for_each(rows, |(row, lengths)| {
                        for (x, own) in lengths.iter_mut().enumerate() {
                            *own = length(place_of(row * dims[0] + x, dims));
                        }
                    });
                }
                Voxels::Dense(lengths)
            }
            Voxels::Sparse(voxels) => Voxels::Sparse(voxels.derived(length)),
        };
        let largest = lengths.largest().max(f32::MIN_POSITIVE);
        lengths.replace(|length| length / largest);
        self.holding(lengths)
    }

    /// The same volume with other values of the same shape, finite and at least 0.
    fn holding(&self, voxels: Voxels) -> Self {
        let largest = voxels.largest();
        let name = self.name.clone();
        let (bricks, typical) = (OnceLock::new(), OnceLock::new());
        let voxels = Arc::new(voxels);
        Self { name, voxels, largest, replaced: 0, levels: None, bricks, typical, ..*self }
    }
}
