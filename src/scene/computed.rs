//! How a scene is computed: the settings that a scene file asks for, checked.

use super::file::SceneFile;
use crate::error::{Error, Result};
use crate::settings::Settings;

/// Memory for lists below which nothing can be built.
const LEAST_MEMORY: u64 = 1 << 20;

/// Qualities that can be asked for: beyond, f32 tells no steps apart.
const QUALITIES: std::ops::RangeInclusive<f64> = 0.125..=64.0;

/// The settings that `file` asks for, defaults where it says nothing.
pub(super) fn settings(file: &SceneFile) -> Result<Settings> {
    let default = Settings::default();
    let (image, shadow) = (&file.image, &file.shadow);
    let count = |what: &str, given: Option<u32>, or: u32, most: u32| match given {
        Some(n) if n == 0 || n > most => {
            Err(Error::value(what, format!("{n} is not between 1 and {most}")))
        }
        given => Ok(given.unwrap_or(or)),
    };
    let exposure = image.exposure.unwrap_or(default.exposure);
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(Error::value("image.exposure", format!("{exposure} is not above 0")));
    }
    let thresholds = shadow.thresholds.unwrap_or(default.thresholds);
    let [low, middle, high] = thresholds;
    // As f32, which the maps are: 1 - 1e-6 is far enough from 1.
    if !(low >= 1e-6 && low + 1e-6 < middle && middle + 1e-6 < high && high <= 1.0 - 1e-6) {
        let why = format!("{low}, {middle}, {high} do not rise between 0 and 1");
        return Err(Error::value("shadow.thresholds", why));
    }
    let share = |what: &str, given: Option<f64>, or: f64| match given {
        Some(share) if !(0.0..=0.5).contains(&share) => {
            Err(Error::value(what, format!("{share} is not between 0 and 0.5")))
        }
        given => Ok(given.unwrap_or(or)),
    };
    let quality = shadow.quality.unwrap_or(default.quality);
    if !QUALITIES.contains(&quality) {
        let (least, most) = (QUALITIES.start(), QUALITIES.end());
        return Err(Error::value(
            "shadow.quality",
            format!("{quality} is not between {least} and {most}"),
        ));
    }
    let bias = shadow.bias.unwrap_or(default.bias);
    if !(bias >= 0.0 && bias.is_finite()) {
        return Err(Error::value("shadow.bias", format!("{bias} is no length of at least 0")));
    }
    if shadow.memory.is_some_and(|bytes| bytes < LEAST_MEMORY) {
        let why = format!("less than {LEAST_MEMORY} bytes hold no row of lists");
        return Err(Error::value("shadow.memory", why));
    }
    Ok(Settings {
        image_size: [
            count("image.width", image.width, default.image_size[0], 1 << 14)?,
            count("image.height", image.height, default.image_size[1], 1 << 14)?,
        ],
        samples: count("image.samples", image.samples, default.samples, 4096)?,
        exposure,
        map: shadow.map.as_ref().map(|name| name.parse()).transpose()?,
        map_size: count("shadow.size", shadow.size, default.map_size, 1 << 13)?,
        quality,
        steps: count("shadow.steps", shadow.steps, default.steps, 1 << 20)?,
        view_steps: shadow
            .view_steps
            .map(|n| count("shadow.view_steps", Some(n), 1, 1 << 20))
            .transpose()?,
        thresholds,
        crossing: named(shadow.crossing.as_ref(), default.crossing)?,
        lookup: named(shadow.lookup.as_ref(), default.lookup)?,
        filter: named(shadow.filter.as_ref(), default.filter)?,
        slices: named(shadow.slices.as_ref(), default.slices)?,
        tolerance: share("shadow.tolerance", shadow.tolerance, default.tolerance)?,
        truncation: share("shadow.truncation", shadow.truncation, default.truncation)?,
        bias,
        links: shadow.links.unwrap_or(default.links),
        memory: shadow.memory.unwrap_or(default.memory),
        shading: named(shadow.shading.as_ref(), default.shading)?,
        light_samples: count(
            "shadow.light_samples",
            shadow.light_samples,
            default.light_samples,
            1 << 16,
        )?,
        octaves: match shadow.octaves {
            Some(0) => 0,
            given => count("shadow.octaves", given, default.octaves, 16)?,
        },
    })
}

pub(super) fn named<T: std::str::FromStr<Err = Error>>(given: Option<&String>, or: T) -> Result<T> {
    given.map_or(Ok(or), |name| name.parse())
}
