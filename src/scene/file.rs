//! Scene files as a user wrote them, before they are interpreted. Every key is optional;
//! `automatic` chooses what is left out. Reads no volume: paths are only names here.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Tables;
use super::automatic::Surroundings;
use super::keyframes::{CameraKeyframe, LightKeyframe, VolumeKeyframe};
pub use super::surface_tables::SurfaceTable;
use crate::error::{Error, Result};
use crate::image::{Exposure, ToneMap};

/// Declares tables in which all keys are optional and unknown keys are errors.
macro_rules! tables {
    ($($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $key:ident: $type:ty,)* })*) => {
        $($(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
        #[serde(default, deny_unknown_fields)]
        #[allow(missing_docs)]
        pub struct $name {
            $(#[serde(skip_serializing_if = "Option::is_none")]
            $(#[$attribute])* pub $key: Option<$type>,)*
        })*
    };
}
pub(super) use tables;

/// Whether a table says nothing, so that it need not be written.
fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

/// A whole scene file (TOML), or what the command line specifies of a scene. The README's section
/// "Scene files" shows the common keys; the tables here hold all of them. A key that is left out
/// has the default that its field states, else it is chosen for the volume at hand
/// ([`super::automatic`]).
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)]
pub struct SceneFile {
    /// What surrounds everything where that is left out: `studio` or `void`; by default `void` if the
    /// file has absolute numbers, else `studio`.
    #[serde(skip_serializing_if = "is_default")]
    pub surroundings: Option<Surroundings>,
    /// `[volume]`, or `[[volume]]` for several; empty for a scene without volumes.
    #[serde(skip_serializing_if = "is_default")]
    pub volume: Tables<VolumeTable>,
    /// `[mesh]`, or `[[mesh]]` for several.
    #[serde(skip_serializing_if = "is_default")]
    pub mesh: Tables<SurfaceTable>,
    /// `[hair]`, or `[[hair]]` for several.
    #[serde(skip_serializing_if = "is_default")]
    pub hair: Tables<SurfaceTable>,
    /// `[light]`, or `[[light]]` for several; if empty, one light is chosen.
    #[serde(skip_serializing_if = "is_default")]
    pub light: Tables<LightTable>,
    /// `[ambient]`: radiance from all directions, without shadow. None in scene files by default.
    #[serde(skip_serializing_if = "is_default")]
    pub ambient: RadianceTable,
    /// `[camera]`
    #[serde(skip_serializing_if = "is_default")]
    pub camera: CameraTable,
    /// `[image]`
    #[serde(skip_serializing_if = "is_default")]
    pub image: ImageTable,
    /// `[shadow]`
    #[serde(skip_serializing_if = "is_default")]
    pub shadow: ShadowTable,
    /// `[ground]`
    #[serde(skip_serializing_if = "is_default")]
    pub ground: GroundTable,
    /// `[background]`: radiance behind everything. Opaque black in scene files by default.
    #[serde(skip_serializing_if = "is_default")]
    pub background: RadianceTable,
}

