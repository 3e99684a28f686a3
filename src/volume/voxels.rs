//! How a volume's values are stored: as one array, or in blocks where equal ones are stored once.

use std::borrow::Cow;

use ndarray::{Array3, Axis};

use super::sparse::{SparseVoxels, place_of};
use crate::parallel;

/// Values that a thread takes at once.
const CHUNK: usize = 1 << 16;

/// A box of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// The first voxel, x, y, z.
    pub first: [usize; 3],
    /// Number of voxels along x, y, z.
    pub size: [usize; 3],
}

impl Held {
    /// Number of voxels in all.
    pub fn voxels(&self) -> usize {
        self.size.iter().product()
    }

    /// Index of the `i`-th voxel of the box, x fastest.
    pub fn voxel(&self, i: usize) -> [usize; 3] {
        let inside = place_of(i, self.size);
        std::array::from_fn(|axis| self.first[axis] + inside[axis])
    }
}

/// The values of a volume.
#[derive(Clone, Debug)]
pub enum Voxels {
    /// All values in one array, shape (z, y, x), in standard layout.
    Dense(Array3<f32>),
    /// Values in blocks.
    Sparse(SparseVoxels),
}

impl Voxels {
    /// Number of voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        match self {
            Self::Dense(values) => {
                let (z, y, x) = values.dim();
                [x, y, z]
            }
            Self::Sparse(voxels) => voxels.dims(),
        }
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Dense(values) => values.len() * size_of::<f32>(),
            Self::Sparse(voxels) => voxels.bytes(),
        }
    }

    /// All values, shape (z, y, x); a copy if they are stored in blocks.
    pub fn to_dense(&self) -> Cow<'_, Array3<f32>> {
        match self {
            Self::Dense(values) => Cow::Borrowed(values),
            Self::Sparse(voxels) => {
                let [nx, ny, nz] = voxels.dims();
                let mut values = Array3::zeros((nz, ny, nx));
                if let Some(all) = values.as_slice_mut() {
                    parallel::for_each(all.chunks_mut(nx * ny).enumerate(), |(z, plane)| {
                        for (y, row) in plane.chunks_mut(nx).enumerate() {
                            voxels.fill_row(y, z, row);
                        }
                    });
                }
                Cow::Owned(values)
            }
        }
    }

    /// The values in blocks; a copy if they are stored in one array.
    pub fn to_sparse(&self) -> Cow<'_, SparseVoxels> {
        match self {
            Self::Dense(values) => Cow::Owned(SparseVoxels::of(values)),
            Self::Sparse(voxels) => Cow::Borrowed(voxels),
        }
    }

    /// Copies the values of the row of voxels at `y`, `z` along x into `row`.
    pub fn fill_row(&self, y: usize, z: usize, row: &mut [f32]) {
        match self {
            Self::Dense(values) => {
                let plane = values.index_axis(Axis(0), z);
                row.iter_mut().zip(plane.row(y)).for_each(|(to, from)| *to = *from);
            }
            Self::Sparse(voxels) => voxels.fill_row(y, z, row),
        }
    }

    /// Calls `visit` with boxes of voxels of one value, and that value, for all values but 0. Dense
    /// voxels are visited one by one, x fastest, others block by block.
    pub fn for_each_held(&self, mut visit: impl FnMut(Held, f32)) {
        let one = |first: [usize; 3]| Held { first, size: [1; 3] };
        match self {
            Self::Dense(values) => {
                for ((z, y, x), &value) in values.indexed_iter().filter(|(_, v)| **v != 0.0) {
                    visit(one([x, y, z]), value);
                }
            }
            Self::Sparse(voxels) => {
                for part in voxels.parts() {
                    if let Some(value) = part.uniform {
                        visit(Held { first: part.origin, size: part.size }, value);
                        continue;
                    }
                    part.for_each(|voxel, value| {
                        if value != 0.0 {
                            visit(one(voxel), value);
                        }
                    });
                }
            }
        }
    }

    /// Replaces every value by `with` of it.
    pub(super) fn replace(&mut self, with: impl Fn(f32) -> f32 + Sync) {
        match self {
            Self::Dense(values) => match values.as_slice_mut() {
                Some(all) => parallel::for_each(all.chunks_mut(CHUNK), |part| {
                    for value in part {
                        *value = with(*value);
                    }
                }),
                None => values.mapv_inplace(with),
            },
            Self::Sparse(voxels) => voxels.replace(with),
        }
    }

    /// The largest value; at least 0.
    pub(super) fn largest(&self) -> f32 {
        // Values beyond the border repeat values within, so they do not matter.
        let all = match self {
            Self::Dense(values) => values.as_slice(),
            Self::Sparse(voxels) => Some(voxels.values()),
        };
        let largest = |part: &[f32]| part.iter().copied().fold(0.0, f32::max);
        let parts = parallel::map(all.unwrap_or_default().chunks(CHUNK), largest);
        parts.into_iter().fold(0.0, f32::max)
    }

    /// Sets values that are negative, NaN or infinite to 0, and returns how many voxels these were.
    pub(super) fn clean(&mut self) -> usize {
        let renders = |v: f32| v >= 0.0 && v.is_finite();
        let among = |values: &[f32]| -> usize {
            let count = |part: &[f32]| part.iter().filter(|&&v| !renders(v)).count();
            parallel::map(values.chunks(CHUNK), count).into_iter().sum()
        };
        let replaced = match self {
            Self::Dense(values) => among(values.as_slice().unwrap_or_default()),
            Self::Sparse(voxels) if among(voxels.values()) == 0 => 0,
            Self::Sparse(_) => {
                let mut count = 0_usize;
                self.for_each_held(|held, value| {
                    // Addresses of 32 bits are fewer than the voxels of shared blocks may be.
                    count = count.saturating_add(if renders(value) { 0 } else { held.voxels() });
                });
                count
            }
        };
        if replaced > 0 {
            self.replace(|v| if renders(v) { v } else { 0.0 });
        }
        replaced
    }
}
