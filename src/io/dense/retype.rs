//! Voxels with other numbers: another type, vectors as lengths, nothing below a threshold. It knows no
//! format.

use rayon::prelude::*;

use super::grid::DenseGrid;
use crate::io::number::{ValueType, cast};
use crate::io::remap::{Remap, Span};

/// Numbers that a thread takes at once.
const CHUNK: usize = 1 << 16;

impl DenseGrid {
    /// What all numbers are like.
    pub fn span(&self) -> Span {
        let chunks = self.bytes.par_chunks(CHUNK * self.value_type.size());
        chunks
            .map(|chunk| {
                let values = self.value_type.decode(chunk);
                values.into_iter().fold(Span::EMPTY, Span::with)
            })
            .reduce(|| Span::EMPTY, Span::and)
    }

    /// The same values as numbers of type `to`; the background goes with them.
    #[must_use]
    pub fn retyped(self, to: ValueType, remap: Remap) -> Self {
        if to == self.value_type && remap == Remap::Cast {
            return self;
        }
        let whole = to.limits().is_some();
        let bytes = match remap {
            Remap::Cast => cast(&self.bytes, self.value_type, to),
            Remap::Affine { .. } => {
                let size = self.value_type.size();
                let chunks = self.bytes.par_chunks(CHUNK * size);
                let parts: Vec<Vec<u8>> = chunks
                    .map(|chunk| {
                        let values = self.value_type.decode(chunk);
                        let stored: Vec<f64> =
                            values.into_iter().map(|value| remap.apply(value, whole)).collect();
                        encoded(to, &stored)
                    })
                    .collect();
                parts.concat()
            }
        };
        let background = self
            .background
            .map(|values| values.into_iter().map(|value| remap.apply(value, whole)).collect());
        Self { value_type: to, bytes, background, ..self }
    }

    /// Vectors as their length.
    #[must_use]
    pub fn magnitude(self) -> Self {
        if self.components == 1 {
            return self;
        }
        let to = if self.value_type == ValueType::F64 { ValueType::F64 } else { ValueType::F32 };
        let length = |vector: &[f64]| vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        let voxel = self.voxel_bytes();
        let parts: Vec<Vec<u8>> = self
            .bytes
            .par_chunks(voxel * CHUNK)
            .map(|chunk| {
                let values = self.value_type.decode(chunk);
                let lengths: Vec<f64> = values.chunks_exact(self.components).map(length).collect();
                encoded(to, &lengths)
            })
            .collect();
        let background = self.background.as_deref().map(|vector| vec![length(vector)]);
        Self { components: 1, value_type: to, bytes: parts.concat(), background, ..self }
    }

    /// The same with every voxel whose value (or length) is below `least` as the background, which is
    /// 0 where nothing else is known, and inactive.
    #[must_use]
    pub fn without_below(mut self, least: f64) -> Self {
        let voxel = self.voxel_bytes();
        let background = self.background.get_or_insert_with(|| vec![0.0; self.components]).clone();
        let empty = self.encoded(&background);
        let (value_type, components) = (self.value_type, self.components);
        let mut active = self.active.take().unwrap_or_else(|| vec![true; self.voxels()]);
        let chunks = self.bytes.par_chunks_mut(voxel * CHUNK).zip(active.par_chunks_mut(CHUNK));
        chunks.for_each(|(bytes, active)| {
            let values = value_type.decode(bytes);
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
        self
    }
}

fn encoded(to: ValueType, values: &[f64]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.len() * to.size());
    to.encode(values, &mut bytes);
    bytes
}
