//! The presets' scene files, `volumes/*.toml`, compiled into the program.

use std::path::Path;

use super::SceneFile;
use super::file::VolumeTable;
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

impl VolumeTable {
    /// Takes from the scene file of the table's preset what the table leaves out, such as the axis
    /// that is up. Returns what was taken, as text; `None` for nothing.
    ///
    /// # Errors
    /// If there is no preset of that name.
    pub fn take_presets(&mut self) -> Result<Option<String>> {
        let Some(preset) = &self.preset else { return Ok(None) };
        let preset: Preset = preset.parse()?;
        let of_preset = descriptor(preset)?;
        let mut taken = Vec::new();
        for own in of_preset.volume.iter() {
            if self.up.is_none()
                && let Some(up) = &own.up
            {
                taken.push(format!("up (`volume.up`) {up}"));
                self.up = Some(up.clone());
            }
            if self.density_scale.is_none()
                && self.transfer.is_none()
                && let Some(scale) = own.density_scale
            {
                taken.push(format!("density scale (`volume.density_scale`) {scale}"));
                self.density_scale = Some(scale);
            }
        }
        Ok((!taken.is_empty()).then(|| taken.join(", ")))
    }
}
