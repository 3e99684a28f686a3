//! Settings from a scene file. `settings` knows their ranges.

use super::file::{SceneFile, ShadowTable};
use crate::error::{Error, Result};
use crate::image::Exposure;
use crate::settings::{
    FragmentSettings, ImageSettings, MapKind, MapSettings, Settings, ThresholdSettings,
    ViewSettings,
};

/// Fields of [`Settings`] whose keys in a scene file have other names.
const KEYS: [(&str, &str); 14] = [
    ("image.size[0]", "image.width"),
    ("image.size[1]", "image.height"),
    ("view.steps", "shadow.view_steps"),
    ("view.light_samples", "shadow.light_samples"),
    ("view.octaves", "shadow.octaves"),
    ("view.bias", "shadow.bias"),
    ("quality", "shadow.quality"),
    ("map.size", "shadow.size"),
    ("map.steps", "shadow.steps"),
    ("map.kind", "shadow.map"),
    ("map.threshold.levels", "shadow.thresholds"),
    ("map.fragments.tolerance", "shadow.tolerance"),
    ("map.fragments.truncation", "shadow.truncation"),
    ("map.fragments.memory", "shadow.memory"),
];

/// The settings that `file` specifies, with defaults for the rest.
pub(super) fn settings(file: &SceneFile) -> Result<Settings> {
    let default = Settings::default();
    let (image, shadow) = (&file.image, &file.shadow);
    let (threshold, fragments) = (default.map.threshold, default.map.fragments);
    let [width, height] = default.image.size;
    image.tone_map()?;
    let settings = Settings {
        image: ImageSettings {
            size: [image.width.unwrap_or(width), image.height.unwrap_or(height)],
            samples: image.samples.unwrap_or(default.image.samples),
            tolerance: image.tolerance.unwrap_or(default.image.tolerance),
            exposure: match image.exposure()? {
                Exposure::Factor(factor) => factor,
                Exposure::Auto => default.image.exposure,
            },
        },
        view: ViewSettings {
            steps: shadow.view_steps.or(default.view.steps),
            shading: named(shadow.shading.as_ref(), default.view.shading)?,
            light_samples: shadow.light_samples.unwrap_or(default.view.light_samples),
            octaves: shadow.octaves.unwrap_or(default.view.octaves),
            bias: shadow.bias.unwrap_or(default.view.bias),
        },
        map: MapSettings {
            kind: kind(shadow)?,
            size: shadow.size.unwrap_or(default.map.size),
            steps: shadow.steps.unwrap_or(default.map.steps),
            filter: named(shadow.filter.as_ref(), default.map.filter)?,
            threshold: ThresholdSettings {
                levels: shadow.thresholds.unwrap_or(threshold.levels),
                crossing: named(shadow.crossing.as_ref(), threshold.crossing)?,
                lookup: named(shadow.lookup.as_ref(), threshold.lookup)?,
            },
            fragments: FragmentSettings {
                slices: named(shadow.slices.as_ref(), fragments.slices)?,
                tolerance: shadow.tolerance.unwrap_or(fragments.tolerance),
                truncation: shadow.truncation.unwrap_or(fragments.truncation),
                links: shadow.links.or(fragments.links),
                coverage: shadow.coverage.unwrap_or(fragments.coverage),
                memory: shadow.memory.unwrap_or(fragments.memory),
            },
        },
        quality: shadow.quality.unwrap_or(default.quality),
    };
    match settings.fault() {
        None => Ok(settings),
        Some((field, why)) => {
            let key = KEYS.iter().find(|(known, _)| *known == field).map_or(field, |(_, key)| *key);
            Err(Error::value(key, why))
        }
    }
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
        ("coverage", shadow.coverage.is_some(), &[fragments, MapKind::Visibility]),
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
            ("size = 9000", "shadow.size: 9000 is not between 1 and 8192"),
            ("quality = nan", "shadow.quality: NaN is not between 0.125 and 64"),
            ("view_steps = 0", "shadow.view_steps: 0 is not between 1 and 1048576"),
            ("octaves = 99", "shadow.octaves: 99 is not between 0 and 16"),
            ("tolerance = 0.6", "shadow.tolerance: 0.6 is not between 0 and 0.5"),
            (
                "thresholds = [0.5, 0.4, 0.9]",
                "shadow.thresholds: 0.5, 0.4, 0.9 are not in increasing order between 0 and 1",
            ),
            ("memory = 1", "shadow.memory: fewer than 1048576 bytes cannot hold a row of lists"),
        ] {
            assert_eq!(asked(shadow).unwrap_err().to_string(), expected);
        }
    }
}
