//! Parses the arguments of `convert`.

use std::path::PathBuf;

use clap::Args;
use glam::IVec3;

use crate::cli::arguments::{Numbers, above_0, numbers, value_type};
use crate::cli::reading::FileArguments;
use crate::error::{Error, Result};
use crate::io::ReadOptions;
use crate::io::number::ValueType;
use crate::io::remap::checked_range;
use crate::io::vdb::IndexBox;
use crate::scene::file::VolumeTable;

const HEADING: &str = "Conversion";

#[derive(Debug, Args)]
#[command(mut_arg("value_type", |arg| arg.help(
    "Number type of the output: u8, i8, u16, i16, u32, i32, u64, i64, f16, f32, f64. With --dims, \
     it is the type of the raw input, as in other commands; the output's is then --to-type"
)))]
pub(in crate::cli) struct Arguments {
    /// Volume file to read.
    #[arg(value_name = "IN")]
    pub(super) input: PathBuf,
    /// File to write, in the format of its ending: .vdb, .npy, .nrrd, .nhdr, .mha, .mhd, .raw.
    #[arg(value_name = "OUT")]
    pub(super) output: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub(super) quiet: bool,

    /// Number type of the output, regardless of the input.
    #[arg(long, value_name = "TYPE", value_parser = value_type, help_heading = HEADING)]
    to_type: Option<String>,
    /// Values to map onto all numbers of an integer type, or onto 0..1; by default, values that fit
    /// an integer type are kept, and otherwise their whole range is mapped.
    #[arg(long, value_name = "LO,HI", value_parser = numbers::<f64, 2>, allow_hyphen_values = true, help_heading = HEADING)]
    range: Option<Numbers<f64, 2>>,
    /// Lowest and highest index to keep, both included.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = numbers::<i32, 6>, allow_hyphen_values = true, help_heading = HEADING)]
    crop: Option<Numbers<i32, 6>>,
    /// Factor on the number of voxels along each axis; averages below 1, interpolates above.
    #[arg(long, value_name = "FACTOR", value_parser = above_0, allow_negative_numbers = true, help_heading = HEADING)]
    resample: Option<f64>,
    /// Make voxels of lower values empty: inactive, with the background's value.
    #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = HEADING)]
    threshold: Option<f64>,
    /// Turn vectors into their lengths.
    #[arg(long, help_heading = HEADING)]
    magnitude: bool,
    /// Store floating-point numbers as half floats.
    #[arg(long, help_heading = HEADING)]
    half: bool,
    /// How voxels are packed: blosc, zip, mask or none in .vdb [blosc], gzip or none in NRRD, zlib
    /// or none in MetaImage [none].
    #[arg(long, value_name = "NAME", value_parser = ["blosc", "zip", "mask", "gzip", "zlib", "none"], help_heading = HEADING)]
    compression: Option<String>,
    #[command(flatten)]
    file: FileArguments,
}

/// The operations that the options request.
pub(super) struct Wanted {
    /// Number type of the output.
    pub to_type: Option<ValueType>,
    pub range: Option<[f64; 2]>,
    pub crop: Option<IndexBox>,
    pub resample: Option<f64>,
    pub threshold: Option<f64>,
    pub magnitude: bool,
    pub half: bool,
    pub compression: Option<String>,
}

impl Wanted {
    /// Whether the voxels stay unchanged.
    pub(super) fn is_nothing(&self) -> bool {
        self.to_type.is_none()
            && self.range.is_none()
            && self.crop.is_none()
            && self.resample.is_none()
            && self.threshold.is_none()
            && !self.magnitude
            && !self.half
    }
}

impl Arguments {
    /// How the input is read, and which operations are requested.
    pub(super) fn meaning(&self) -> Result<(ReadOptions, Wanted)> {
        let mut table = VolumeTable::default();
        self.file.overlay(&mut table);
        let mut to_type = self.to_type.clone();
        // `--type` refers to raw input only together with --dims; without that, raw input has a
        // sidecar.
        if table.dims.is_none()
            && let Some(given) = table.value_type.take()
        {
            if to_type.as_ref().is_some_and(|other| *other != given) {
                let why = format!("{given}, but --to-type is {}", to_type.unwrap_or_default());
                return Err(Error::value("type", why));
            }
            to_type = Some(given);
        }
        let crop = self.crop.map(|Numbers([x, y, z, to_x, to_y, to_z])| IndexBox {
            min: IVec3::new(x, y, z),
            max: IVec3::new(to_x, to_y, to_z),
        });
        if let Some(IndexBox { min, max }) = crop
            && min.cmpgt(max).any()
        {
            let why = format!("{min} .. {max} is not a box: the lowest index comes first");
            return Err(Error::value("crop", why));
        }
        if let Some(least) = self.threshold.filter(|least| least.is_nan()) {
            return Err(Error::value("threshold", format!("{least} is not a number")));
        }
        let wanted = Wanted {
            to_type: to_type.map(|name| name.parse()).transpose()?,
            range: self.range.map(|Numbers(range)| checked_range(range)).transpose()?,
            crop,
            resample: self.resample,
            threshold: self.threshold,
            magnitude: self.magnitude,
            half: self.half,
            compression: self.compression.clone(),
        };
        Ok((ReadOptions::of(&table)?, wanted))
    }
}
