//! The error of a picture, certified: random pixels of it are compared with the truth.
//!
//! Pixels that were interpolated, or got fewer rays than others, err rarely and then much, so that a
//! few hundred pixels may meet none of those that do. But what they should be is found by marching
//! them, thousands in the time of a few true ones. So there are two samples (double sampling with a
//! difference estimator; Cochran 1977, "Sampling Techniques", chapter 12): a large one of the squared
//! differences between pixels of the picture and marched ones, and a small one of how much the squared
//! errors against the truth exceed those.

use std::fmt;

use super::sampled::{Places, Sampled, bright, radiance, squares, weighted};
use super::{SEED, STREAMS};
use crate::accuracy::Random;
use crate::backend::Stage;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::scene::Scene;
use crate::settings::Settings;

/// Lit pixels that certify a picture: so many, and if the answer is not clear, so many in all.
const CERTIFIED: [usize; 2] = [160, 320];
/// With fewer lit pixels, but for none at all, there is no certificate.
const FEWEST: usize = 30;
/// Pixels that are marched to find what interpolation does. Pictures of no more pixels are looked at
/// as a whole.
const MARCHED: usize = 4096;
/// The edges of the parts of a picture whose pixels are marched one after another.
const PART: u32 = 16;
/// Deviations of a normal distribution that are exceeded in 5 % of all cases at any of two looks
/// at a growing sample (Pocock 1977, "Group Sequential Methods in the Design and Analysis of Clinical
/// Trials", table 1, for both sides at 10 %). At a single one it is 1.645.
const DEVIATIONS_95: f64 = 1.875;

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
    /// The RMS error of pixels that are interpolated, or have fewer rays than others, against
    /// marched ones, over all lit pixels; 0 if it is not known.
    pub interpolated: f64,
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pixels, rms, bound, largest, .. } = self;
        write!(
            f,
            "{rms:.5} RMS of the 99.9th percentile of radiance at {pixels} random lit pixels, at \
             most {bound:.5} with 95 % confidence over all of them, {largest:.5} at worst"
        )
    }
}

impl PictureError {
    /// The error of `image` at the pixels of a sample. With what is known of its interpolated
    /// pixels, that sample needs to tell the rest only.
    pub(super) fn of(
        sampled: &Sampled,
        image: &Image,
        known: Option<(&Interpolated, &[[f64; 3]])>,
    ) -> Self {
        let found = seen(image, sampled.pixels());
        let errors = squares(sampled.truths(), &found);
        let unit = bright(image).max(f64::MIN_POSITIVE);
        let largest = errors.iter().copied().fold(0.0, f64::max).sqrt() / unit;
        let (estimate, interpolated) = match known {
            None => (Estimate::of(&sampled.weighted(&errors)), 0.0),
            Some((interpolated, marched)) => {
                let differences = squares(marched, &found);
                let rest: Vec<f64> =
                    errors.iter().zip(differences).map(|(error, of)| error - of).collect();
                let rest = Estimate::of(&sampled.weighted(&rest));
                (rest.and(interpolated.squares), interpolated.squares.mean)
            }
        };
        let share = |square: f64| square.max(0.0).sqrt() / unit;
        Self {
            pixels: errors.len(),
            rms: share(estimate.mean),
            bound: share(estimate.bound()),
            largest,
            interpolated: share(interpolated),
        }
    }
}

impl Sampled {
    /// The error of a picture at the pixels.
    ///
    /// # Panics
    /// If the picture is smaller than the one that the pixels were drawn for.
    pub fn error(&self, image: &Image) -> PictureError {
        PictureError::of(self, image, None)
    }
}

/// The radiance of pixels of a picture.
fn seen(image: &Image, pixels: &[[u32; 2]]) -> Vec<[f64; 3]> {
    pixels.iter().map(|&[x, y]| radiance(image.pixel(x, y))).collect()
}

/// The error of a picture that `stage` has just made, at pixels of their own stream of random
/// numbers. More of them are looked at until its bound is below the first of two limits, or its RMS
/// error above the second; without limits once.
pub(super) fn certified(
    stage: &mut dyn Stage,
    (scene, settings, image): (&Scene, &Settings, &Image),
    stream: u64,
    limits: Option<[f64; 2]>,
) -> Result<PictureError> {
    let places = Places::of(image, settings.image.size);
    let made = (scene, settings, image);
    let interpolated = Interpolated::measure(stage, made, places.as_ref(), stream)?;
    let mut sampled = Sampled::default();
    let mut error = PictureError::default();
    for (look, &count) in CERTIFIED.iter().enumerate() {
        // Each look draws from numbers of its own.
        let stream = stream + STREAMS * look as u64;
        let missing = count.saturating_sub(sampled.pixels().len());
        let seed = [SEED, stream];
        sampled.join(Sampled::draw_at(places.as_ref(), scene, settings, missing, seed)?);
        let marched = match interpolated {
            Some(_) => stage.pixels(scene, settings, sampled.pixels())?,
            None => None,
        };
        let marched: Option<Vec<[f64; 3]>> =
            marched.map(|pixels| pixels.into_iter().map(radiance).collect());
        error = PictureError::of(&sampled, image, interpolated.as_ref().zip(marched.as_deref()));
        let is_enough = |[low, high]: [f64; 2]| error.bound <= low || error.rms > high;
        if limits.is_none_or(is_enough) {
            break;
        }
    }
    enough(error)
}

