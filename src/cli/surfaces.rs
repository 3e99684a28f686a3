//! Options for meshes and hair.

use clap::Args;

use super::arguments::{SourceArguments, above_0, overlay};
use crate::error::{Error, Result};
use crate::io::ReadOptions;
use crate::scene::SceneFile;
use crate::scene::file::VolumeTable;

#[derive(Debug, Args)]
pub(super) struct SurfaceArguments {
    /// Share of light that one crossing of a mesh or a strand takes, 0..1 [the file's].
    #[arg(long, value_name = "X", value_parser = share, allow_negative_numbers = true, help_heading = "Meshes and hair")]
    opacity: Option<f64>,
    /// Diameter of strands in the file's lengths [the file's].
    #[arg(long, value_name = "X", value_parser = above_0, allow_negative_numbers = true, help_heading = "Meshes and hair")]
    thickness: Option<f64>,
}

impl SurfaceArguments {
    /// Writes the given options into `file`, and the axis `up`.
    pub(super) fn overlay(&self, file: &mut SceneFile, up: Option<&String>) {
        for surface in file.surfaces_mut() {
            overlay! {
                surface.opacity => self.opacity,
                surface.up => up.cloned(),
            }
        }
        for hair in file.hair.iter_mut() {
            overlay! { hair.thickness => self.thickness, }
        }
    }
}

/// Parses a number of 0..1.
fn share(text: &str) -> Result<f64, String> {
    let x: f64 = text.parse().map_err(|_| format!("'{text}' is not a number"))?;
    if (0.0..=1.0).contains(&x) { Ok(x) } else { Err(format!("{x} is not in 0..1")) }
}

/// Checks that options apply to what there is in `file`.
///
/// # Errors
/// With the name of one that does not.
pub(super) fn check(source: &SourceArguments, file: &SceneFile) -> Result<()> {
    let refused = |what: &str, there: &str| {
        Err(Error::value(what, format!("does not apply: there is no {there}")))
    };
    let SurfaceArguments { opacity, thickness } = source.surfaces;
    if opacity.is_some() && !file.has_surfaces() {
        return refused("opacity", "mesh and no hair");
    }
    if thickness.is_some() && file.hair.is_empty() {
        return refused("thickness", "hair");
    }
    if !file.volume.is_empty() || file.is_bare() {
        return Ok(());
    }
    let of_volumes: [(&str, bool); 6] = [
        ("window", source.window.is_some()),
        ("clip", source.clip.is_some()),
        ("density-scale", source.density_scale.is_some()),
        ("transfer", source.transfer.is_some()),
        ("transfer-range", source.transfer_range.is_some()),
        ("emission", source.emission.is_some() || source.emission_radiance.is_some()),
    ];
    if let Some((what, _)) = of_volumes.iter().find(|(_, given)| *given) {
        return refused(what, "volume");
    }
    let mut table = VolumeTable::default();
    source.file.overlay(&mut table);
    let keys = ["dims", "type", "endian", "spacing", "grid", "from", "class"];
    ReadOptions::of(&table)?.refuse("meshes and hair", &keys)
}
