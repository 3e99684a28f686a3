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
fn integer(shifted: f32) -> usize {
    shifted.to_bits().wrapping_sub(INTEGERS.to_bits()) as usize
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
    let Some(cell) = density.cell(shifted.to_array().each(integer)) else { return 0.0 };
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
    #[cfg(test)]
    counted::SAMPLES.set(counted::SAMPLES.get() + 4);
    let (x, fx) = cells_along(ray.origin.x, ray.direction.x, density.last.x, at);
    let (y, fy) = cells_along(ray.origin.y, ray.direction.y, density.last.y, at);
    let (z, fz) = cells_along(ray.origin.z, ray.direction.z, density.last.z, at);
    let cell = |i: usize| density.cell([x[i], y[i], z[i]]);
    let (Some(a), Some(b), Some(c), Some(d)) = (cell(0), cell(1), cell(2), cell(3)) else {
        return Vec4::ZERO;
    };
    let corner = |offset: usize| Vec4::new(a[offset], b[offset], c[offset], d[offset]);
    let [dx, dy, dz] = density.next;
    let [near, right] = [corner(0), corner(dx)];
    let [up, up_right] = [corner(dy), corner(dy + dx)];
    let [far, far_right] = [corner(dz), corner(dz + dx)];
    let [far_up, far_up_right] = [corner(dz + dy), corner(dz + dy + dx)];
    // Rows along x, then along y.
    let (low, high) = (near + (right - near) * fx, up + (up_right - up) * fx);
    let (far_low, far_high) = (far + (far_right - far) * fx, far_up + (far_up_right - far_up) * fx);
    let (plane, far_plane) = (low + (high - low) * fy, far_low + (far_high - far_low) * fy);
    plane + (far_plane - plane) * fz
}

/// For four positions of a ray along one axis: the cell that holds each of them, and the position
/// within the cell, 0..1. `last` is the index of the last voxel.
#[inline]
fn cells_along(origin: f32, direction: f32, last: f32, at: Vec4) -> ([usize; 4], Vec4) {
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
