//! Voxels with other numbers: another type, lengths in place of vectors, no values below a
//! threshold. Knows no format.

use super::grid::DenseGrid;
use crate::error::Result;
use crate::error::memory;
use crate::io::number::{Endian, ValueType, cast, transformed};
use crate::io::remap::{Remap, Span};
use crate::parallel;

/// Number of numbers per thread and task.
const CHUNK: usize = 1 << 16;

impl DenseGrid {
    /// Properties of all numbers together.
    pub fn span(&self) -> Span {
        let parts = parallel::map(self.bytes.chunks(CHUNK * self.value_type.size()), |chunk| {
            let values = self.value_type.decode(chunk, Endian::Little);
            values.into_iter().fold(Span::EMPTY, Span::with)
        });
        parts.into_iter().fold(Span::EMPTY, Span::and)
    }

    /// The same values as numbers of type `to`, the background too.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn retyped(self, to: ValueType, remap: Remap) -> Result<Self> {
        if to == self.value_type && remap == Remap::Cast {
            return Ok(self);
        }
        let whole = to.limits().is_some();
        let bytes = match remap {
            Remap::Cast => cast(&self.bytes, self.value_type, to)?,
            Remap::Affine { .. } => {
                transformed(&self.bytes, [self.value_type.size(), to.size()], |chunk| {
                    let values = self.value_type.decode(chunk, Endian::Little);
                    let stored: Vec<f64> =
                        values.into_iter().map(|value| remap.apply(value, whole)).collect();
                    encoded(to, &stored)
                })?
            }
        };
        let background = self
            .background
            .map(|values| values.into_iter().map(|value| remap.apply(value, whole)).collect());
        Ok(Self { value_type: to, bytes, background, ..self })
    }

    /// Vectors replaced by their length.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn magnitude(self) -> Result<Self> {
        if self.components == 1 {
            return Ok(self);
        }
        let to = if self.value_type == ValueType::F64 { ValueType::F64 } else { ValueType::F32 };
        let length = |vector: &[f64]| vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        let bytes = transformed(&self.bytes, [self.voxel_bytes(), to.size()], |chunk| {
            let values = self.value_type.decode(chunk, Endian::Little);
            let lengths: Vec<f64> = values.chunks_exact(self.components).map(length).collect();
            encoded(to, &lengths)
        })?;
        let background = self.background.as_deref().map(|vector| vec![length(vector)]);
        Ok(Self { components: 1, value_type: to, bytes, background, ..self })
    }

    /// Every voxel whose value (or length) is below `least` becomes inactive and gets the
    /// background's value, which is 0 if it is not known.
    ///
    /// # Errors
    /// If there is not enough memory to mark the active voxels.
    pub fn without_below(mut self, least: f64) -> Result<Self> {
        let voxel = self.voxel_bytes();
        let background = self.background.get_or_insert_with(|| vec![0.0; self.components]).clone();
        let empty = self.encoded(&background);
        let (value_type, components) = (self.value_type, self.components);
        let mut active = match self.active.take() {
            Some(active) => active,
            None => memory::filled(self.voxels(), true, "which voxels are active")?,
        };
        let chunks = self.bytes.chunks_mut(voxel * CHUNK).zip(active.chunks_mut(CHUNK));
        parallel::for_each(chunks, |(bytes, active)| {
            let values = value_type.decode(bytes, Endian::Little);
            let voxels = bytes.chunks_exact_mut(voxel).zip(active);
            for ((bytes, active), values) in voxels.zip(values.chunks_exact(components)) {
                let value = match values {
                    [single] => *single,
                    vector => vector.iter().map(|v| v * v).sum::<f64>().sqrt(),
                };
                if value < least {
                    bytes.copy_from_slice(&empty);
                    *active = false;
                }
            }
        });
        self.active = active.contains(&false).then_some(active);
        Ok(self)
    }
}

fn encoded(to: ValueType, values: &[f64]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.len() * to.size());
    to.encode(values, &mut bytes);
    bytes
}
