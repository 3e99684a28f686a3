//! Command `info`: describes a volume file or a deep image, for people or for programs.

mod deep;
mod json;
mod report;
mod text;

use std::path::PathBuf;

use clap::Args;

use super::arguments::FileArguments;
use super::{print, print_json};
use crate::error::Result;
use crate::io::ReadOptions;
use crate::scene::file::VolumeTable;
pub(super) use json::number;
use report::Report;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Volume file or deep OpenEXR image.
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
    let report = Report::of(
        &arguments.file,
        &ReadOptions::of(&table)?,
        !arguments.no_stats,
        !arguments.json,
    )?;
    if arguments.json { print_json(&json::write(&report)) } else { print(&text::write(&report)) }
}
