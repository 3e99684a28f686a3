//! Parses the command line: options shared by the commands that work on a scene, and their values.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;

use super::backend::BackendChoice;
use super::reading::FileArguments;
use super::stage::StageArguments;
use super::surfaces::SurfaceArguments;
use super::tone::ToneArguments;
use crate::io::number::ValueType;
use crate::scene::file::{EmissionTable, RangeWord, TransferRange, TransferTable};
use crate::scene::{SceneFile, transfer};
use crate::settings::{Crossing, Filter, Lookup, MapKind, Shading, Slices};
use crate::volume::Axis;

/// A scene, as options.
#[derive(Debug, Args)]
pub(super) struct SourceArguments {
    /// Preset (box, bucky, rods, clouds), volume file or scene file (.toml).
    pub input: String,
    /// Threads for the CPU backend; all cores by default.
    #[arg(long, value_name = "N", env = "DEEPSHADOW_THREADS", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,

    #[command(flatten)]
    pub file: FileArguments,
    #[command(flatten)]
    pub surfaces: SurfaceArguments,
    /// Values to map to 0..1, clamped, for scans.
    #[arg(long, value_name = "LO,HI", value_parser = numbers::<f32, 2>, allow_hyphen_values = true, help_heading = "Volume")]
    pub window: Option<Numbers<f32, 2>>,
    /// The part of the volume to keep, in shares (0..1) of its extent along the axes of its voxels:
    /// lowest and highest corner.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = numbers::<f64, 6>, allow_hyphen_values = true, help_heading = "Volume")]
    pub clip: Option<Numbers<f64, 6>>,
    /// Index axis that points up: x, y, z, -x, -y, -z.
    #[arg(long, value_name = "AXIS", value_parser = valid::<Axis>, allow_hyphen_values = true, help_heading = "Volume")]
    pub up: Option<String>,
    /// Extinction per unit of density, 1 / world length.
    #[arg(long, value_name = "X", value_parser = at_least_0, allow_negative_numbers = true, help_heading = "Volume")]
    pub density_scale: Option<f64>,

    #[arg(long, value_name = "NAME|FILE", help = transfer_help(), help_heading = "Volume")]
    pub transfer: Option<String>,
    /// Values that the transfer function spans; data for all values of the volume.
    #[arg(long, value_name = "LO,HI|data", value_parser = transfer_range, allow_negative_numbers = true, help_heading = "Volume")]
    pub transfer_range: Option<TransferRange>,
    /// Grid whose values glow (temperature, flame), or density for the densities themselves.
    #[arg(long, value_name = "GRID", help_heading = "Volume")]
    pub emission: Option<String>,
    /// Radiance of what glows, roughly, where it is densest; a fully lit white medium has 1 [0.6].
    #[arg(long, value_name = "X", value_parser = at_least_0, allow_negative_numbers = true, help_heading = "Volume")]
    pub emission_radiance: Option<f64>,

    /// Direction in which the light travels, or degrees of where it comes from: around the vertical
    /// from +z towards +x, and above the horizon.
    #[arg(long, value_name = "X,Y,Z|AZIMUTH,ELEVATION", value_parser = super::stage::light, allow_hyphen_values = true, help_heading = "Scene")]
    pub light: Option<Numbers<f64, 3>>,
    /// No ground and no background; the file has alpha.
    #[arg(long, help_heading = "Scene")]
    pub transparent: bool,
}

/// A scene and how to compute it, as options.
#[derive(Debug, Args)]
pub(super) struct SceneArguments {
    #[command(flatten)]
    pub source: SourceArguments,
    /// Where to compute: a hardware GPU if there is one, otherwise the CPU (auto); gpu or cpu.
    #[arg(long, default_value = "auto", value_parser = parse::<BackendChoice>)]
    pub backend: BackendChoice,

