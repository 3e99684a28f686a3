//! The voxels of a dense file in their own type, and as numbers. Knows no format.

use ndarray::Array3;

use super::{DenseHeader, Order};
use crate::error::Result;
use crate::error::memory;
use crate::io::number::{CHUNK, decode, is_beyond_f32};
use crate::parallel;

/// The voxels of some rows along x as numbers to render: the value itself, or the length of a
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
            for number in &mut numbers {
                *number = *number * slope + intercept;
            }
        }
        for (density, vector) in densities.iter_mut().zip(numbers.chunks_exact(components)) {
            *density = length(vector) as f32;
        }
    });
    densities
}

/// The first number in some rows that [`is_beyond_f32`]; `densities` are the same rows as f32.
pub(super) fn beyond_f32(header: &DenseHeader, rows: &[u8], densities: &[f32]) -> Option<f64> {
    if !densities.contains(&f32::INFINITY) {
        return None;
    }
    let numbers = decode(rows, header.value_type, header.endian, header.scale);
    numbers.chunks_exact(header.components).map(length).find(|&length| is_beyond_f32(length))
}

/// A single number unchanged, or a vector's length.
fn length(vector: &[f64]) -> f64 {
    match vector {
        [single] => *single,
        _ => vector.iter().map(|v| v * v).sum::<f64>().sqrt(),
    }
}

/// Arranges numbers in the file's order as an array of shape (z, y, x).
///
/// # Errors
/// If they must be reordered and there is not enough memory.
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
    // The count matches the shape, because the header's bytes were computed from it.
    Ok(Array3::from_shape_vec((nz, ny, nx), values).unwrap_or_default())
}

/// All voxels of a file.
pub struct Voxels {
    header: DenseHeader,
    bytes: Vec<u8>,
}

impl Voxels {
    /// `bytes` must hold exactly the voxels that `header` describes.
    pub(super) fn new(header: DenseHeader, bytes: Vec<u8>) -> Self {
        Self { header, bytes }
    }

    /// The bytes of the file: number type, byte order and order of axes are the header's, and its
    /// scale is not applied.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Like [`Voxels::bytes`], without a copy.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Numbers to render, shape (z, y, x): the value itself, or the length of a vector.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn density(&self) -> Result<Array3<f32>> {
        arranged(&self.header, densities(&self.header, &self.bytes))
    }

    /// Calls `each` for every component of every voxel in the file's order, with its value (scale
    /// applied) and the component's index.
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
