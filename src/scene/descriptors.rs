//! The presets' scene files, `volumes/*.toml`, compiled into the program.

use std::path::Path;

use super::SceneFile;
use crate::error::Result;
use crate::volume::presets::Preset;

/// The scene file of a preset.
///
/// # Errors
/// If the file in `volumes/` is not a scene file.
pub fn descriptor(preset: Preset) -> Result<SceneFile> {
    let text = match preset {
        Preset::Box => include_str!("../../volumes/box.toml"),
        Preset::Bucky => include_str!("../../volumes/bucky.toml"),
        Preset::Rods => include_str!("../../volumes/rods.toml"),
        Preset::Clouds => include_str!("../../volumes/clouds.toml"),
    };
    SceneFile::parse(text, Path::new(preset.name()))
}
