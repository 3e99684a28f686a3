//! A box of a tree as a dense array, within a limit of memory: a valid file of a few kilobytes may
//! contain 4096^3 voxels. Knows nothing of files.

use glam::IVec3;
use ndarray::Array3;

use super::canvas::Canvas;
use super::index_box::IndexBox;
use super::tree::{Leaf, Tile, Tree};
use super::value::Value;
use crate::error::memory;
use crate::error::{ErrorKind, Result};
use crate::parallel;

/// All voxels of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense<U> {
    /// The values, shape (z, y, x), so x is fastest.
    pub values: Array3<U>,
    /// Index of the first voxel.
    pub origin: IVec3,
}

impl<T: Value> Tree<T> {
    /// All voxels of `bounds`, active or not, each converted by `convert`.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if the array takes more than `limit_bytes`; the error says how many it
    /// takes.
    pub fn densify<U: Copy + Send + Sync>(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Dense<U>> {
        self.densify_active(bounds, limit_bytes, |value, _| convert(value))
    }

    /// Like [`Tree::densify`], but `convert` also receives whether the voxel is active.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if the array takes more than `limit_bytes`; the error says how many it
    /// takes.
    pub fn densify_active<U: Copy + Send + Sync>(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        convert: impl Fn(T, bool) -> U + Sync,
    ) -> Result<Dense<U>> {
        let voxels = checked_voxels(&bounds, size_of::<U>(), limit_bytes)?;
        let [nx, ny, nz] = bounds.dims().map(|length| length as usize);
        let mut values = memory::filled(voxels, convert(self.background(), false), "a dense grid")?;

        // The array is cut into slabs along the leaves' borders, and each slab is filled by one
        // thread.
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
        // Index of the slab that contains a height.
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
        parallel::for_each(slabs, |slab| slab.fill(&convert));

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

/// The part of the array that one thread fills, and the tiles and leaves in it.
struct Slab<'a, T, U> {
    bounds: IndexBox,
    data: &'a mut [U],
    leaves: Vec<Leaf<'a, T>>,
    tiles: Vec<Tile<T>>,
}

impl<T: Value, U: Copy> Slab<'_, T, U> {
    fn fill(self, convert: &impl Fn(T, bool) -> U) {
        let [nx, ny, _] = self.bounds.dims().map(|length| length as usize);
        let mut canvas = Canvas { bounds: self.bounds, along: [nx, ny], values: self.data };
        self.tiles.iter().for_each(|tile| canvas.add_tile(tile, convert));
        self.leaves.iter().for_each(|leaf| canvas.add_leaf(leaf, convert));
    }
}