    #[arg(long, value_name = "KIND", value_parser = valid::<MapKind>, help = map_help(), help_heading = "Shadow map")]
    pub map: Option<String>,
    /// How transmittance is read from the map: default or paper.
    #[arg(long, value_name = "HOW", value_parser = valid::<Lookup>, help_heading = "Shadow map")]
    pub lookup: Option<String>,
    /// How texels are combined: bilinear, nearest, pcf3, pcf5, pcf7, edsm, edsm3, edsm5.
    #[arg(long, value_name = "HOW", value_parser = valid::<Filter>, help_heading = "Shadow map")]
    pub filter: Option<String>,
    /// Where in a step a threshold is crossed: exact, smoothstep (the paper's) or bucket.
    #[arg(long, value_name = "HOW", value_parser = valid::<Crossing>, help_heading = "Shadow map")]
    pub crossing: Option<String>,
    /// Opacities whose depths the map keeps [0.1,0.5,0.9].
    #[arg(long, value_name = "T1,T2,T3", value_parser = numbers::<f64, 3>, help_heading = "Shadow map")]
    pub thresholds: Option<Numbers<f64, 3>>,
    /// Texels along each edge of the map; for pictures by their pixels and the voxels, else 512.
    #[arg(long, value_name = "N", value_parser = count(8192), help_heading = "Shadow map")]
    pub map_size: Option<u32>,
    /// How much finer steps, slabs and tolerances are than usual, 0.125 to 64; doubling it shows
    /// whether a picture has converged [1].
    #[arg(long, value_name = "X", value_parser = above_0, allow_negative_numbers = true, help_heading = "Shadow map")]
    pub quality: Option<f64>,
    /// Maximum number of steps along a light ray [512].
    #[arg(long, value_name = "N", value_parser = count(1 << 20), help_heading = "Shadow map")]
    pub steps: Option<u32>,
    /// Slabs of a fragment map: equal ones on each ray (ray), between planes (planes) or drawn
    /// (raster).
    #[arg(long, value_name = "HOW", value_parser = valid::<Slices>, help_heading = "Shadow map")]
    pub slices: Option<String>,
    /// Allowed error of transmittance in a fragment map; 0 keeps every fragment [0.002].
    #[arg(long, value_name = "E", value_parser = at_least_0, allow_negative_numbers = true, help_heading = "Shadow map")]
    pub tolerance: Option<f64>,
    /// Cut off raw fragment lists this close to their final transmittance; 0 never does [0.001].
    #[arg(long, value_name = "E", value_parser = at_least_0, allow_negative_numbers = true, help_heading = "Shadow map")]
    pub truncation: Option<f64>,
    /// Bytes that fragment lists may take at a time; larger maps are built in tiles [1 GiB].
    #[arg(long, value_name = "BYTES", help_heading = "Shadow map")]
    pub memory: Option<u64>,
}

/// A picture, as options.
#[derive(Debug, Args)]
pub(super) struct PictureArguments {
    /// Picture size in pixels [512x512].
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = "Picture")]
    pub size: Option<[u32; 2]>,
    /// Camera rays per pixel; a single one goes through its centre [1].
    #[arg(long, value_name = "N", value_parser = count(4096), help_heading = "Picture")]
    pub samples: Option<u32>,
    /// Allowed error of pixels that are interpolated, or get one ray instead of all, as a share of
    /// the 99.9th percentile of radiance; 0 marches every pixel [0.002].
    #[arg(long, value_name = "E", value_parser = at_least_0, allow_negative_numbers = true, help_heading = "Picture")]
    pub picture_tolerance: Option<f64>,
    /// Maximum number of steps along a camera ray; by default it depends on the voxels crossed.
    #[arg(long, value_name = "N", value_parser = count(1 << 20), help_heading = "Picture")]
    pub view_steps: Option<u32>,
    #[command(flatten)]
    pub tone: ToneArguments,
    /// How shadow becomes colour: physical or paper [physical].
    #[arg(long, value_name = "HOW", value_parser = valid::<Shading>, help_heading = "Picture")]
    pub shading: Option<String>,
    /// Lookups along a camera ray with --shading paper [128].
    #[arg(long, value_name = "N", value_parser = count(1 << 16), help_heading = "Picture")]
    pub light_samples: Option<u32>,
    /// Octaves that imitate multiple scattering, without being physically based [0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=16), help_heading = "Picture")]
    pub octaves: Option<u32>,
    #[command(flatten)]
    pub stage: StageArguments,
}

