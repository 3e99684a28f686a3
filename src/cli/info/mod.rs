//! Command `info`: describes a volume, a deep image, hair or a mesh, for people or for programs.

mod deep;
mod json;
mod report;
mod surface;
mod text;

use std::path::PathBuf;

use clap::Args;

use super::reading::FileArguments;
use super::{print, print_json};
use crate::error::Result;
use crate::io::ReadOptions;
use crate::io::not_there;
use crate::scene::file::VolumeTable;
use crate::volume::presets::Preset;
use report::Report;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Volume file, preset (box, bucky, rods, clouds), deep OpenEXR image, hair or mesh.
    file: PathBuf,
    /// Print one JSON object on stdout, for programs.
    #[arg(long)]
    json: bool,
    /// Headers only: no minimum, maximum or mean, and no histogram.
    #[arg(long)]
    no_stats: bool,
    #[command(flatten)]
    how: FileArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let mut table = VolumeTable::default();
    arguments.how.overlay(&mut table);
    let options = ReadOptions::of(&table)?;
    let (values, histograms) = (!arguments.no_stats, !arguments.json);
    let preset = arguments.file.to_str().and_then(|name| name.parse::<Preset>().ok());
    let report = match preset.filter(|_| !arguments.file.exists()) {
        Some(preset) => Report::of_preset(preset, &options, values, histograms)?,
        None if !arguments.file.exists() => return Err(not_there(&arguments.file)),
        None => Report::of(&arguments.file, &options, values, histograms)?,
    };
    if arguments.json { print_json(&json::write(&report)) } else { print(&text::write(&report)) }
}
