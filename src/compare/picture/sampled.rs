//! True radiance at random lit pixels of a picture.

use crate::accuracy::{ExactPoints, ExactTexels, Random};
use crate::cpu::CpuBackend;
use crate::error::Result;
use crate::frame::Frame;
use crate::image::{BRIGHT, Image, lit_percentile};
use crate::math::Each;
use crate::scene::{Beam, Scene};
use crate::settings::Settings;
use crate::shadow::Shadow;

/// How much finer camera rays of the truth are than those of the picture: as measured, their error
/// is less than a tenth of its own.
const FINER: f64 = 2.0;
/// The least quality of the truth: thin media must not be missed.
const LEAST_QUALITY: f64 = 1.4;
const MOST_QUALITY: f64 = 64.0;
/// Pixels that are drawn in the hope of one that is lit.
const PATIENCE: usize = 16;
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

impl Sampled {
    /// Draws about `count` lit pixels of the picture of `scene` under `settings` evenly, with random
    /// numbers of a seed and a stream, and integrates their radiance: exact transmittance from the
    /// light (in f64), camera rays at least twice as fine as the picture's, up to quality 64.
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
        let places = Places::of(image, settings.image.size);
        Self::draw_at(places.as_ref(), scene, settings, count, seed)
    }

    /// The same at `places`, or evenly.
    pub(super) fn draw_at(
        places: Option<&Places>,
        scene: &Scene,
        settings: &Settings,
        count: usize,
        seed: [u64; 2],
    ) -> Result<Self> {
        match places {
            Some(places) => {
                Self::drawn(scene, settings, count, seed, &mut |random| places.next(random))
            }
            None => Self::draw(scene, settings, count, seed),
        }
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
        let fine =
            settings.with(|s| s.quality = (FINER * s.quality).clamp(LEAST_QUALITY, MOST_QUALITY));
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

    /// Their true radiance.
    pub(super) fn truths(&self) -> &[[f64; 3]] {
        &self.truths
    }

    /// Values of the pixels, weighted so that their mean is that of all lit pixels.
    pub(super) fn weighted(&self, values: &[f64]) -> Vec<f64> {
        weighted(values, &self.weights)
    }

    /// The mean squared error of lit pixels, of which these are a sample.
    pub(super) fn mean_square(&self, found: &[[f64; 3]]) -> f64 {
        let squares = self.weighted(&squares(&self.truths, found));
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    }
}

/// Values of lit pixels, weighted so that their mean is that of all lit pixels: the weights of lit
/// pixels alone have another mean than 1.
pub(super) fn weighted(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let mean_weight = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    values.iter().zip(weights).map(|(value, w)| value * w / mean_weight).collect()
}

/// The squared difference of each pixel, as the mean over channels.
pub(super) fn squares(a: &[[f64; 3]], b: &[[f64; 3]]) -> Vec<f64> {
    let square = |(a, b): (&[f64; 3], &[f64; 3])| {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 3.0
    };
    a.iter().zip(b).map(square).collect()
}

/// Where to look at a picture: half of the places are drawn evenly, and half more often where the
/// picture changes from pixel to pixel.
pub(super) struct Places {
    /// Running sums of the changes of the pixels of a picture, which may be a smaller one.
    sums: Vec<f64>,
    size: [u32; 2],
    /// Width and height of the picture that is looked at.
    of: [u32; 2],
}

impl Places {
    /// `None` if `image` does not change, or is black.
    pub(super) fn of(image: &Image, of: [u32; 2]) -> Option<Self> {
        let changes = changes(image);
        let lit = image.pixels.iter().map(|pixel| pixel[..3].iter().any(|&c| c > 0.0));
        let mut sum = 0.0;
        let sums = lit.zip(&changes).map(|(lit, change)| {
            sum += if lit { f64::from(*change) } else { 0.0 };
            sum
        });
        let sums: Vec<f64> = sums.collect();
        (sum > 0.0).then_some(Self { sums, size: [image.width, image.height], of })
    }

    /// A place, and how many times rarer it is drawn than evenly drawn ones.
    pub(super) fn next(&self, random: &mut Random) -> ([u32; 2], f64) {
        let Self { sums, size, of } = self;
        let (last, sum) = (sums.len() - 1, sums[sums.len() - 1]);
        let index = if random.unit() < EVEN {
            random.below(sums.len() as u64) as usize
        } else {
            let at = random.unit() * sum;
            sums.partition_point(|&sum| sum <= at).min(last)
        };
        let before = index.checked_sub(1).map_or(0.0, |before| sums[before]);
        let share = (sums[index] - before) / sum;
        let density = EVEN + (1.0 - EVEN) * share * sums.len() as f64;
        // One of those that a pixel of a smaller picture stands for.
        let mut place = |at: u32, n: u32, of: u32| {
            let [first, next] = [at, at + 1].map(|at| u64::from(at) * u64::from(of) / u64::from(n));
            (first + random.below((next - first).max(1))) as u32
        };
        let x = place(index as u32 % size[0], size[0], of[0]);
        let y = place(index as u32 / size[0], size[1], of[1]);
        ([x, y], 1.0 / density)
    }
}

/// For each pixel, the largest difference of a channel from the neighbours to the right and below,
/// and from those to the left and above.
fn changes(image: &Image) -> Vec<f32> {
    let width = image.width.max(1) as usize;
    let mut changes = vec![0.0_f32; image.pixels.len()];
    let differ = |a: &[f32; 4], b: &[f32; 4]| {
        let [r, g, b] = [0, 1, 2].each(|c| (a[c] - b[c]).abs());
        r.max(g).max(b)
    };
    let rows: Vec<&[[f32; 4]]> = image.pixels.chunks(width).collect();
    for (row, own) in rows.iter().zip(changes.chunks_mut(width)) {
        for (i, pair) in row.windows(2).enumerate() {
            let change = differ(&pair[0], &pair[1]);
            (own[i], own[i + 1]) = (own[i].max(change), own[i + 1].max(change));
        }
    }
    for (y, pair) in rows.windows(2).enumerate() {
        let (above, below) = changes[y * width..].split_at_mut(width);
        for (x, (a, b)) in pair[0].iter().zip(pair[1]).enumerate() {
            let change = differ(a, b);
            (above[x], below[x]) = (above[x].max(change), below[x].max(change));
        }
    }
    changes
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
    Ok(sum.pixels.into_iter().map(radiance).collect())
}

/// The radiance of a pixel.
pub(super) fn radiance([r, g, b, _]: [f32; 4]) -> [f64; 3] {
    [r, g, b].map(f64::from)
}