tables! {
    /// `[volume]`
    VolumeTable {
        /// Volume file. `#` or `%04d` in its name stands for the number of a frame.
        path: PathBuf,
        /// Name of the file's format, in place of the one that its first bytes tell.
        from: String,
        /// Name of a preset, instead of `path`.
        preset: String,
        /// Grid of an OpenVDB file, by default `density`, else the first of numbers; or array of a
        /// VTK file.
        grid: String,
        /// Largest number of bytes for voxels in memory; 4 GiB by default.
        max_bytes: u64,
        /// Extinction per unit of density, 1 / world length.
        density_scale: f64,
        /// Scattering albedo, linear RGB, 0..1; white by default.
        albedo: [f64; 3],
        /// Henyey and Greenstein's g, -1 < g < 1; 0 by default.
        phase_g: f64,
        /// World box (lowest and highest corner) that the voxels of a dense volume fill.
        bounds: [[f64; 3]; 2],
        /// The part that is kept, in shares (0..1) of the volume's extent along the x, y and z of
        /// its voxels: lowest and highest corner.
        clip: [[f64; 3]; 2],
        /// Voxel counts of a raw file along x, y, z.
        dims: [usize; 3],
        /// The key `type`: number type of a raw file, such as `u8`.
        #[serde(rename = "type")] value_type: String,
        /// Byte order of a raw file: `little` (the default) or `big`.
        endian: String,
        /// World lengths of a voxel along x, y, z, in place of the file's.
        spacing: [f64; 3],
        /// Stored values that become densities 0 and 1.
        window: [f32; 2],
        /// Axis of the file that points up, such as `z` or `-y`; by default what the file says,
        /// else `y`.
        up: String,
        /// Meaning of the numbers, in place of the file's: `level-set` or `fog`.
        class: String,
        /// Translation in world lengths, after `rotate_degrees` and `scale`.
        translate: [f64; 3],
        /// Angles in degrees about the world's x, y and z axes, in this order.
        rotate_degrees: [f64; 3],
        /// Scaling about the world's origin, above 0; 1 by default.
        scale: f64,
        /// Factor on the extinction of red, green and blue; 1 each by default.
        tint: [f64; 3],
        /// Grid of vectors in the same file, a factor on the albedo.
        color: String,
        /// `[volume.transfer]`
        transfer: TransferTable,
        /// `[volume.emission]`
        emission: EmissionTable,
        /// Values at numbered frames.
        keyframes: Vec<VolumeKeyframe>,
    }
    /// `[volume.transfer]`. Points are (value, red, green, blue, opacity), with linear colours in
    /// 0..1. Gradient entries are (length of the density's gradient, factor on opacity).
    TransferTable {
        /// Name of a preset, or `auto`.
        name: String,
        /// File with a colour map of ParaView or a list of points.
        file: PathBuf,
        /// Points of the function, by rising value.
        points: Vec<[f64; 5]>,
        /// Values at which the function begins and ends.
        range: TransferRange,
        /// Factors on opacity over the gradient's length, relative to the steepest, 0..1.
        gradient: Vec<[f64; 2]>,
    }
    /// `[volume.emission]`: emission over a grid, or over the densities themselves.
    EmissionTable {
        /// Grid in the same file; if absent, the densities.
        grid: String,
        /// `blackbody` (the default), or the name of a transfer function.
        colors: String,
        /// Values at which the colours begin and end; 0 and the largest value by default.
        range: [f64; 2],
        /// Temperatures at the ends of `range`, for `blackbody`.
        kelvin: [f64; 2],
        /// Radiance of the fuller columns of what glows, roughly; 0.6 by default. A fully lit white
        /// medium has 1 under the usual light.
        radiance: f64,
        /// Radiance per world length where colour and opacity are 1, in place of `radiance`.
        scale: f64,
    }
    /// `[light]`
    LightTable {
        /// `directional`, `point` or `spot`; by default a spot with `cone_degrees`, a point with a
        /// `position` and no `direction`, else directional.
        kind: String,
        /// Direction in which the light travels; of any length but zero.
        direction: [f64; 3],
        /// World position of a point or spot light.
        position: [f64; 3],
        /// Irradiance, linear RGB, on a plane that faces the light; with a position at distance 1.
        /// By default 4 pi (directional), under which a fully lit white medium has radiance 1, or
        /// as much as gives that in the middle of the volume (with a position).
        irradiance: [f64; 3],
        /// Angle in degrees between a spot light's axis and its edge, above 0 and below 90; 30 by
        /// default.
        cone_degrees: f64,
        /// Share of that angle over which the light fades, 0..1; 0.2 by default.
        cone_softness: f64,
        /// Values at numbered frames.
        keyframes: Vec<LightKeyframe>,
    }
    /// `[ambient]` and `[background]`: radiance, linear RGB.
    RadianceTable { radiance: [f64; 3], }
    /// `[camera]`
    CameraTable {
        /// `perspective` (the default) or `orthographic`.
        kind: String,
        /// World lengths between upper and lower edge, for `orthographic`.
        height: f64,
        /// World position of the camera.
        position: [f64; 3],
        /// World position in the middle of the picture.
        target: [f64; 3],
        /// Direction that is up in the picture; y by default.
        up: [f64; 3],
        /// Angle in degrees between upper and lower edge, for `perspective`, above 0 and below 179;
        /// 32 by default.
        fov_y_degrees: f64,
        /// Where the camera stands, seen from what it looks at, if no position says so: degrees
        /// around the vertical from +z towards +x...
        azimuth_degrees: f64,
        /// ...and degrees above the horizon, -90 to 90...
        elevation_degrees: f64,
        /// ...at this distance from it in world lengths; as far as the framed view is by default.
        distance: f64,
        /// What a chosen view contains: `shadow` (the volume and its shadow, the default) or
        /// `volume`.
        fit: String,
        /// Factor by which what is seen appears larger than it does in the framed or given view,
        /// above 0.
        zoom: f64,
        /// Values at numbered frames.
        keyframes: Vec<CameraKeyframe>,
    }
    /// `[image]`: width and height in pixels, camera rays per pixel, the error that pixels may have
    /// that are not marched, and how radiance is encoded for screens.
    /// [`crate::settings::ImageSettings`] states ranges and defaults.
    ImageTable {
        width: u32,
        height: u32,
        samples: u32,
        tolerance: f64,
        /// Factor on radiance, or stops such as `"+1.5ev"`, or `"auto"`.
        exposure: ExposureValue,
        /// Name of a tone curve ([`ToneMap`]); by default `none`, or `agx` for a picture of which
        /// a screen would lose detail.
        tonemap: String,
    }
    /// `[shadow]`: how shadow maps are built and read, and how the picture is shaded.
    /// [`crate::settings`] explains the values, and states ranges and defaults.
    ShadowTable {
        /// Kind of map.
        map: String,
        /// Texels along each edge of the map.
        size: u32,
        /// How much finer steps, slabs and tolerances are than usual.
        quality: f64,
        /// Largest number of steps along a light ray.
        steps: u32,
        /// Largest number of steps along a camera ray.
        view_steps: u32,
        /// Opacities whose depths a threshold map keeps.
        thresholds: [f64; 3],
        /// Where in a step a threshold counts as crossed.
        crossing: String,
        /// How a threshold map is read.
        lookup: String,
        /// How texels are combined.
        filter: String,
        /// How the volume is cut into the slabs of a fragment map.
        slices: String,
        /// Largest error of transmittance of fitted lists.
        tolerance: f64,
        /// Distance from the final transmittance at which raw lists end.
        truncation: f64,
        /// How much nearer to the light surfaces are looked up, world lengths.
        bias: f64,
        /// Whether wide filters follow links between texels.
        links: bool,
        /// Whether a strand shadows by the share of a texel that it covers; yes by default.
        coverage: bool,
        /// Largest number of bytes of lists while a map is built.
        memory: u64,
        /// How shadow becomes colour.
        shading: String,
        /// Lookups along a camera ray with the paper's shading.
        light_samples: u32,
        /// Octaves that imitate multiple scattering.
        octaves: u32,
    }
    /// `[ground]`: whether there is one (yes by default), its height (world y; that of the volume's
    /// lowest visible point by default), its albedo (0..1; in scene files 0.18 by default), and half of its edge
    /// length in world lengths (endless if absent).
    GroundTable { enabled: bool, height: f64, albedo: f64, half_extent: f64, }
}

