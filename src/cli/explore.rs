//! Command `explore`: starts the explorer, which is a program of its own.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use clap::Args;

use crate::error::{Error, Result};

/// The explorer's name.
const PROGRAM: &str = "deepshadow-explorer";

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// What to explore, and the explorer's own options; nothing opens an empty window.
    #[arg(value_name = "INPUT", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// The explorer beside this program, else the one that the system finds.
fn program() -> PathBuf {
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| name.into())
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let program = program();
    let ended = Command::new(&program).args(&arguments.arguments).status();
    let why = match ended {
        Ok(ended) if ended.success() => return Ok(()),
        Ok(ended) => format!("{PROGRAM} ended with {ended}"),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => format!(
            "{PROGRAM} is not installed; in the repository, `cargo install --path \
             src/apps/explorer` installs it"
        ),
        Err(error) => return Err(Error::file(program, error)),
    };
    Err(Error::value("explorer", why))
}
