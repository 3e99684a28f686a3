//! Command `completions`: prints a script that completes the command line in a shell.

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use super::{Program, print};
use crate::error::Result;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Shell that the script is for.
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut Program::command(), "deepshadow", &mut script);
    print(&String::from_utf8_lossy(&script))
}
