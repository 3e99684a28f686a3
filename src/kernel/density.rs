//! Density between voxels: trilinear interpolation, clamped at the border.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::ray::Ray;
use crate::math::Each;
use crate::volume::{BLOCK_EDGE, SparseVoxels, Volume, Voxels};

/// A volume's voxels, ready to be sampled.
#[derive(Clone, Copy, Debug)]
pub struct Density<'a> {
    values: &'a [f32],
    /// The table of blocks, if the voxels are sparse.
    sparse: Option<&'a SparseVoxels>,
    dims: [usize; 3],
    last: Vec3,
    /// Distances in memory from a voxel to its neighbours along x, y, z; 0 along axes of one voxel.
    next: [usize; 3],
}

impl<'a> Density<'a> {
    /// Refers to the voxels of `volume`.
    pub fn of(volume: &'a Volume) -> Self {
        let dims = volume.dims();
        let (values, sparse, rows) = match volume.voxels() {
            // Volumes are made in standard layout; an empty slice would only ever be sampled as 0.
            Voxels::Dense(values) => (values.as_slice().unwrap_or_default(), None, dims),
            Voxels::Sparse(voxels) => (voxels.values(), Some(voxels), [BLOCK_EDGE; 3]),
        };
        let mut next = [1, rows[0], rows[0] * rows[1]];
        for (next, n) in next.iter_mut().zip(dims) {
            *next *= usize::from(n > 1);
        }
        let last = Vec3::from_array(dims.each(|n| (n - 1) as f32));
        Self { values, sparse, dims, last, next }
    }

    /// Where the values of four voxels stand; `None` beyond the last ones.
    #[inline]
    fn bases(&self, [x, y, z]: [[u32; 4]; 3]) -> Option<[u32; 4]> {
        let lanes = [0, 1, 2, 3];
        if let Some(voxels) = self.sparse {
            let offset = |i: usize| voxels.offset([x[i], y[i], z[i]].each(|c| c as usize));
            let [a, b, c, d] = lanes.each(offset);
            return Some([a? as u32, b? as u32, c? as u32, d? as u32]);
        }
        let [nx, ny, _] = self.dims.each(|n| n as u32);
        // Indices that are NaN give any number, which is checked.
        let row = |i: usize| z[i].wrapping_mul(ny).wrapping_add(y[i]);
        Some(lanes.each(|i| row(i).wrapping_mul(nx).wrapping_add(x[i])))
    }

    /// The values from voxel (x, y, z) to the opposite corner of the cell that begins there.
    #[allow(clippy::inline_always)] // Eight of them are in every sample's way.
    #[inline(always)]
    fn cell(&self, voxel: [usize; 3]) -> Option<&'a [f32]> {
        let base = if let Some(voxels) = self.sparse {
            voxels.offset(voxel)?
        } else {
            let ([x, y, z], [nx, ny, _]) = (voxel, self.dims);
            (z * ny + y) * nx + x
        };
        let [dx, dy, dz] = self.next;
        self.values.get(base..=base + dx + dy + dz)
    }
}

/// 1.5 times 2^23. An f32 of this size has no fraction, so a number added to it is rounded to the
/// nearest integer, which then stands in its lowest bits. (Conversions of floats to integers
/// saturate in Rust, which would take longer than all the rest here.)
const INTEGERS: f32 = 12_582_912.0;

/// The integer that was added to [`INTEGERS`].
#[inline]
fn integer(shifted: f32) -> u32 {
    shifted.to_bits().wrapping_sub(INTEGERS.to_bits())
}

/// Density at the voxel index `index` (x, y, z), trilinear; beyond the outermost voxel centres the
/// index is clamped.
#[inline]
pub fn sample_density(density: &Density<'_>, index: Vec3) -> f32 {
    #[cfg(test)]
    counted::SAMPLES.set(counted::SAMPLES.get() + 1);
    let index = index.clamp(Vec3::ZERO, density.last);
    let lowest = (index - 0.5).min((density.last - 1.0).max(Vec3::ZERO));
    let shifted = lowest + INTEGERS;
    let Some(cell) = density.cell(shifted.to_array().each(|c| integer(c) as usize)) else {
        return 0.0;
    };
    let f = index - (shifted - INTEGERS);
    let [dx, dy, dz] = density.next;
    // Four rows along x at once, then two along y.
    let low = Vec4::new(cell[0], cell[dz], cell[dy], cell[dy + dz]);
    let high = Vec4::new(cell[dx], cell[dz + dx], cell[dy + dx], cell[dy + dz + dx]);
    let rows = low + (high - low) * f.x;
    let (low, high) = (rows.xy(), rows.zw());
    let planes = low + (high - low) * f.y;
    planes.x + (planes.y - planes.x) * f.z
}

