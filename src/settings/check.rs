//! The ranges of all settings. Each rule stands here once, for programs and for scene files.

use std::fmt::Display;
use std::ops::RangeInclusive;

use super::{MapSettings, Settings};
use crate::error::{Error, Result};

/// Pixels along an edge of a picture.
const PIXELS: RangeInclusive<u32> = 1..=1 << 14;
/// Texels along an edge of a map.
const TEXELS: RangeInclusive<u32> = 1..=1 << 13;
/// Camera rays per pixel.
const SAMPLES: RangeInclusive<u32> = 1..=1 << 12;
/// Steps along a ray.
const STEPS: RangeInclusive<u32> = 1..=1 << 20;
/// Lookups along a camera ray with the paper's shading.
const LIGHT_SAMPLES: RangeInclusive<u32> = 1..=1 << 16;
/// Octaves.
const OCTAVES: RangeInclusive<u32> = 0..=16;
/// f32 cannot resolve the steps of higher qualities.
const QUALITIES: RangeInclusive<f64> = 0.125..=64.0;
/// Errors that may be allowed of transmittance, or of radiance as a share.
const ERRORS: RangeInclusive<f64> = 0.0..=0.5;
/// The smallest memory for lists, in bytes; nothing can be built with less.
const LEAST_MEMORY: u64 = 1 << 20;
/// The smallest difference between two opacities of a threshold map, and from 0 and 1.
const LEAST_RISE: f64 = 1e-6;

