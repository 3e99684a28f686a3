//! Settings from a scene file, with checks.

use super::file::{SceneFile, ShadowTable};
use crate::error::{Error, Result};
use crate::settings::{
    FragmentSettings, ImageSettings, MapKind, MapSettings, Settings, ThresholdSettings,
    ViewSettings,
};

/// The smallest allowed memory for lists, in bytes; nothing can be built with less.
const LEAST_MEMORY: u64 = 1 << 20;

/// The allowed qualities; f32 cannot resolve the steps of higher ones.
const QUALITIES: std::ops::RangeInclusive<f64> = 0.125..=64.0;

/// The settings that `file` specifies, with defaults for the rest.
pub(super) fn settings(file: &SceneFile) -> Result<Settings> {
    let default = Settings::default();
    let (image, shadow) = (&file.image, &file.shadow);
    let count = |what: &str, given: Option<u32>, or: u32, most: u32| match given {
        Some(n) if n == 0 || n > most => {
            Err(Error::value(what, format!("{n} is not between 1 and {most}")))
        }
        given => Ok(given.unwrap_or(or)),
    };
    let exposure = image.exposure.unwrap_or(default.image.exposure);
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(Error::value("image.exposure", format!("{exposure} is not above 0")));
    }
    let levels = shadow.thresholds.unwrap_or(default.map.threshold.levels);
    let [low, middle, high] = levels;
    // Compared as f32, like the maps do: 1 - 1e-6 is far enough from 1.
    if !(low >= 1e-6 && low + 1e-6 < middle && middle + 1e-6 < high && high <= 1.0 - 1e-6) {
        let why = format!("{low}, {middle}, {high} are not in increasing order between 0 and 1");
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
    let bias = shadow.bias.unwrap_or(default.view.bias);
    if !(bias >= 0.0 && bias.is_finite()) {
        return Err(Error::value("shadow.bias", format!("{bias} is not a length of at least 0")));
    }
    if shadow.memory.is_some_and(|bytes| bytes < LEAST_MEMORY) {
        let why = format!("fewer than {LEAST_MEMORY} bytes cannot hold a row of lists");
        return Err(Error::value("shadow.memory", why));
    }
    let (threshold, fragments) = (default.map.threshold, default.map.fragments);
    Ok(Settings {
        image: ImageSettings {
            size: [
                count("image.width", image.width, default.image.size[0], 1 << 14)?,
                count("image.height", image.height, default.image.size[1], 1 << 14)?,
            ],
            samples: count("image.samples", image.samples, default.image.samples, 4096)?,
            exposure,
        },
        view: ViewSettings {
            steps: shadow
                .view_steps
                .map(|n| count("shadow.view_steps", Some(n), 1, 1 << 20))
                .transpose()?,
            shading: named(shadow.shading.as_ref(), default.view.shading)?,
            light_samples: count(
                "shadow.light_samples",
                shadow.light_samples,
                default.view.light_samples,
                1 << 16,
            )?,
            octaves: match shadow.octaves {
                Some(0) => 0,
                given => count("shadow.octaves", given, default.view.octaves, 16)?,
            },
            bias,
        },
        map: MapSettings {
            kind: kind(shadow)?,
            size: count("shadow.size", shadow.size, default.map.size, 1 << 13)?,
            steps: count("shadow.steps", shadow.steps, default.map.steps, 1 << 20)?,
            filter: named(shadow.filter.as_ref(), default.map.filter)?,
            threshold: ThresholdSettings {
                levels,
                crossing: named(shadow.crossing.as_ref(), threshold.crossing)?,
                lookup: named(shadow.lookup.as_ref(), threshold.lookup)?,
            },
            fragments: FragmentSettings {
                slices: named(shadow.slices.as_ref(), fragments.slices)?,
                tolerance: share("shadow.tolerance", shadow.tolerance, fragments.tolerance)?,
                truncation: share("shadow.truncation", shadow.truncation, fragments.truncation)?,
                links: shadow.links.unwrap_or(fragments.links),
                memory: shadow.memory.unwrap_or(fragments.memory),
            },
        },
        quality,
    })
}

/// The kind of map: the one that is named, else the one that the other keys belong to.
///
/// # Errors
/// If a key is given that means nothing for that kind.
fn kind(shadow: &ShadowTable) -> Result<Option<MapKind>> {
    let (threshold, fragments) = (MapKind::Threshold, MapKind::Fragments);
    let given = [
        ("thresholds", shadow.thresholds.is_some(), &[threshold][..]),
        ("crossing", shadow.crossing.is_some(), &[threshold]),
        ("lookup", shadow.lookup.is_some(), &[threshold]),
        ("tolerance", shadow.tolerance.is_some(), &[fragments, MapKind::Visibility]),
        ("truncation", shadow.truncation.is_some(), &[fragments]),
        ("slices", shadow.slices.is_some(), &[fragments]),
        ("links", shadow.links.is_some(), &[fragments]),
    ];
    let mut kind: Option<MapKind> = shadow.map.as_ref().map(|name| name.parse()).transpose()?;
    for (key, _, kinds) in given.iter().filter(|(_, given, _)| *given) {
        let kind = *kind.get_or_insert(kinds[0]);
        if !kinds.contains(&kind) {
            let why = format!("does not apply to '{kind}' maps");
            return Err(Error::value(format!("shadow.{key}"), why));
        }
    }
    Ok(kind)
}

pub(super) fn named<T: std::str::FromStr<Err = Error>>(given: Option<&String>, or: T) -> Result<T> {
    given.map_or(Ok(or), |name| name.parse())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn asked(shadow: &str) -> Result<Settings> {
        let text = format!("[shadow]\n{shadow}\n");
        settings(&SceneFile::parse(&text, "x.toml".as_ref()).unwrap())
    }

    #[test]
    fn what_is_asked_of_a_kind_of_map_asks_for_it() {
        let kind = |shadow: &str| asked(shadow).unwrap().map.kind;
        assert_eq!(kind(""), None);
        assert_eq!(kind("lookup = 'paper'"), Some(MapKind::Threshold));
        assert_eq!(kind("tolerance = 0.01"), Some(MapKind::Fragments));
        assert_eq!(kind("map = 'visibility'\ntolerance = 0.01"), Some(MapKind::Visibility));
        assert_eq!(asked("tolerance = 0.01").unwrap().map.fragments.tolerance, 0.01);
    }

    #[test]
    fn what_means_nothing_for_a_kind_of_map_is_an_error_that_names_it() {
        for (shadow, expected) in [
            (
                "map = 'threshold'\ntolerance = 0.01",
                "shadow.tolerance: does not apply to 'threshold' maps",
            ),
            (
                "map = 'fragments'\nlookup = 'paper'",
                "shadow.lookup: does not apply to 'fragments' maps",
            ),
            (
                "crossing = 'bucket'\nlinks = false",
                "shadow.links: does not apply to 'threshold' maps",
            ),
            ("bias = -1.0", "shadow.bias: -1 is not a length of at least 0"),
        ] {
            assert_eq!(asked(shadow).unwrap_err().to_string(), expected);
        }
    }
}
