//! An array into which tiles and leaves of a tree are written where they lie in its box.

use glam::IVec3;

use super::grid_type::slot_of;
use super::index_box::IndexBox;
use super::mask;
use super::tree::{Leaf, Tile};

/// The values of the voxels of a box.
pub(super) struct Canvas<'a, U> {
    pub(super) bounds: IndexBox,
    /// Lengths of the array along x and y, counted from the box's first voxel; they may exceed the
    /// box.
    pub(super) along: [usize; 2],
    pub(super) values: &'a mut [U],
}

impl<U: Copy> Canvas<'_, U> {
    /// Writes a tile's voxels through `convert`, whose second argument says whether they are
    /// active.
    pub(super) fn add_tile<T: Copy>(&mut self, tile: &Tile<T>, convert: impl Fn(T, bool) -> U) {
        let value = convert(tile.value, tile.active);
        self.for_each_row(tile.bounds(), |row, _| row.fill(value));
    }

    /// Writes a leaf's voxels, as for a tile.
    pub(super) fn add_leaf<T: Copy>(&mut self, leaf: &Leaf<'_, T>, convert: impl Fn(T, bool) -> U) {
        let stride = 1 << (2 * leaf.log_edge);
        self.for_each_row(leaf.bounds(), |row, first| {
            let first = slot_of(first, leaf.log_edge, 0);
            for (voxel, slot) in row.iter_mut().zip((first..).step_by(stride)) {
                *voxel = convert(leaf.values[slot], mask::is_set(leaf.active, slot));
            }
        });
    }

    /// Calls `fill` for the rows along x within `cube`, with the row's first voxel.
    fn for_each_row(&mut self, cube: IndexBox, mut fill: impl FnMut(&mut [U], IVec3)) {
        let Some(part) = cube.intersection(&self.bounds) else { return };
        let [nx, ny] = self.along;
        let offset = |index: i32, min: i32| (i64::from(index) - i64::from(min)) as usize;
        let length = offset(part.max.x, part.min.x) + 1;
        for z in part.min.z..=part.max.z {
            for y in part.min.y..=part.max.y {
                let row = offset(z, self.bounds.min.z) * ny + offset(y, self.bounds.min.y);
                let start = row * nx + offset(part.min.x, self.bounds.min.x);
                fill(&mut self.values[start..start + length], IVec3::new(part.min.x, y, z));
            }
        }
    }
}