/// A field with a value out of its range, such as `map.size`, and what is wrong with the value.
pub(crate) type Fault = (&'static str, String);

impl Settings {
    /// Checks that every value is in the range that its field states. Everything that builds maps
    /// or makes pictures does this first.
    ///
    /// # Errors
    /// [`ErrorKind::Value`](crate::ErrorKind::Value) with the first field that is out of its range,
    /// such as `map.size`.
    pub fn check(&self) -> Result<()> {
        self.fault().map_or(Ok(()), |(field, why)| Err(Error::value(field, why)))
    }

    /// The first field that is out of its range.
    pub(crate) fn fault(&self) -> Option<Fault> {
        let (image, view) = (&self.image, &self.view);
        let [width, height] = image.size;
        let exposure = image.exposure;
        let exposes = exposure > 0.0 && exposure.is_finite();
        let bias = view.bias;
        let biases = bias >= 0.0 && bias.is_finite();
        outside("image.size[0]", width, &PIXELS)
            .or_else(|| outside("image.size[1]", height, &PIXELS))
            .or_else(|| outside("image.samples", image.samples, &SAMPLES))
            .or_else(|| outside("image.tolerance", image.tolerance, &ERRORS))
            .or_else(|| unless(exposes, "image.exposure", || format!("{exposure} is not above 0")))
            .or_else(|| view.steps.and_then(|steps| outside("view.steps", steps, &STEPS)))
            .or_else(|| outside("view.light_samples", view.light_samples, &LIGHT_SAMPLES))
            .or_else(|| outside("view.octaves", view.octaves, &OCTAVES))
            .or_else(|| {
                unless(biases, "view.bias", || format!("{bias} is not a length of at least 0"))
            })
            .or_else(|| outside("quality", self.quality, &QUALITIES))
            .or_else(|| of_map(&self.map))
    }
}

/// The first field of the map's settings that is out of its range.
fn of_map(map: &MapSettings) -> Option<Fault> {
    let fragments = &map.fragments;
    let [low, middle, high] = map.threshold.levels;
    // Compared with a margin that f32 keeps, which is what maps hold.
    let rises = low >= LEAST_RISE
        && low + LEAST_RISE < middle
        && middle + LEAST_RISE < high
        && high <= 1.0 - LEAST_RISE;
    outside("map.size", map.size, &TEXELS)
        .or_else(|| outside("map.steps", map.steps, &STEPS))
        .or_else(|| map.kind.and_then(|kind| Some(("map.kind", kind.fault()?))))
        .or_else(|| {
            unless(rises, "map.threshold.levels", || {
                format!("{low}, {middle}, {high} are not in increasing order between 0 and 1")
            })
        })
        .or_else(|| outside("map.fragments.tolerance", fragments.tolerance, &ERRORS))
        .or_else(|| outside("map.fragments.truncation", fragments.truncation, &ERRORS))
        .or_else(|| {
            unless(fragments.memory >= LEAST_MEMORY, "map.fragments.memory", || {
                format!("fewer than {LEAST_MEMORY} bytes cannot hold a row of lists")
            })
        })
}

/// A fault if `value` is outside of `range`, or NaN.
fn outside<T: PartialOrd + Display + Copy>(
    field: &'static str,
    value: T,
    range: &RangeInclusive<T>,
) -> Option<Fault> {
    let (least, most) = (range.start(), range.end());
    unless(range.contains(&value), field, || format!("{value} is not between {least} and {most}"))
}

fn unless(right: bool, field: &'static str, why: impl FnOnce() -> String) -> Option<Fault> {
    (!right).then(|| (field, why()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Coding, MapKind};

    #[test]
    fn defaults_and_the_ends_of_ranges_pass() {
        assert!(Settings::default().check().is_ok());
        let ends = Settings::default().with(|s| {
            (s.image.size, s.image.samples) = ([1, 16384], 4096);
            (s.map.size, s.map.steps, s.view.steps) = (8192, 1, Some(1 << 20));
            (s.view.octaves, s.view.light_samples, s.quality) = (16, 1, 64.0);
            s.map.kind = Some(MapKind::Coded(Coding::Slices(1024)));
            s.map.threshold.levels = [1e-6, 0.5, 1.0 - 1e-6];
            (s.map.fragments.tolerance, s.map.fragments.truncation) = (0.0, 0.5);
            s.map.fragments.memory = 1 << 20;
        });
        assert!(ends.check().is_ok(), "{:?}", ends.check());
    }

    #[test]
    fn a_value_out_of_its_range_is_an_error_that_names_its_field() {
        type Change = fn(&mut Settings);
        let cases: &[(&str, &[Change])] = &[
            ("image.size[0]", &[|s| s.image.size[0] = 0, |s| s.image.size[0] = 16385]),
            ("image.size[1]", &[|s| s.image.size[1] = 0, |s| s.image.size[1] = u32::MAX]),
            ("image.samples", &[|s| s.image.samples = 0, |s| s.image.samples = 4097]),
            (
                "image.exposure",
                &[
                    |s| s.image.exposure = 0.0,
                    |s| s.image.exposure = -1.0,
                    |s| s.image.exposure = f64::NAN,
                    |s| s.image.exposure = f64::INFINITY,
                ],
            ),
            ("view.steps", &[|s| s.view.steps = Some(0), |s| s.view.steps = Some(u32::MAX)]),
            ("view.light_samples", &[|s| s.view.light_samples = 0]),
            ("view.octaves", &[|s| s.view.octaves = 17, |s| s.view.octaves = 99]),
            (
                "view.bias",
                &[
                    |s| s.view.bias = -1.0,
                    |s| s.view.bias = f64::NAN,
                    |s| s.view.bias = f64::INFINITY,
                ],
            ),
            (
                "quality",
                &[
                    |s| s.quality = 0.0,
                    |s| s.quality = -1.0,
                    |s| s.quality = 65.0,
                    |s| s.quality = f64::NAN,
                    |s| s.quality = f64::INFINITY,
                ],
            ),
            ("map.size", &[|s| s.map.size = 0, |s| s.map.size = 9000]),
            ("map.steps", &[|s| s.map.steps = 0, |s| s.map.steps = u32::MAX]),
            (
                "map.kind",
                &[
                    |s| s.map.kind = Some(MapKind::Grid(0)),
                    |s| s.map.kind = Some(MapKind::Grid(u16::MAX)),
                    |s| s.map.kind = Some(MapKind::Coded(Coding::Fourier(4))),
                ],
            ),
            (
                "map.threshold.levels",
                &[
                    |s| s.map.threshold.levels = [0.9, 0.5, 0.1],
                    |s| s.map.threshold.levels = [0.0, 0.5, 0.9],
                    |s| s.map.threshold.levels = [0.1, 0.5, 1.0],
                    |s| s.map.threshold.levels = [0.1, f64::NAN, 0.9],
                ],
            ),
            (
                "map.fragments.tolerance",
                &[
                    |s| s.map.fragments.tolerance = -0.1,
                    |s| s.map.fragments.tolerance = 0.6,
                    |s| s.map.fragments.tolerance = f64::NAN,
                ],
            ),
            ("map.fragments.truncation", &[|s| s.map.fragments.truncation = f64::INFINITY]),
            ("map.fragments.memory", &[|s| s.map.fragments.memory = 0]),
        ];
        for (field, changes) in cases {
            for (i, change) in changes.iter().enumerate() {
                let found = Settings::default().with(change).check();
                let said = found.map_or_else(|error| error.to_string(), |()| "accepted".to_owned());
                assert!(said.starts_with(&format!("{field}: ")), "{field}, case {i}: {said}");
            }
        }
    }
}
