//! A box of a tree as a dense array, within a limit of memory: a file of a few kilobytes may
//! rightly claim 4096^3 voxels. It knows nothing of files.

use glam::IVec3;
use ndarray::Array3;
use rayon::prelude::*;

use super::grid_type::slot_of;
use super::index_box::IndexBox;
use super::mask;
use super::tree::{Leaf, Tile, Tree};
use super::value::Value;
use crate::error::{ErrorKind, Result};

/// All voxels of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense<U> {
    /// Shape (z, y, x): x runs fastest.
    pub values: Array3<U>,
    /// Index of the first voxel.
    pub origin: IVec3,
}

impl<T: Value> Tree<T> {
    /// All voxels of `bounds`, active or not, each through `convert`.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if the array takes more than `limit_bytes`; it says how much it takes.
    pub fn densify<U: Copy + Send + Sync>(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Dense<U>> {
        self.densify_active(bounds, limit_bytes, |value, _| convert(value))
    }

    /// As [`Tree::densify`]; `convert` is told whether the voxel is active, too.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if the array takes more than `limit_bytes`; it says how much it takes.
    pub fn densify_active<U: Copy + Send + Sync>(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        convert: impl Fn(T, bool) -> U + Sync,
    ) -> Result<Dense<U>> {
        let voxels = checked_voxels(&bounds, size_of::<U>(), limit_bytes)?;
        let [nx, ny, nz] = bounds.dims().map(|length| length as usize);
        let mut values = vec![convert(self.background(), false); voxels];

        // The array is cut in slabs where the leaves are cut, and each slab is filled by a thread.
        let log_edge = self.leaves().next().map_or(3, |leaf| leaf.log_edge);
        let mut slabs: Vec<Slab<T, U>> = Vec::new();
        let mut rest = values.as_mut_slice();
        let mut low = bounds.min.z;
        while !rest.is_empty() {
            let high = (low | ((1 << log_edge) - 1)).min(bounds.max.z);
            let layers = (high - low) as usize + 1;
            let (data, after) = std::mem::take(&mut rest).split_at_mut(layers * nx * ny);
            let mut bounds = bounds;
            (bounds.min.z, bounds.max.z) = (low, high);
            slabs.push(Slab { bounds, data, leaves: Vec::new(), tiles: Vec::new() });
            rest = after;
            low = high.saturating_add(1);
        }
        // Slab of a height within the bounds.
        let slab_of = |z: i32| ((z >> log_edge) - (bounds.min.z >> log_edge)) as usize;
        for tile in self.tiles() {
            if let Some(part) = tile.bounds().intersection(&bounds) {
                for slab in &mut slabs[slab_of(part.min.z)..=slab_of(part.max.z)] {
                    slab.tiles.push(tile);
                }
            }
        }
        for leaf in self.leaves() {
            if let Some(part) = leaf.bounds().intersection(&bounds) {
                slabs[slab_of(part.min.z)].leaves.push(leaf);
            }
        }
        slabs.into_par_iter().for_each(|mut slab| slab.fill(&convert));

        let values = Array3::from_shape_vec((nz, ny, nx), values)
            .map_err(|error| crate::Error::value("dense grid", error.to_string()))?;
        Ok(Dense { values, origin: bounds.min })
    }
}

/// Number of voxels of the box, if they fit the limit.
fn checked_voxels(bounds: &IndexBox, voxel_bytes: usize, limit_bytes: u64) -> Result<usize> {
    let [x, y, z] = bounds.dims();
    let voxels = u128::from(x) * u128::from(y) * u128::from(z);
    let bytes = voxels * voxel_bytes as u128;
    if bytes > u128::from(limit_bytes.min(isize::MAX as u64)) {
        return Err(ErrorKind::Limit {
            what: format!("a dense grid of {x} x {y} x {z} voxels"),
            needed: format!("{bytes} bytes"),
            limit: format!("{limit_bytes} bytes"),
        }
        .into());
    }
    Ok(voxels as usize)
}

/// The part of the array that one thread fills, and what falls into it.
struct Slab<'a, T, U> {
    bounds: IndexBox,
    data: &'a mut [U],
    leaves: Vec<Leaf<'a, T>>,
    tiles: Vec<Tile<T>>,
}

impl<T: Value, U: Copy> Slab<'_, T, U> {
    fn fill(&mut self, convert: &impl Fn(T, bool) -> U) {
        for tile in std::mem::take(&mut self.tiles) {
            let value = convert(tile.value, tile.active);
            self.for_each_row(tile.bounds(), |row, _| row.fill(value));
        }
        for leaf in std::mem::take(&mut self.leaves) {
            let stride = 1 << (2 * leaf.log_edge);
            self.for_each_row(leaf.bounds(), |row, first| {
                let first = slot_of(first, leaf.log_edge, 0);
                for (voxel, slot) in row.iter_mut().zip((first..).step_by(stride)) {
                    *voxel = convert(leaf.values[slot], mask::is_set(leaf.active, slot));
                }
            });
        }
    }

    /// Runs `fill` on the slab's rows along x within `cube`, with the row's first voxel.
    fn for_each_row(&mut self, cube: IndexBox, mut fill: impl FnMut(&mut [U], IVec3)) {
        let Some(part) = cube.intersection(&self.bounds) else { return };
        let [nx, ny, _] = self.bounds.dims().map(|length| length as usize);
        let offset = |index: i32, min: i32| (i64::from(index) - i64::from(min)) as usize;
        let length = offset(part.max.x, part.min.x) + 1;
        for z in part.min.z..=part.max.z {
            for y in part.min.y..=part.max.y {
                let row = offset(z, self.bounds.min.z) * ny + offset(y, self.bounds.min.y);
                let start = row * nx + offset(part.min.x, self.bounds.min.x);
                fill(&mut self.data[start..start + length], IVec3::new(part.min.x, y, z));
            }
        }
    }
}
