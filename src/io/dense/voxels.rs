//! The voxels of a dense file in their own type, and as numbers. Knows no format.

use ndarray::Array3;

use super::{DenseHeader, Order};
use crate::error::Result;
use crate::error::memory;
use crate::io::number::{CHUNK, decode, is_beyond_f32};
use crate::parallel;

/// The voxels in some rows along x as numbers to render: the value itself, or the length of a
/// vector.
pub(super) fn densities(header: &DenseHeader, rows: &[u8]) -> Vec<f32> {
    let [slope, intercept] = header.scale;
    let (value_type, endian, components) = (header.value_type, header.endian, header.components);
    let voxel = components * value_type.size();
    let mut densities = vec![0.0; rows.len() / voxel];
    let parts = densities.chunks_mut(CHUNK).zip(rows.chunks(CHUNK * voxel));
    parallel::for_each(parts, |(densities, bytes)| {
        let mut numbers = value_type.decode(bytes, endian);
        if header.scale != [1.0, 0.0] {
            numbers.iter_mut().for_each(|number| *number = *number * slope + intercept);
        }
        for (density, vector) in densities.iter_mut().zip(numbers.chunks_exact(components)) {
            *density = length(vector) as f32;
        }
    });
    densities
}

/// The first of the numbers in some rows that [`is_beyond_f32`]; `densities` are theirs.
pub(super) fn beyond_f32(header: &DenseHeader, rows: &[u8], densities: &[f32]) -> Option<f64> {
    if !densities.contains(&f32::INFINITY) {
        return None;
    }
    let numbers = decode(rows, header.value_type, header.endian, header.scale);
    numbers.chunks_exact(header.components).map(length).find(|&length| is_beyond_f32(length))
}

/// A number as it is, a vector's length.
fn length(vector: &[f64]) -> f64 {
    match vector {
        [single] => *single,
        _ => vector.iter().map(|v| v * v).sum::<f64>().sqrt(),
    }
}

/// Numbers in a file's order as an array of shape (z, y, x).
///
/// # Errors
/// If they have to be turned and there is no memory for that.
pub(super) fn arranged(header: &DenseHeader, mut values: Vec<f32>) -> Result<Array3<f32>> {
    let [nx, ny, nz] = header.dims;
    if header.order == Order::ZFastest {
        let mut turned = memory::filled(values.len(), 0.0, "voxels")?;
        parallel::for_each(turned.chunks_mut(nx * ny).enumerate(), |(z, plane)| {
            for (i, value) in plane.iter_mut().enumerate() {
                *value = values[(i % nx * ny + i / nx) * nz + z];
            }
        });
        values = turned;
    }
    // The count is the shape's: the header's bytes were counted from it.
    Ok(Array3::from_shape_vec((nz, ny, nx), values).unwrap_or_default())
}

/// All voxels of a file.
pub struct Voxels {
    header: DenseHeader,
    bytes: Vec<u8>,
}

impl Voxels {
    /// `bytes` has exactly the voxels that `header` says.
    pub(super) fn new(header: DenseHeader, bytes: Vec<u8>) -> Self {
        Self { header, bytes }
    }

    /// The numbers as they lie in the file: type, byte order and order of axes as the header says,
    /// before its scale.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// As [`Voxels::bytes`], without a copy.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Numbers to render, shape (z, y, x): the value itself, or the length of a vector.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub fn density(&self) -> Result<Array3<f32>> {
        arranged(&self.header, densities(&self.header, &self.bytes))
    }

    /// Runs `each` on every component of every voxel in the file's order: its value and which
    /// component it is.
    pub fn for_each(&self, mut each: impl FnMut(f64, usize)) {
        const BYTES: usize = 1 << 20;
        let DenseHeader { value_type, endian, scale, components, .. } = self.header;
        let voxel = components * value_type.size();
        for chunk in self.bytes.chunks(BYTES / voxel.max(1) * voxel) {
            let numbers = decode(chunk, value_type, endian, scale);
            for (number, component) in numbers.into_iter().zip((0..components).cycle()) {
                each(number, component);
            }
        }
    }
}
