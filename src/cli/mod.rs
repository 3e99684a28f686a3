//! The command line: one module per command. `arguments` parses it; `job` interprets it.

mod adapters;
mod arguments;
mod backend;
mod compare;
mod completions;
mod convert;
mod deep;
mod explore;
mod figures;
mod goal;
mod hair_figures;
mod info;
mod job;
mod limits;
mod map;
mod picture;
mod probe;
mod progress;
mod reading;
mod render;
mod sheet;
#[cfg(unix)]
mod signals;
mod spelling;
mod stage;
mod surfaces;
mod tone;
mod usage;
mod workers;

use std::ffi::OsString;
use std::io::Write;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use usage::Given;

use crate::error::quote::{self, LONGEST_LINE};
use crate::error::{Error, Result};

/// The result of a run of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 1: bad input or failed work; the reason was printed on stderr.
    Failed,
    /// Exit code 2: wrong usage of the command line; the reason was printed on stderr.
    Misused,
}

/// Shadows of things that light passes through: renders volumes that cast shadows on themselves and
/// on the ground.
#[derive(Debug, Parser)]
#[command(name = "deepshadow", version)]
struct Program {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a picture of a volume, with its shadows.
    Render(Box<render::Arguments>),
    /// Turn a volume and its light in a window (needs deepshadow-explorer).
    Explore(explore::Arguments),
    /// Build a volume's shadow map and write it as OpenEXR.
    Map(map::Arguments),
    /// Measure the light that arrives at given points.
    Probe(probe::Arguments),
    /// Convert a volume file to another format.
    Convert(convert::Arguments),
    /// Measure the error of every kind of shadow map against the exact integral.
    Compare(compare::Arguments),
    /// Show what a volume file holds.
    Info(info::Arguments),
    /// Draw the figures of the paper "Volumetric Deep Shadow Maps" from the presets.
    Figures(figures::Arguments),
    /// List the graphics adapters.
    Adapters,
    /// Print a script that completes commands and options in a shell.
    Completions(completions::Arguments),
}

/// Runs the program with `arguments`, the first of which is the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> Outcome {
    #[cfg(unix)]
    signals::clean_up_after();
    let parsed = Program::command().try_get_matches_from(arguments).and_then(|matches| {
        let program = Program::from_arg_matches(&matches)?;
        Ok((program, Given::of(&matches)))
    });
    let (program, given) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            let misused = error.use_stderr();
            let asks_for_help =
                error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
            if !misused || asks_for_help {
                // Help or the version; if the stream is closed, nobody can be told.
                let _ = error.print();
                return if misused { Outcome::Misused } else { Outcome::Done };
            }
            say(&format!("{} (see --help)", reason(&error.to_string())));
            return Outcome::Misused;
        }
    };
    match workers::run(program.command.threads(), || dispatch(program.command)) {
        Ok(()) => Outcome::Done,
        Err(error) => {
            say(&error.to_string());
            if given.is_to_blame(&error) { Outcome::Misused } else { Outcome::Failed }
        }
    }
}

/// The reason in the text of an error of clap, and the similar words that it knows, in one line.
fn reason(text: &str) -> String {
    let first = text.lines().take_while(|line| !line.is_empty());
    let why = first.map(str::trim).collect::<Vec<_>>().join(" ");
    let tips = text.lines().filter_map(|line| line.trim().strip_prefix("tip: "));
    let similar: Vec<&str> = tips.filter(|tip| tip.contains("similar")).collect();
    let why = why.strip_prefix("error: ").unwrap_or(&why);
    [&[why], &similar[..]].concat().join("; ")
}

impl Command {
    /// The requested number of threads.
    fn threads(&self) -> Option<u32> {
        match self {
            Self::Render(arguments) => arguments.threads(),
            Self::Map(arguments) => arguments.threads(),
            Self::Compare(arguments) => arguments.threads(),
            Self::Probe(arguments) => arguments.threads(),
            Self::Explore(_)
            | Self::Convert(_)
            | Self::Info(_)
            | Self::Figures(_)
            | Self::Adapters
            | Self::Completions(_) => None,
        }
    }
}

fn dispatch(command: Command) -> Result<()> {
    match command {
        Command::Render(arguments) => render::run(*arguments),
        Command::Explore(arguments) => explore::run(&arguments),
        Command::Map(arguments) => map::run(arguments),
        Command::Probe(arguments) => probe::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Figures(arguments) => figures::run(&arguments),
        Command::Adapters => adapters::run(),
        Command::Completions(arguments) => completions::run(&arguments),
    }
}

/// Prints the requested text on stdout.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        // A reader such as `head` may have closed the pipe.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| Error::file("standard output", error)),
    }
}

/// Prints JSON on stdout.
fn print_json(text: &str) -> Result<()> {
    print(&quote::json(text))
}

/// Prints one line for people on stderr; text that it quotes cannot control a terminal.
fn say(line: &str) {
    let line = spelling::with_options(line);
    let line = quote::one_line(&format!("deepshadow: {line}"), LONGEST_LINE);
    // If stderr is closed, the work goes on.
    let _ = writeln!(std::io::stderr(), "{line}");
}
