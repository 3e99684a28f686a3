//! True radiance at random lit pixels, and the error of a picture there.

use std::fmt;

use crate::accuracy::{ExactPoints, ExactTexels, Random};
use crate::cpu::CpuBackend;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::{BRIGHT, Image, lit_percentile};
use crate::scene::{Beam, Scene};
use crate::settings::Settings;
use crate::shadow::Shadow;

/// How much finer camera rays of the truth are than those of a picture at quality 1, or at the
/// picture's own quality if that is higher.
const FINER: f64 = 2.0;
/// Pixels that are drawn in the hope of one that is lit.
const PATIENCE: usize = 16;
/// How often a sample that grows may be looked at.
pub(super) const LOOKS: usize = 2;
/// Deviations of a normal distribution that are exceeded in 5 % of all cases at any of two looks
/// at a growing sample (Pocock 1977, "Group Sequential Methods in the Design and Analysis of Clinical
/// Trials", table 1, for both sides at 10 %). At a single one it is 1.645.
const DEVIATIONS_95: f64 = 1.875;
/// The share of pixels that are drawn evenly, if a picture says where it changes.
const EVEN: f64 = 0.5;

/// Random pixels with their true radiance. Pixels without any are left out.
#[derive(Clone, Debug, Default)]
pub struct Sampled {
    pixels: Vec<[u32; 2]>,
    truths: Vec<[f64; 3]>,
    /// For each, how many times rarer it is drawn than evenly drawn pixels.
    weights: Vec<f64>,
    /// How many pixels were drawn, lit or not.
    drawn: usize,
}

/// The error of a picture's radiance, relative to the 99.9th percentile of its lit pixels'
/// radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PictureError {
    /// The number of lit pixels that were compared with the truth.
    pub pixels: usize,
    /// Their RMS error.
    pub rms: f64,
    /// The upper end of the interval in which the RMS error of all lit pixels lies, with 95 %
    /// confidence, also if it was looked at twice while pixels were added.
    pub bound: f64,
    /// The largest error of a pixel among them.
    pub largest: f64,
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pixels, rms, bound, largest } = self;
        write!(
            f,
            "{rms:.5} RMS of the 99.9th percentile of radiance at {pixels} random lit pixels, at \
             most {bound:.5} with 95 % confidence over all of them, {largest:.5} at worst"
        )
    }
}

impl Sampled {
    /// Draws about `count` lit pixels of the picture of `scene` under `settings` evenly, with random
    /// numbers of a seed and a stream, and integrates their radiance: exact transmittance from the
    /// light (in f64), camera rays twice as fine as the picture's.
    ///
    /// # Errors
    /// If a light cannot be fitted to the media, or if the scene does not fit f32.
    pub fn draw(scene: &Scene, settings: &Settings, count: usize, seed: [u64; 2]) -> Result<Self> {
        let [width, height] = settings.image.size;
        Self::drawn(scene, settings, count, seed, &mut |random| {
            ([width, height].map(|n| random.below(n.into()) as u32), 1.0)
        })
    }

    /// As [`Sampled::draw`], for the picture `image`, which may be a smaller one: half of the pixels
    /// are drawn evenly, and half more often where the picture changes from pixel to pixel. Errors
    /// are large at the edges of shadows, which few pixels of an even sample hit. Weights make up
    /// for it.
    ///
    /// # Errors
    /// As [`Sampled::draw`].
    pub fn draw_for(
        image: &Image,
        scene: &Scene,
        settings: &Settings,
        count: usize,
        seed: [u64; 2],
    ) -> Result<Self> {
        let changes = changes(image);
        let lit = image.pixels.iter().map(|pixel| pixel[..3].iter().any(|&c| c > 0.0));
        let shares: Vec<f64> =
            lit.zip(&changes).map(|(lit, c)| if lit { *c } else { 0.0 }).collect();
        let all = image.pixels.len() as f64;
        let mut sums = Vec::with_capacity(shares.len());
        let sum = shares.iter().fold(0.0, |sum, share| {
            sums.push(sum + share);
            sum + share
        });
        if sum <= 0.0 {
            return Self::draw(scene, settings, count, seed);
        }
        let last = sums.len() - 1;
        Self::drawn(scene, settings, count, seed, &mut |random| {
            let index = if random.unit() < EVEN {
                random.below(sums.len() as u64) as usize
            } else {
                let at = random.unit() * sum;
                sums.partition_point(|&sum| sum <= at).min(last)
            };
            let density = EVEN + (1.0 - EVEN) * shares[index] / sum * all;
            // One of those that a pixel of a smaller picture stands for.
            let mut place = |at: u32, n: u32, of: u32| {
                let [first, next] =
                    [at, at + 1].map(|at| u64::from(at) * u64::from(of) / u64::from(n));
                (first + random.below((next - first).max(1))) as u32
            };
            let [width, height] = settings.image.size;
            let x = place(index as u32 % image.width, image.width, width);
            let y = place(index as u32 / image.width, image.height, height);
            ([x, y], 1.0 / density)
        })
    }

