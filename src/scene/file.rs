//! Scene files as a user wrote them, before they are interpreted. Every key is optional;
//! `automatic` chooses what is left out. Reads no volume: paths are only names here.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Tables;
use crate::error::{Error, Result};

/// Declares tables in which all keys are optional and unknown keys are errors.
macro_rules! tables {
    ($($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $key:ident: $type:ty,)* })*) => {
        $($(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[allow(missing_docs)]
        pub struct $name { $($(#[$attribute])* pub $key: Option<$type>,)* })*
    };
}

/// A whole scene file (TOML), or what the command line specifies of a scene. The README's section
/// "Scene files" lists all keys with their units and defaults.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct SceneFile {
    /// `[volume]`, or `[[volume]]` for several; empty for a scene without volumes.
    pub volume: Tables<VolumeTable>,
    /// `[light]`, or `[[light]]` for several; if empty, one light is chosen.
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
    /// `[volume.transfer]`. Points are (value, red, green, blue, opacity), with linear colours in
    /// 0..1. Gradient entries are (length of the density's gradient, factor on opacity).
    TransferTable {
        name: String,
        file: PathBuf,
        points: Vec<[f64; 5]>,
        range: TransferRange,
        gradient: Vec<[f64; 2]>,
    }
    /// `[volume.emission]`: emission over a grid, or over the densities themselves.
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

/// The range of values over which a transfer function is spread.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "range: neither two numbers nor \"data\"")]
pub enum TransferRange {
    /// A range from low to high.
    Values([f64; 2]),
    /// A range that depends on the volume.
    Word(RangeWord),
}

/// Names of ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RangeWord {
    /// `"data"`: all values that the volume holds, without a few outliers.
    Data,
}

impl SceneFile {
    /// Parses the text of the scene file `path`. Paths in it become relative to its folder.
    ///
    /// # Errors
    /// With the line and the key, if the text is not TOML or has an unknown key.
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
