//! Density between voxels: trilinear, clamped at the border.

use glam::{Vec3, Vec4, Vec4Swizzles};

use crate::volume::Volume;

/// A volume's voxels, ready to be sampled.
#[derive(Clone, Copy, Debug)]
pub struct Density<'a> {
    values: &'a [f32],
    dims: [usize; 3],
    last: Vec3,
}

impl<'a> Density<'a> {
    /// The voxels of `volume`.
    pub fn of(volume: &'a Volume) -> Self {
        let dims = volume.dims();
        // Volumes are made in standard layout; an empty slice would only ever be sampled as 0.
        let values = volume.values().as_slice().unwrap_or_default();
        Self { values, dims, last: Vec3::from_array(dims.map(|n| (n - 1) as f32)) }
    }
}

/// Density at a voxel index (x, y, z); what lies beyond the outermost voxel centres is clamped.
#[inline]
pub fn sample_density(density: &Density<'_>, index: Vec3) -> f32 {
    #[cfg(test)]
    counted::SAMPLES.set(counted::SAMPLES.get() + 1);
    let p = index.clamp(Vec3::ZERO, density.last);
    let [nx, ny, nz] = density.dims;
    let (x, y, z) = (p.x as usize, p.y as usize, p.z as usize);
    let f = p - Vec3::new(x as f32, y as f32, z as f32);
    let dx = usize::from(x + 1 < nx);
    let dy = if y + 1 < ny { nx } else { 0 };
    let dz = if z + 1 < nz { nx * ny } else { 0 };
    let base = (z * ny + y) * nx + x;
    let Some(cell) = density.values.get(base..=base + dz + dy + dx) else { return 0.0 };
    // Four rows along x at once, then two along y.
    let low = Vec4::new(cell[0], cell[dz], cell[dy], cell[dy + dz]);
    let high = Vec4::new(cell[dx], cell[dz + dx], cell[dy + dx], cell[dy + dz + dx]);
    let rows = low + (high - low) * f.x;
    let (low, high) = (rows.xy(), rows.zw());
    let planes = low + (high - low) * f.y;
    planes.x + (planes.y - planes.x) * f.z
}

/// How many samples this thread has taken.
#[cfg(test)]
pub(crate) mod counted {
    use std::cell::Cell;

    std::thread_local! {
        pub(crate) static SAMPLES: Cell<u64> = const { Cell::new(0) };
    }
}