    /// Draws with `next`, which returns a pixel and its weight.
    fn drawn(
        scene: &Scene,
        settings: &Settings,
        count: usize,
        [seed, stream]: [u64; 2],
        next: &mut dyn FnMut(&mut Random) -> ([u32; 2], f64),
    ) -> Result<Self> {
        let beams = scene.beams()?;
        let fine = settings.with(|s| s.quality = (FINER * s.quality.max(1.0)).min(64.0));
        let frames: Vec<Frame> =
            beams.iter().map(|beam| Frame::new(beam, &fine)).collect::<Result<_>>()?;
        let exact: Vec<_> =
            beams.iter().map(|beam| ExactPoints(ExactTexels::new(beam, 1))).collect();
        let exact: Vec<&dyn Shadow> = exact.iter().map(|map| map as &dyn Shadow).collect();
        let mut random = Random::new(seed, stream);
        let mut found = Self::default();
        while found.pixels.len() < count && found.drawn < PATIENCE * count {
            let draws = (found.pixels.len()..count).map(|_| next(&mut random));
            let (pixels, weights): (Vec<[u32; 2]>, Vec<f64>) = draws.unzip();
            found.drawn += pixels.len();
            let radiance = marched(&beams, &frames, &exact, &pixels)?;
            for ((pixel, weight), radiance) in pixels.into_iter().zip(weights).zip(radiance) {
                if radiance.iter().any(|&c| c > 0.0) {
                    found.pixels.push(pixel);
                    found.weights.push(weight);
                    found.truths.push(radiance);
                }
            }
        }
        Ok(found)
    }

    /// Adds the pixels of another sample, drawn alike.
    pub(super) fn join(&mut self, other: Self) {
        self.pixels.extend(other.pixels);
        self.truths.extend(other.truths);
        self.weights.extend(other.weights);
        self.drawn += other.drawn;
    }

    /// The lit pixels (x, y).
    pub(super) fn pixels(&self) -> &[[u32; 2]] {
        &self.pixels
    }

    /// The largest radiance.
    pub(super) fn brightest(&self) -> f64 {
        self.truths.iter().flatten().copied().fold(0.0, f64::max)
    }

    /// The mean squared error of lit pixels, of which these are a sample.
    pub(super) fn mean_square(&self, found: &[[f64; 3]]) -> f64 {
        let squares = self.weighted(&self.squares(found));
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    }

    /// Values of pixels, weighted so that their mean is that of all lit pixels.
    fn weighted(&self, values: &[f64]) -> Vec<f64> {
        // The weights of lit pixels alone have another mean than 1.
        let mean_weight = self.weights.iter().sum::<f64>() / self.weights.len().max(1) as f64;
        values.iter().zip(&self.weights).map(|(value, w)| value * w / mean_weight).collect()
    }

    /// The squared error of each pixel, as the mean over channels.
    fn squares(&self, found: &[[f64; 3]]) -> Vec<f64> {
        let square = |(a, b): (&[f64; 3], &[f64; 3])| {
            a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 3.0
        };
        self.truths.iter().zip(found).map(square).collect()
    }

    /// The error of a picture at the pixels.
    ///
    /// # Panics
    /// If the picture is smaller than the one that the pixels were drawn for.
    pub fn error(&self, image: &Image) -> PictureError {
        let colour = |[x, y]: [u32; 2]| {
            let [r, g, b, _] = image.pixel(x, y);
            [r, g, b].map(f64::from)
        };
        let found: Vec<[f64; 3]> = self.pixels.iter().map(|&pixel| colour(pixel)).collect();
        let squares = self.squares(&found);
        let unit = bright(image).max(f64::MIN_POSITIVE);
        let largest = squares.iter().copied().fold(0.0, f64::max).sqrt() / unit;
        let [mean, bound] = mean_and_bound(&self.weighted(&squares));
        PictureError {
            pixels: squares.len(),
            rms: mean.sqrt() / unit,
            bound: bound.sqrt() / unit,
            largest,
        }
    }
}

