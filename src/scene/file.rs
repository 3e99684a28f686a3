//! Scene files: what a user wrote, not yet what it means. Every key is optional here; what is left
//! out is chosen by `automatic`. Reads no volume: paths are only names here.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Tables;
use crate::error::{Error, Result};

/// Declares tables whose keys are all optional and where an unknown key is an error.
macro_rules! tables {
    ($($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $key:ident: $type:ty,)* })*) => {
        $($(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[allow(missing_docs)]
        pub struct $name { $($(#[$attribute])* pub $key: Option<$type>,)* })*
    };
}

/// A whole scene file (TOML), or what the command line says of a scene.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct SceneFile {
    /// `[volume]`, or `[[volume]]` for several; none for a scene without.
    pub volume: Tables<VolumeTable>,
    /// `[light]`, or `[[light]]` for several; none for one of which nothing is said.
    pub light: Tables<LightTable>,
    pub ambient: RadianceTable,
    pub camera: CameraTable,
    pub image: ImageTable,
    pub shadow: ShadowTable,
    pub ground: GroundTable,
    pub background: RadianceTable,
}

tables! {
    /// `[volume]`
    VolumeTable {
        path: PathBuf,
        from: String,
        preset: String,
        grid: String,
        max_bytes: u64,
        density_scale: f64,
        albedo: [f64; 3],
        phase_g: f64,
        bounds: [[f64; 3]; 2],
        dims: [usize; 3],
        #[serde(rename = "type")] value_type: String,
        endian: String,
        spacing: [f64; 3],
        window: [f32; 2],
        up: String,
        class: String,
        translate: [f64; 3],
        rotate_degrees: [f64; 3],
        scale: f64,
        tint: [f64; 3],
        color: String,
        transfer: TransferTable,
        emission: EmissionTable,
    }
    /// `[volume.transfer]`: points are (value, red, green, blue, opacity), colours linear in 0..1;
    /// gradient is (length of the density's gradient, factor on opacity).
    TransferTable {
        name: String,
        file: PathBuf,
        points: Vec<[f64; 5]>,
        range: TransferRange,
        gradient: Vec<[f64; 2]>,
    }
    /// `[volume.emission]`: of a grid, or of the densities themselves.
    EmissionTable {
        grid: String,
        colors: String,
        range: [f64; 2],
        kelvin: [f64; 2],
        scale: f64,
    }
    /// `[light]`
    LightTable {
        kind: String,
        direction: [f64; 3],
        position: [f64; 3],
        irradiance: [f64; 3],
        cone_degrees: f64,
        cone_softness: f64,
    }
    /// `[ambient]` and `[background]`
    RadianceTable { radiance: [f64; 3], }
    /// `[camera]`
    CameraTable {
        kind: String,
        height: f64,
        position: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        fov_y_degrees: f64,
    }
    /// `[image]`
    ImageTable { width: u32, height: u32, samples: u32, exposure: f64, }
    /// `[shadow]`
    ShadowTable {
        map: String,
        size: u32,
        quality: f64,
        steps: u32,
        view_steps: u32,
        thresholds: [f64; 3],
        crossing: String,
        lookup: String,
        filter: String,
        slices: String,
        tolerance: f64,
        truncation: f64,
        bias: f64,
        links: bool,
        memory: u64,
        shading: String,
        light_samples: u32,
        octaves: u32,
    }
    /// `[ground]`
    GroundTable { enabled: bool, height: f64, albedo: f64, half_extent: f64, }
}

/// What values a transfer function is spread over.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "range: neither two numbers nor \"data\"")]
pub enum TransferRange {
    /// These.
    Values([f64; 2]),
    /// Those of the volume.
    Word(RangeWord),
}

/// A range that is no pair of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RangeWord {
    /// All values that the volume holds, but for a few that stand apart.
    Data,
}

impl SceneFile {
    /// Parses the text of the scene file `path`; paths become relative to its folder.
    ///
    /// # Errors
    /// With the line and the key, if the text is no TOML or has a key that scenes do not have.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let mut file: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| {
                1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count()
            });
            Error::contents(path, format!("line {line}: {}", error.message().replace('\n', " ")))
        })?;
        if let Some(folder) = path.parent() {
            for volume in file.volume.iter_mut() {
                let transfer = volume.transfer.as_mut().and_then(|table| table.file.as_mut());
                for name in volume.path.as_mut().into_iter().chain(transfer) {
                    *name = folder.join(&*name);
                }
            }
        }
        Ok(file)
    }
}
