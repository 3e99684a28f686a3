//! Decides whether an error is a mistake on the command line. Knows no command.

use clap::ArgMatches;
use clap::parser::ValueSource;

use crate::error::{Error, ErrorKind};

/// Options by the names that the library has for their values, where the names differ by more than
/// the table in front of them and underscores.
const NAMES: [(&str, &str); 20] = [
    ("image.tolerance", "picture-tolerance"),
    ("transfer function", "transfer"),
    ("light.direction", "light"),
    ("light.irradiance", "light-color"),
    ("camera.position", "camera"),
    ("camera.target", "target"),
    ("camera.up", "up-vector"),
    ("camera.fov_y_degrees", "fov"),
    ("camera.azimuth_degrees", "azimuth"),
    ("elevation_degrees", "elevation"),
    ("camera.elevation_degrees", "elevation"),
    ("ground.height", "ground"),
    ("background.radiance", "background"),
    ("volume.phase_g", "phase"),
    ("volume.emission.radiance", "emission-radiance"),
    ("volume.transfer.range", "transfer-range"),
    ("volume.transfer.file", "transfer"),
    ("shadow.size", "map-size"),
    ("image.width", "size"),
    ("image.height", "size"),
];

/// Options with goals: that one cannot be reached with this input, or on this machine, is found by
/// working.
const GOALS: [&str; 6] =
    ["max-picture-error", "time", "max-error", "max-map-bytes", "depth", "threads"];

/// The options that a command line gives.
pub(super) struct Given(Vec<String>);

impl Given {
    /// The options in `matches`, which may be of a command.
    pub(super) fn of(matches: &ArgMatches) -> Self {
        let matches = matches.subcommand().map_or(matches, |(_, matches)| matches);
        let given = |id: &str| matches.value_source(id) != Some(ValueSource::DefaultValue);
        let ids = matches.ids().map(clap::Id::as_str).filter(|id| given(id));
        Self(ids.map(|id| id.replace('_', "-").replace("value-type", "type")).collect())
    }

    /// Whether `error` is about the value of one of the options. Errors about values that stand in
    /// a file, or about anything else, are not.
    pub(super) fn is_to_blame(&self, error: &Error) -> bool {
        let ErrorKind::Value { what, .. } = error.kind() else { return false };
        what.split(" or ").any(|key| {
            let key = key.trim_matches('`');
            let known = NAMES.iter().find(|(name, _)| *name == key);
            let option = known.map_or_else(
                || key.rsplit('.').next().unwrap_or(key).replace('_', "-"),
                |(_, option)| (*option).to_owned(),
            );
            !GOALS.contains(&&*option) && self.0.contains(&option)
        })
    }
}