/// For each pixel, the largest difference of a channel from the neighbours to the right and below,
/// and from those to the left and above.
fn changes(image: &Image) -> Vec<f64> {
    let (width, height) = (image.width as usize, image.height as usize);
    let mut changes = vec![0.0_f64; image.pixels.len()];
    let mut pair = |a: usize, b: usize| {
        let channels = image.pixels[a].iter().zip(&image.pixels[b]).take(3);
        let change = channels.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
        (changes[a], changes[b]) = (changes[a].max(change), changes[b].max(change));
    };
    for i in 0..width * height {
        if i % width + 1 < width {
            pair(i, i + 1);
        }
        if i + width < width * height {
            pair(i, i + width);
        }
    }
    changes
}

/// The mean of `squares`, and the upper end of its 95 % interval. The correction for skewness is
/// that of Johnson (1978), "Modified t Tests and Confidence Intervals for Asymmetrical
/// Populations": few pixels have most of the error.
fn mean_and_bound(squares: &[f64]) -> [f64; 2] {
    let n = squares.len().max(1) as f64;
    let mean = squares.iter().sum::<f64>() / n;
    let moment = |power: i32| squares.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
    let (variance, third) = (moment(2) * n / (n - 1.0).max(1.0), moment(3));
    if variance <= 0.0 {
        return [mean, mean];
    }
    let skew = third * (1.0 + 2.0 * DEVIATIONS_95 * DEVIATIONS_95) / (6.0 * variance * n);
    [mean, mean + DEVIATIONS_95 * (variance / n).sqrt() + skew.max(0.0)]
}

/// The 99.9th percentile of the lit pixels' radiance, the largest of each one's channels.
pub(super) fn bright(image: &Image) -> f64 {
    let largest = image.pixels.iter().map(|&[r, g, b, _]| r.max(g).max(b));
    lit_percentile(largest, BRIGHT).into()
}

/// The radiance of pixels, summed over beams, each lit through its own shadow.
pub(super) fn marched(
    beams: &[Beam],
    frames: &[Frame],
    shadows: &[&dyn Shadow],
    pixels: &[[u32; 2]],
) -> Result<Vec<[f64; 3]>> {
    let mut sum = Image::filled(pixels.len() as u32, 1, [0.0; 4]);
    for ((beam, frame), &shadow) in beams.iter().zip(frames).zip(shadows) {
        let seen = CpuBackend.march_pixels(beam.casters(), frame, shadow, pixels)?;
        beam.add(&Image { pixels: seen, width: sum.width, height: 1 }, &mut sum);
    }
    Ok(sum.pixels.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In how many of 1,000 cases the bound is above the mean at every look.
    fn kept(mut square: impl FnMut(&mut Random) -> f64, mean: f64) -> usize {
        let mut random = Random::new(5, 1);
        let mut case = || {
            let squares: Vec<f64> = (0..320).map(|_| square(&mut random)).collect();
            [160, 320].iter().all(|&n| mean_and_bound(&squares[..n])[1] > mean)
        };
        (0..1_000).filter(|_| case()).count()
    }

    #[test]
    fn the_bound_is_that_of_an_interval_that_covers_the_mean() {
        let [mean, bound] = mean_and_bound(&[1.0; 50]);
        assert_eq!([mean, bound], [1.0, 1.0]);
        // Squares of uniform numbers have the mean 1 / 3: the bound stays above it in 95 of 100
        // cases.
        let uniform = kept(|random| random.unit().powi(2), 1.0 / 3.0);
        assert!((935..=970).contains(&uniform), "{uniform}");
        // A tenth of the pixels with all of the error.
        let rare = |random: &mut Random| {
            if random.unit() < 0.1 { random.unit().powi(2) } else { 0.0 }
        };
        let rare = kept(rare, 1.0 / 30.0);
        assert!(rare >= 925, "{rare}");
    }
}