/// Densities at four distances `at` along a ray in index space; the same as four calls of
/// [`sample_density`].
#[inline]
pub fn four_densities(density: &Density<'_>, ray: &Ray, at: Vec4) -> Vec4 {
    // Volumes that are one voxel wide along x, or enormous.
    if density.next[0] == 0 || density.values.len() > u32::MAX as usize {
        let sample = |i: usize| sample_density(density, ray.at(at[i]));
        return Vec4::from_array([0, 1, 2, 3].each(sample));
    }
    #[cfg(test)]
    counted::SAMPLES.set(counted::SAMPLES.get() + 4);
    let (x, fx) = cells_along(ray.origin.x, ray.direction.x, density.last.x, at);
    let (y, fy) = cells_along(ray.origin.y, ray.direction.y, density.last.y, at);
    let (z, fz) = cells_along(ray.origin.z, ray.direction.z, density.last.z, at);
    let rows = density.bases([x, y, z]).and_then(|bases| four_rows(density, bases, fx));
    let Some([low, high, far_low, far_high]) = rows else { return Vec4::ZERO };
    let (plane, far_plane) = (low + (high - low) * fy, far_low + (far_high - far_low) * fy);
    plane + (far_plane - plane) * fz
}

/// The four rows along x of each of the cells that begin at `bases`, interpolated at `fx`; `None`
/// beyond the last value.
#[allow(clippy::inline_always)] // All samples go through it.
#[inline(always)]
fn four_rows(density: &Density<'_>, bases: [u32; 4], fx: Vec4) -> Option<[Vec4; 4]> {
    let values = density.values;
    let [_, dy, dz] = density.next.each(|n| n as u32);
    // The rows along x that begin `offset` behind the four voxels.
    let row = |offset: u32| {
        let pair = |i: usize| pair(values, bases[i].wrapping_add(offset));
        let (a, b, c, d) = (pair(0)?, pair(1)?, pair(2)?, pair(3)?);
        let (first, second) =
            (Vec4::new(a[0], a[1], b[0], b[1]), Vec4::new(c[0], c[1], d[0], d[1]));
        let left = Vec4::new(first.x, first.z, second.x, second.z);
        let right = Vec4::new(first.y, first.w, second.y, second.w);
        Some(left + (right - left) * fx)
    };
    Some([row(0)?, row(dy)?, row(dz)?, row(dz + dy)?])
}

/// The value at `index` and the one behind it; `None` beyond the last one. The index has 32 bits so
/// that one comparison with the length is enough for both.
#[allow(clippy::inline_always)]
#[inline(always)]
fn pair(values: &[f32], index: u32) -> Option<[f32; 2]> {
    let index = index as usize;
    let &right = values.get(index + 1)?;
    Some([values[index], right])
}

/// For four positions of a ray along one axis: the cell that holds each of them, and the position
/// within the cell, 0..1. `last` is the index of the last voxel.
#[inline]
fn cells_along(origin: f32, direction: f32, last: f32, at: Vec4) -> ([u32; 4], Vec4) {
    let place = (origin + at * direction).clamp(Vec4::ZERO, Vec4::splat(last));
    let lowest = (place - 0.5).min(Vec4::splat((last - 1.0).max(0.0)));
    let shifted = lowest + INTEGERS;
    (shifted.to_array().each(integer), place - (shifted - INTEGERS))
}

/// Counts the samples that this thread has taken, for tests.
#[cfg(test)]
pub(crate) mod counted {
    use std::cell::Cell;

    std::thread_local! {
        pub(crate) static SAMPLES: Cell<u64> = const { Cell::new(0) };
    }
}