/// The error of `image`, the picture of `scene` under `settings`, at random lit pixels. Rare errors
/// of interpolated pixels may be missed.
///
/// # Errors
/// If a light cannot be fitted to the media, or if too few lit pixels are found.
pub fn picture_error(scene: &Scene, settings: &Settings, image: &Image) -> Result<PictureError> {
    let sampled = Sampled::draw_for(image, scene, settings, CERTIFIED[0], [SEED, 2])?;
    enough(sampled.error(image))
}

fn enough(error: PictureError) -> Result<PictureError> {
    if (1..FEWEST).contains(&error.pixels) {
        let why = format!("only {} lit pixels were found, too few to certify", error.pixels);
        return Err(Error::value("max-picture-error or time", why));
    }
    Ok(error)
}

/// What interpolation does to a picture.
pub(super) struct Interpolated {
    /// The mean squared difference of lit pixels from marched ones.
    squares: Estimate,
}

impl Interpolated {
    /// Marches pixels of the picture `image`; `None` if all of its pixels were marched, if the stage
    /// cannot tell, or among surfaces: none of their pixels is interpolated, and to draw one takes
    /// as long as a whole tile.
    fn measure(
        stage: &mut dyn Stage,
        (scene, settings, image): (&Scene, &Settings, &Image),
        places: Option<&Places>,
        stream: u64,
    ) -> Result<Option<Self>> {
        if !scene.surfaces.is_empty() {
            return Ok(None);
        }
        let [width, height] = settings.image.size;
        let is_whole = u64::from(width) * u64::from(height) <= MARCHED as u64;
        let mut drawn: Vec<([u32; 2], f64)> = if is_whole {
            (0..height).flat_map(|y| (0..width).map(move |x| ([x, y], 1.0))).collect()
        } else {
            let Some(places) = places else { return Ok(None) };
            let mut random = Random::new(SEED, stream + 2 * STREAMS);
            (0..MARCHED).map(|_| places.next(&mut random)).collect()
        };
        // Neighbours see the same voxels.
        drawn.sort_by_key(|([x, y], _)| [y / PART, x / PART, *y, *x]);
        let (pixels, weights): (Vec<[u32; 2]>, Vec<f64>) = drawn.into_iter().unzip();
        let Some(marched) = stage.pixels(scene, settings, &pixels)? else { return Ok(None) };
        let marched: Vec<[f64; 3]> = marched.into_iter().map(radiance).collect();
        let found = seen(image, &pixels);
        let is_lit = |i: &usize| [marched[*i], found[*i]].as_flattened().iter().any(|&c| c > 0.0);
        let lit: Vec<usize> = (0..pixels.len()).filter(is_lit).collect();
        let all = squares(&marched, &found);
        let of = |values: &[f64]| lit.iter().map(|&i| values[i]).collect::<Vec<f64>>();
        let squares = Estimate::of(&weighted(&of(&all), &of(&weights)));
        Ok(Some(Self { squares: if is_whole { squares.certain() } else { squares } }))
    }
}

/// A mean, as a sample tells it.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    mean: f64,
    /// The variance of that, and its third central moment.
    variance: f64,
    third: f64,
}

impl Estimate {
    /// The mean of what these values are a sample of.
    fn of(values: &[f64]) -> Self {
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let moment = |power: i32| values.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
        let variance = moment(2) / (n - 1.0).max(1.0);
        Self { mean, variance, third: moment(3) / (n * n) }
    }

    /// The same where the values are all that there are.
    fn certain(self) -> Self {
        Self { mean: self.mean, ..Self::default() }
    }

    /// The sum of two means, of independent samples.
    fn and(self, other: Self) -> Self {
        Self {
            mean: self.mean + other.mean,
            variance: self.variance + other.variance,
            third: self.third + other.third,
        }
    }

    /// The upper end of the mean's 95 % interval, also at two looks. The correction for skewness is
    /// that of Johnson (1978), "Modified t Tests and Confidence Intervals for Asymmetrical
    /// Populations": few pixels have most of the error.
    fn bound(self) -> f64 {
        if self.variance <= 0.0 {
            return self.mean;
        }
        let (z, variance) = (DEVIATIONS_95, self.variance);
        let skew = self.third * (1.0 + 2.0 * z * z) / (6.0 * variance);
        self.mean + z * variance.sqrt() + skew.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In how many of 1,000 cases the bound is above the mean at every look.
    fn kept(mut square: impl FnMut(&mut Random) -> f64, mean: f64) -> usize {
        let mut random = Random::new(5, 1);
        let mut case = || {
            let squares: Vec<f64> = (0..320).map(|_| square(&mut random)).collect();
            [160, 320].iter().all(|&n| Estimate::of(&squares[..n]).bound() > mean)
        };
        (0..1_000).filter(|_| case()).count()
    }

    #[test]
    fn the_bound_is_that_of_an_interval_that_covers_the_mean() {
        let estimate = Estimate::of(&[1.0; 50]);
        assert_eq!([estimate.mean, estimate.bound()], [1.0, 1.0]);
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