/// An exposure: a factor, or a text that [`Exposure`] parses.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "exposure: expected a number, stops as \"+1.5ev\", or \"auto\"")]
#[allow(missing_docs)]
pub enum ExposureValue {
    Factor(f64),
    Text(String),
}

impl ImageTable {
    /// The exposure; 1 by default.
    ///
    /// # Errors
    /// If it is a text with no meaning.
    pub fn exposure(&self) -> Result<Exposure> {
        match &self.exposure {
            None => Ok(Exposure::default()),
            Some(ExposureValue::Factor(factor)) => Ok(Exposure::Factor(*factor)),
            Some(ExposureValue::Text(text)) => text.parse(),
        }
    }

    /// The tone curve; `None` if it is to be chosen.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn tone_map(&self) -> Result<Option<ToneMap>> {
        self.tonemap.as_deref().map(str::parse).transpose()
    }
}

/// The range of values over which a transfer function is spread.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "range: expected two numbers or \"data\"")]
pub enum TransferRange {
    /// A range from low to high.
    Values([f64; 2]),
    /// A range that depends on the volume.
    Word(RangeWord),
}

/// Names of ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
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
            for name in file.surfaces_mut().filter_map(|table| table.path.as_mut()) {
                *name = folder.join(&*name);
            }
        }
        Ok(file)
    }
}
