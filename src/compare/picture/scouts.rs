//! What a few pixels say about all: errors and times of a picture by the size of its maps and its
//! quality.

use web_time::Instant;

use super::sampled::{bright, marched};
use super::{Given, QUALITIES, Sampled};
use crate::backend::Backend;
use crate::cpu::{CpuBackend, LazyFragments};
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::progress::Silent;
use crate::scene::{Beam, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::Shadow;

/// The quality of scouts.
const QUALITY: f64 = 0.5;
/// Sizes of scouts' maps, as shares of the size that settings have.
const SHARES: [f64; 2] = [0.25, 0.5];
/// The smallest and the largest size that is chosen, as such shares.
const SIZE_SHARES: [f64; 2] = [0.19, 6.0];
/// The longest edge of the preview in pixels, and its quality.
const PREVIEW: u32 = 40;
const PREVIEW_QUALITY: f64 = 0.25;
/// Sizes are multiples of this, and lie between these.
const MULTIPLE: u32 = 16;
const SIZES: [u32; 2] = [32, 4096];
/// The least share of the squared error with larger maps that is taken for each of the errors by
/// steps and by texels.
const LEAST: f64 = 0.1;
/// The times of pixels are the best of so many.
const TIMED: usize = 3;
/// Steps of quality that are tried, as a factor.
const FINER: f64 = 1.09;
/// The powers of quality by which squared errors fall, below and above the scouts' quality, as
/// measured. Those of steps and tolerances fall with the fourth; limits of steps by voxels make
/// coarse ones better than that and fine ones even better.
const POWERS: [i32; 2] = [4, 5];
/// The power of quality by which texels and pixels take longer, as measured: steps are limited by
/// voxels as well.
const POWER: f64 = 0.8;
/// The share of pixels that are marched, if not all are.
const MARCHED: f64 = 0.5;
/// The edges of the picture whose time is measured where there are surfaces, as a share.
const SMALLER: u32 = 4;
/// The share of the time that a choice leaves for what it does not know (files, the certificate).
const RESERVE: f64 = 0.1;

/// What scouts found.
pub(super) struct Scouts {
    settings: Settings,
    beams: f64,
    pixels: f64,
    /// Squared errors at the scouts' quality by steps and tolerances, and with maps of one texel by
    /// texels.
    errors: [f64; 2],
    /// Seconds of a texel and of a pixel, at the scouts' quality, on all threads together.
    seconds: [f64; 2],
    begun: Instant,
}

/// Seconds of a texel and of a pixel under `settings`, on all threads together, of a map and a small
/// picture: surfaces are drawn tile by tile, so a few texels and pixels alone say little.
fn of_surfaces(beams: &[Beam], settings: &Settings) -> Result<[f64; 2]> {
    let small = settings.with(|s| {
        s.map.kind = Some(MapKind::Fragments);
        s.image.size = s.image.size.map(|n| n.div_ceil(SMALLER));
    });
    let mut seconds = [0.0; 2];
    for beam in beams {
        let begun = Instant::now();
        let map = CpuBackend.map(beam, &small, &Silent)?;
        seconds[0] += begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        CpuBackend.view(beam, &small, &map, &Silent)?;
        seconds[1] += begun.elapsed().as_secs_f64();
    }
    let texels = f64::from(small.map.size).powi(2);
    let [width, height] = small.image.size.map(f64::from);
    let beams = beams.len() as f64;
    Ok([seconds[0] / texels / beams, seconds[1] / (width * height) / beams])
}

/// A small, coarse picture: where something is seen, and where that changes.
fn preview(beams: &[Beam], settings: &Settings) -> Result<Image> {
    let longest = settings.image.size[0].max(settings.image.size[1]).max(1);
    let small = settings.with(|s| {
        s.quality = PREVIEW_QUALITY;
        s.map.size = multiple(SIZE_SHARES[0] * f64::from(s.map.size));
        let edge = PREVIEW.min(longest);
        s.image.size = s.image.size.map(|n| (n * edge).div_ceil(longest));
    });
    let frames = frames(beams, &small)?;
    let maps = lazy(beams, &frames)?;
    let shadows: Vec<&dyn Shadow> = maps.iter().map(|map| map as &dyn Shadow).collect();
    let [width, height] = small.image.size;
    let places: Vec<[u32; 2]> = (0..width * height).map(|i| [i % width, i / width]).collect();
    let found = marched(beams, &frames, &shadows, &places)?;
    let pixels = found.iter().map(|rgb| {
        let [r, g, b] = rgb.map(|c| c as f32);
        [r, g, b, 1.0]
    });
    Ok(Image { width, height, pixels: pixels.collect() })
}

fn frames(beams: &[Beam], settings: &Settings) -> Result<Vec<Frame>> {
    beams.iter().map(|beam| Frame::new(beam, settings)).collect()
}

/// Maps whose texels are traced where they are looked up.
fn lazy<'a>(beams: &'a [Beam], frames: &'a [Frame]) -> Result<Vec<LazyFragments<'a>>> {
    beams
        .iter()
        .zip(frames)
        .map(|(beam, frame)| LazyFragments::new(beam.casters(), frame))
        .collect()
}

impl Scouts {
    /// Looks at about `count` lit pixels.
    pub(super) fn look(
        scene: &Scene,
        settings: &Settings,
        count: usize,
        seed: u64,
    ) -> Result<Self> {
        let begun = Instant::now();
        let beams = scene.beams()?;
        let preview = preview(&beams, settings)?;
        let truth = Sampled::draw_for(&preview, scene, settings, count, [seed, 1])?;
        // What is smaller than the preview's pixels may be missing there.
        let unit = match bright(&preview) {
            seen if seen > 0.0 => seen,
            _ => truth.brightest().max(f64::MIN_POSITIVE),
        };
        let lit = preview.pixels.iter().filter(|pixel| pixel[..3].iter().any(|&c| c > 0.0));
        let lit_share = lit.count() as f64 / preview.pixels.len() as f64;
        let sizes = SHARES.map(|share| multiple(share * f64::from(settings.map.size)));
        let (mut squares, mut seconds, mut sparse) = ([0.0; 2], [0.0; 2], false);
        for (i, &size) in sizes.iter().enumerate() {
            let scout = settings.with(|s| (s.quality, s.map.size) = (QUALITY, size));
            let frames = frames(&beams, &scout)?;
            sparse = frames.iter().any(|frame| frame.view.spacing > 1);
            let maps = lazy(&beams, &frames)?;
            let shadows: Vec<&dyn Shadow> = maps.iter().map(|map| map as &dyn Shadow).collect();
            // The first march traces the texels, the second only looks them up.
            let found = marched(&beams, &frames, &shadows, truth.pixels())?;
            let mut marching = f64::INFINITY;
            for _ in 0..TIMED {
                let again = Instant::now();
                marched(&beams, &frames, &shadows, truth.pixels())?;
                marching = marching.min(again.elapsed().as_secs_f64());
            }
            let threads = rayon::current_num_threads() as f64;
            squares[i] = (truth.mean_square(&found).sqrt() / unit).powi(2);
            let traced = maps.iter().map(LazyFragments::traced);
            let (texels, tracing) = traced.fold((0, 0.0), |(n, s), (m, t)| (n + m, s + t));
            seconds = [
                tracing / texels.max(1) as f64 / threads,
                marching / truth.pixels().len().max(1) as f64 * lit_share,
            ];
        }
        if !scene.surfaces.is_empty() {
            let [_, size] = sizes;
            seconds =
                of_surfaces(&beams, &settings.with(|s| (s.quality, s.map.size) = (QUALITY, size)))?;
        }
        let fourth = |size: u32| f64::from(size).powi(-4);
        // Neither is believed to be nothing because few pixels say so.
        let least = LEAST * squares[1];
        let by_texels = ((squares[0] - squares[1]) / (fourth(sizes[0]) - fourth(sizes[1])))
            .max(least / fourth(sizes[1]));
        let by_steps = (squares[1] - by_texels * fourth(sizes[1])).max(least);
        let [width, height] = settings.image.size.map(f64::from);
        Ok(Self {
            settings: settings.clone(),
            beams: beams.len() as f64,
            pixels: width * height * if sparse { MARCHED } else { 1.0 },
            errors: [by_steps, by_texels],
            seconds,
            begun,
        })
    }

    /// Takes note of a picture's RMS error. What the scouts did not expect is shared between steps
    /// and texels.
    pub(super) fn learn(&mut self, settings: &Settings, error: f64) {
        let (quality, size) = (settings.quality, settings.map.size);
        let excess = (error.powi(2) - self.error((quality, size)).powi(2)).max(0.0);
        self.errors[0] += 0.5 * excess / Self::falls(quality);
        self.errors[1] += 0.5 * excess * f64::from(size).powi(4);
    }

    /// The settings that are expected to be the fastest with an error of at most `most`.
    ///
    /// # Errors
    /// If none is expected to keep it; the error tells which is the smallest.
    pub(super) fn keeping(&self, most: f64, given: Given) -> Result<Settings> {
        let candidates = self.candidates(given);
        let within = candidates.iter().filter(|&&choice| self.error(choice) <= most);
        let fastest = within.min_by(|&&a, &&b| self.time(a).total_cmp(&self.time(b)));
        if let Some(&fastest) = fastest {
            return Ok(self.settings_of(fastest));
        }
        let errors = candidates.iter().map(|&choice| self.error(choice));
        let least = errors.fold(f64::INFINITY, f64::min);
        let why = format!("no picture is expected to be so exact; the best has about {least:.1e}");
        Err(Error::value("max-picture-error", why))
    }

    /// The settings that are expected to be the most exact within `seconds` from now on, less the
    /// time that scouting took.
    ///
    /// # Errors
    /// If even the fastest take longer.
    pub(super) fn within(&self, seconds: f64, given: Given) -> Result<Settings> {
        let left = seconds - self.begun.elapsed().as_secs_f64() - RESERVE * seconds;
        let candidates = self.candidates(given);
        let within = candidates.iter().filter(|&&choice| self.time(choice) <= left);
        let best = within.min_by(|&&a, &&b| self.error(a).total_cmp(&self.error(b)));
        match best {
            Some(&best) => Ok(self.settings_of(best)),
            None => {
                let fastest = candidates.iter().map(|&choice| self.time(choice));
                let least = seconds - left + fastest.fold(f64::INFINITY, f64::min);
                let why = format!("{seconds} s is too short; the fastest takes about {least:.2} s");
                Err(Error::value("time", why))
            }
        }
    }

    fn settings_of(&self, choice: (f64, u32)) -> Settings {
        self.settings.with(|s| (s.quality, s.map.size) = choice)
    }

    /// Qualities and sizes to choose from.
    fn candidates(&self, given: Given) -> Vec<(f64, u32)> {
        let qualities: Vec<f64> = if given.quality {
            vec![self.settings.quality]
        } else {
            let all = std::iter::successors(Some(QUALITIES[0]), |quality| Some(quality * FINER));
            // Three digits, as people are told them.
            all.take_while(|&quality| quality <= QUALITIES[1])
                .map(|quality| (quality * 1000.0).round() / 1000.0)
                .collect()
        };
        let sizes: Vec<u32> = if given.size {
            vec![self.settings.map.size]
        } else {
            // Far from the scouts' sizes nothing is known.
            let [least, most] =
                SIZE_SHARES.map(|share| multiple(share * f64::from(self.settings.map.size)));
            (least..=most).step_by(MULTIPLE as usize).collect()
        };
        let pairs = |&quality: &f64| sizes.iter().map(move |&size| (quality, size));
        qualities.iter().flat_map(pairs).collect()
    }

    /// The expected error, without that of pixels that are not marched.
    fn error(&self, (quality, size): (f64, u32)) -> f64 {
        let [by_steps, by_texels] = self.errors;
        (by_steps * Self::falls(quality) + by_texels / f64::from(size).powi(4)).sqrt()
    }

    /// The squared error by steps and tolerances as a share of the scouts'.
    fn falls(quality: f64) -> f64 {
        let power = if quality > QUALITY { POWERS[1] } else { POWERS[0] };
        (quality / QUALITY).powi(-power)
    }

    fn time(&self, (quality, size): (f64, u32)) -> f64 {
        let [texel, pixel] = self.seconds;
        let texels = self.beams * f64::from(size).powi(2);
        (texels * texel + self.pixels * pixel) * (quality / QUALITY).powf(POWER)
    }
}

fn multiple(size: f64) -> u32 {
    ((size / f64::from(MULTIPLE)).round() as u32 * MULTIPLE).clamp(SIZES[0], SIZES[1])
}