/// Where a result goes.
#[derive(Debug, Args)]
pub(super) struct OutputArguments {
    /// File to write; the input's name in the current folder by default.
    #[arg(short, long, value_name = "OUT")]
    pub out: Option<PathBuf>,
}

/// Replaces what a scene file says by what was given as options.
macro_rules! overlay {
    ($($target:expr => $given:expr,)*) => {
        $(if let Some(given) = $given { $target = Some(given); })*
    };
}
pub(super) use overlay;

/// Changes all keyframes, because an option replaces what they say.
pub(super) fn still<T>(keyframes: &mut Option<Vec<T>>, change: impl FnMut(&mut T)) {
    keyframes.iter_mut().flatten().for_each(change);
}

impl SourceArguments {
    /// Writes the given options into `file`.
    pub(super) fn overlay(&self, file: &mut SceneFile) {
        for volume in file.volume.iter_mut() {
            overlay! {
                volume.window => self.window.map(|w| w.0),
                volume.clip => self.clip.map(|Numbers([a, b, c, d, e, f])| [[a, b, c], [d, e, f]]),
                volume.up => self.up.clone(),
                volume.density_scale => self.density_scale,
                volume.transfer => self.transfer.as_deref().map(transfer_table),
                volume.emission => self.emission.as_deref().map(emission_table),
            }
            if self.emission_radiance.is_some() {
                let emission = volume.emission.get_or_insert_default();
                (emission.radiance, emission.scale) = (self.emission_radiance, None);
            }
            if self.density_scale.is_some() {
                still(&mut volume.keyframes, |one| one.density_scale = None);
            }
            if self.transfer_range.is_some() {
                volume.transfer.get_or_insert_default().range = self.transfer_range;
            }
            self.file.overlay(volume);
        }
        self.surfaces.overlay(file, self.up.as_ref());
        if let Some(Numbers(direction)) = self.light {
            let light = file.light.one_mut();
            light.direction = Some(direction);
            light.keyframes = None;
            light.kind = Some("directional".to_owned());
        }
        if self.transparent {
            file.ground.enabled = Some(false);
        }
    }
}

impl SceneArguments {
    /// Writes the map's given options into `file`.
    pub(super) fn overlay(&self, file: &mut SceneFile) {
        let shadow = &mut file.shadow;
        overlay! {
            shadow.map => self.map.clone(),
            shadow.lookup => self.lookup.clone(),
            shadow.filter => self.filter.clone(),
            shadow.crossing => self.crossing.clone(),
            shadow.thresholds => self.thresholds.map(|t| t.0),
            shadow.size => self.map_size,
            shadow.quality => self.quality,
            shadow.steps => self.steps,
            shadow.slices => self.slices.clone(),
            shadow.tolerance => self.tolerance,
            shadow.truncation => self.truncation,
            shadow.memory => self.memory,
        }
    }
}

impl PictureArguments {
    /// Writes the given options into `file`.
    pub(super) fn overlay(&self, file: &mut SceneFile) {
        overlay! {
            file.image.width => self.size.map(|[width, _]| width),
            file.image.height => self.size.map(|[_, height]| height),
            file.image.samples => self.samples,
            file.image.tolerance => self.picture_tolerance,
            file.shadow.view_steps => self.view_steps,
            file.shadow.shading => self.shading.clone(),
            file.shadow.light_samples => self.light_samples,
            file.shadow.octaves => self.octaves,
        }
        self.tone.overlay(&mut file.image);
        self.stage.overlay(file);
    }
}

