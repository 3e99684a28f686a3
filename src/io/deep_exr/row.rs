//! Samples in memory: a line of pixels, and an image of such lines. Knows nothing of files.

use std::ops::Range;

use half::f16;

use super::header::{Channel, DeepHeader, PixelType};

/// The samples of a channel along a line, pixel after pixel.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)] // Named as the pixel types.
pub enum Samples {
    Uint(Vec<u32>),
    Half(Vec<f16>),
    Float(Vec<f32>),
}

impl Samples {
    fn new(pixel_type: PixelType) -> Self {
        match pixel_type {
            PixelType::Uint => Self::Uint(Vec::new()),
            PixelType::Half => Self::Half(Vec::new()),
            PixelType::Float => Self::Float(Vec::new()),
        }
    }

    /// The samples' number type.
    pub fn pixel_type(&self) -> PixelType {
        match self {
            Self::Uint(_) => PixelType::Uint,
            Self::Half(_) => PixelType::Half,
            Self::Float(_) => PixelType::Float,
        }
    }

    /// The number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Uint(samples) => samples.len(),
            Self::Half(samples) => samples.len(),
            Self::Float(samples) => samples.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample at `index` as a floating-point number (integers above 2^24 are rounded); `None`
    /// beyond the last one.
    pub fn get(&self, index: usize) -> Option<f32> {
        match self {
            Self::Uint(samples) => samples.get(index).map(|&sample| sample as f32),
            Self::Half(samples) => samples.get(index).map(|&sample| sample.to_f32()),
            Self::Float(samples) => samples.get(index).copied(),
        }
    }

    fn push(&mut self, value: f32) {
        match self {
            Self::Uint(samples) => samples.push(value as u32),
            Self::Half(samples) => samples.push(f16::from_f32(value)),
            Self::Float(samples) => samples.push(value),
        }
    }

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Uint(samples) => bytes.extend(samples.iter().flat_map(|v| v.to_le_bytes())),
            Self::Half(samples) => bytes.extend(samples.iter().flat_map(|v| v.to_le_bytes())),
            Self::Float(samples) => bytes.extend(samples.iter().flat_map(|v| v.to_le_bytes())),
        }
    }

    pub(super) fn read(pixel_type: PixelType, bytes: &[u8]) -> Self {
        match pixel_type {
            PixelType::Uint => Self::Uint(numbers(bytes, u32::from_le_bytes)),
            PixelType::Half => Self::Half(numbers(bytes, f16::from_le_bytes)),
            PixelType::Float => Self::Float(numbers(bytes, f32::from_le_bytes)),
        }
    }
}

fn numbers<T, const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|&bytes| number(bytes)).collect()
}

/// A line of pixels, each with any number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepRow {
    /// Number of samples in all pixels up to and including each: pixel `x` has the samples from
    /// `ends[x - 1]` (0 for the first pixel) to `ends[x]`.
    pub ends: Vec<u32>,
    /// The samples of each channel, in the header's order.
    pub channels: Vec<Samples>,
}

impl DeepRow {
    /// A line without pixels, for these channels.
    pub fn new(channels: &[Channel]) -> Self {
        let channels = channels.iter().map(|channel| Samples::new(channel.pixel_type)).collect();
        Self { ends: Vec::new(), channels }
    }

    /// Adds a sample to the current pixel: one value per channel, in the header's order; missing
    /// values are 0.
    pub fn push(&mut self, sample: &[f32]) {
        for (at, channel) in self.channels.iter_mut().enumerate() {
            channel.push(sample.get(at).copied().unwrap_or(0.0));
        }
    }

    /// Ends the current pixel; the next sample belongs to its right neighbour.
    pub fn end_pixel(&mut self) {
        let count = self.channels.first().map_or(0, Samples::len);
        self.ends.push(u32::try_from(count).unwrap_or(u32::MAX));
    }

    /// Number of pixels in the line.
    pub fn width(&self) -> usize {
        self.ends.len()
    }

    /// Number of samples in the line.
    pub fn sample_count(&self) -> usize {
        self.ends.last().map_or(0, |&end| end as usize)
    }

    /// Indices of the samples of pixel `x`; an empty range beyond the last pixel.
    pub fn pixel(&self, x: usize) -> Range<usize> {
        let end = |x: usize| self.ends.get(x).map_or(0, |&end| end as usize);
        if x == 0 { 0..end(0) } else { end(x - 1)..end(x) }
    }

    /// Number of samples in each pixel.
    pub fn counts(&self) -> impl Iterator<Item = u32> + '_ {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        self.ends.iter().zip(starts).map(|(end, start)| end.saturating_sub(start))
    }

    /// The value of `channel` in the sample at `index`; `missing` without such a channel or sample.
    pub(super) fn value(&self, channel: Option<usize>, index: usize, missing: f32) -> f32 {
        let samples = channel.and_then(|channel| self.channels.get(channel));
        samples.and_then(|samples| samples.get(index)).unwrap_or(missing)
    }
}

/// A deep image: any number of samples in each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepImage {
    /// The header.
    pub header: DeepHeader,
    /// The lines, row 0 on top.
    pub rows: Vec<DeepRow>,
}
