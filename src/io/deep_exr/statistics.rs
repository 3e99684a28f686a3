//! Statistics of a deep image (numbers of samples, depths, opacity), and its flattened picture.
//! Knows nothing of files.

use super::header::DeepHeader;
use super::row::{DeepImage, DeepRow};
use crate::error::Result;
use crate::image::Image;

/// Statistics of a deep image.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepStatistics {
    /// Number of pixels.
    pub pixels: u64,
    /// Number of pixels without samples.
    pub empty_pixels: u64,
    /// Number of samples.
    pub samples: u64,
    /// Smallest number of samples in a pixel.
    pub fewest: u32,
    /// Largest number of samples in a pixel.
    pub most: u32,
    /// Smallest and largest finite depth in Z and ZBack; `None` if there is none.
    pub depth: Option<[f64; 2]>,
    /// Smallest, mean and largest opacity of the flattened pixels, 0..1.
    pub opacity: [f64; 3],
}

impl DeepStatistics {
    /// Mean number of samples per pixel.
    pub fn mean_samples(&self) -> f64 {
        self.samples as f64 / self.pixels as f64
    }
}

impl DeepImage {
    /// The flattened picture: samples composited over one another, the nearest in front.
    ///
    /// Samples are composited in the order of their depth. Where they overlap, which does not occur
    /// in tidy files, opacity is exact and colours are as without overlap. The opacity of a
    /// coloured image (AR, AG, AB) is the mean of the three. An image without R, G, B is black.
    ///
    /// # Errors
    /// If the header's data window is empty or too large.
    pub fn flatten(&self) -> Result<Image> {
        let [width, height] = self.header.size()?;
        let channels = Channels::of(&self.header);
        let pixels = self.rows.iter().flat_map(|row| channels.flatten(row));
        Ok(Image { width, height, pixels: pixels.collect() })
    }

    /// Numbers of samples, their depths and their opacity.
    pub fn statistics(&self) -> DeepStatistics {
        let mut tally = Tally::new(&self.header);
        self.rows.iter().for_each(|row| tally.add(row));
        tally.finish()
    }
}

/// Indices of the channels with a meaning.
struct Channels {
    depth: [Option<usize>; 2],
    colour: [Option<usize>; 3],
    alpha: [Option<usize>; 3],
}

impl Channels {
    fn of(header: &DeepHeader) -> Self {
        let alpha = header.channel("A");
        let coloured = ["AR", "AG", "AB"].map(|name| header.channel(name).or(alpha));
        let depth = ["Z", "ZBack"].map(|name| header.channel(name));
        let colour = ["R", "G", "B"].map(|name| header.channel(name));
        Self { depth, colour, alpha: coloured }
    }

    /// Front and back of a sample; the back is the front if it is missing or nearer.
    fn depths(&self, row: &DeepRow, index: usize) -> [f32; 2] {
        let front = row.value(self.depth[0], index, 0.0);
        [front, row.value(self.depth[1], index, front).max(front)]
    }

    /// Opacity per colour; samples without it are opaque.
    fn opacity(&self, row: &DeepRow, index: usize) -> [f64; 3] {
        let alpha = self.alpha.map(|channel| f64::from(row.value(channel, index, 1.0)));
        alpha.map(|alpha| if alpha.is_nan() { 0.0 } else { alpha.clamp(0.0, 1.0) })
    }

    /// Opacity of the flattened pixel `x`.
    fn final_opacity(&self, row: &DeepRow, x: usize) -> f64 {
        let through = row.pixel(x).fold([1.0; 3], |through, index| {
            let alpha = self.opacity(row, index);
            [0, 1, 2].map(|c| through[c] * (1.0 - alpha[c]))
        });
        1.0 - through.iter().sum::<f64>() / 3.0
    }

    /// The line's pixels, flattened.
    fn flatten<'a>(&'a self, row: &'a DeepRow) -> impl Iterator<Item = [f32; 4]> + 'a {
        let mut order = Vec::new();
        (0..row.width()).map(move |x| {
            order.clear();
            order.extend(row.pixel(x).map(|index| (self.depths(row, index), index)));
            order.sort_by(|([z, back], index), ([other, other_back], other_index)| {
                let depth = z.total_cmp(other).then(back.total_cmp(other_back));
                depth.then(index.cmp(other_index))
            });
            let (mut through, mut colour) = ([1.0; 3], [0.0; 3]);
            for &(_, index) in &order {
                let alpha = self.opacity(row, index);
                for c in 0..3 {
                    colour[c] += through[c] * f64::from(row.value(self.colour[c], index, 0.0));
                    through[c] *= 1.0 - alpha[c];
                }
            }
            let [r, g, b] = colour.map(|c| c as f32);
            [r, g, b, (1.0 - through.iter().sum::<f64>() / 3.0) as f32]
        })
    }
}

/// Accumulates statistics, line by line.
pub(super) struct Tally {
    channels: Channels,
    found: DeepStatistics,
    opacity_sum: f64,
}

impl Tally {
    pub(super) fn new(header: &DeepHeader) -> Self {
        let found = DeepStatistics {
            pixels: 0,
            empty_pixels: 0,
            samples: 0,
            fewest: u32::MAX,
            most: 0,
            depth: None,
            opacity: [1.0, 0.0, 0.0],
        };
        Self { channels: Channels::of(header), found, opacity_sum: 0.0 }
    }

    pub(super) fn add(&mut self, row: &DeepRow) {
        let found = &mut self.found;
        found.pixels += row.width() as u64;
        found.samples += row.sample_count() as u64;
        for count in row.counts() {
            found.empty_pixels += u64::from(count == 0);
            found.fewest = found.fewest.min(count);
            found.most = found.most.max(count);
        }
        if self.channels.depth[0].is_some() {
            for index in 0..row.sample_count() {
                for depth in self.channels.depths(row, index).map(f64::from) {
                    if depth.is_finite() {
                        let [low, high] = found.depth.unwrap_or([depth; 2]);
                        found.depth = Some([low.min(depth), high.max(depth)]);
                    }
                }
            }
        }
        for x in 0..row.width() {
            let opacity = self.channels.final_opacity(row, x);
            found.opacity[0] = found.opacity[0].min(opacity);
            found.opacity[2] = found.opacity[2].max(opacity);
            self.opacity_sum += opacity;
        }
    }

    pub(super) fn finish(mut self) -> DeepStatistics {
        self.found.opacity[1] = self.opacity_sum / self.found.pixels.max(1) as f64;
        self.found.fewest = self.found.fewest.min(self.found.most);
        self.found
    }
}