/// What `--transfer` refers to: a preset, `auto`, or a file. Anything else is treated as a preset's
/// name, because a list of names is a better answer than that there is no such file.
fn transfer_table(text: &str) -> TransferTable {
    let is_name = text == "auto" || transfer::preset(text).is_ok();
    if !is_name && Path::new(text).exists() {
        TransferTable { file: Some(text.into()), ..TransferTable::default() }
    } else {
        TransferTable { name: Some(text.to_owned()), ..TransferTable::default() }
    }
}

/// Parses `--transfer-range`.
fn transfer_range(text: &str) -> Result<TransferRange, String> {
    if text == "data" {
        return Ok(TransferRange::Word(RangeWord::Data));
    }
    let Numbers(range) = numbers::<f64, 2>(text)?;
    Ok(TransferRange::Values(range))
}

/// What `--emission` refers to: a grid, or the densities themselves.
fn emission_table(text: &str) -> EmissionTable {
    let grid = (text != "density").then(|| text.to_owned());
    EmissionTable { grid, ..EmissionTable::default() }
}

/// `N` numbers, separated by commas.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers<T, const N: usize>(pub [T; N]);

pub(super) fn numbers<T: FromStr + Copy + Default, const N: usize>(
    text: &str,
) -> Result<Numbers<T, N>, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    if parts.len() != N {
        return Err(format!("expected {N} numbers separated by commas"));
    }
    let mut values = [T::default(); N];
    for (value, part) in values.iter_mut().zip(parts) {
        *value = part.parse().map_err(|_| format!("'{part}' is not a valid number"))?;
    }
    Ok(Numbers(values))
}

/// Voxel counts, separated by commas or by crosses.
pub(super) fn dims(text: &str) -> Result<Numbers<usize, 3>, String> {
    if text.contains(',') {
        numbers(text)
    } else {
        numbers(&text.replace(['x', 'X', '\u{d7}'], ","))
    }
}

/// The usual name of a number type that is spelled in one of several ways.
pub(super) fn value_type(text: &str) -> Result<String, String> {
    parse::<ValueType>(text).map(|value_type| value_type.name().to_owned())
}

/// Checks that the text is a name of `T`; it is interpreted when the whole scene is assembled.
pub(super) fn valid<T: FromStr<Err = crate::Error>>(text: &str) -> Result<String, String> {
    parse::<T>(text).map(|_| text.to_owned())
}

fn map_help() -> String {
    format!(
        "Kind of shadow map: fragments (lists within a tolerance; the default for pictures), \
         threshold (four numbers per texel; the default for maps) or, on the CPU only, another one \
         to compare with them. All: {}",
        MapKind::names()
    )
}

fn transfer_help() -> String {
    format!(
        "Colour and opacity over density: a name ({}), auto, or a file (ParaView's JSON, or lines \
         of 'value r g b opacity')",
        transfer::PRESETS.map(|(name, _)| name).join(", ")
    )
}

pub(super) fn count(most: i64) -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=most)
}

pub(super) fn number(text: &str, allowed: impl Fn(f64) -> bool, what: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|&x: &f64| x < 1e30 && allowed(x))
        .ok_or_else(|| format!("expected a number {what}"))
}

fn at_least_0(text: &str) -> Result<f64, String> {
    number(text, |x| x >= 0.0, "of at least 0")
}

pub(super) fn above_0(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0, "above 0")
}

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parsed
        .filter(|size: &[u32; 2]| size.iter().all(|n| (1..=16384).contains(n)))
        .ok_or_else(|| "expected WIDTHxHEIGHT, such as 640x480, each from 1 to 16384".to_owned())
}

pub(super) fn parse<T: FromStr<Err = crate::Error>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: crate::Error| error.to_string())
}
