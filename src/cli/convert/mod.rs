//! Command `convert`: writes a volume file in another format.

mod arguments;
mod output;
mod sparse;

use std::path::{Path, PathBuf};

use super::progress::Bars;
use super::say;
use crate::error::{Error, Result};
use crate::io::dense::{DenseFile, DenseGrid, DenseOutput, DenseTarget};
use crate::io::number::ValueType;
use crate::io::remap::{Remap, Span};
use crate::io::vdb::VdbFile;
use crate::io::{Format, Inputs, ReadOptions};
use crate::progress::{Progress, Silent};
pub(super) use arguments::Arguments;
use arguments::Wanted;
use output::{Output, Target};

/// The requested conversion, with its way to report to the user.
struct Job<'a> {
    options: ReadOptions,
    wanted: Wanted,
    output: &'a Path,
    quiet: bool,
    progress: Box<dyn Progress>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let (options, wanted) = arguments.meaning()?;
    let (input, path) = (arguments.input.as_path(), arguments.output.as_path());
    let target = Target::new(path, wanted.compression.as_deref())?;
    let format = options.format_of(input)?;
    options.check(input, format)?;
    let quiet = arguments.quiet;
    let progress: Box<dyn Progress> =
        if quiet { Box::new(Silent) } else { Box::new(Bars::default()) };
    let job = Job { options, wanted, output: path, quiet, progress };
    let (paths, what) = if format == Format::OpenVdb {
        let file = VdbFile::open(input)?;
        match Output::promise(path, target, &Inputs::new([input.to_owned()]))? {
            Output::OpenVdb(output, compression) => job.vdb_to_vdb(&file, output, compression)?,
            Output::Dense(output, format) => {
                let grid = job.dense_of_vdb(&file)?;
                job.encode(grid, output, format)?
            }
        }
    } else {
        let file = DenseFile::open(input, format, &job.options)?;
        let output = Output::promise(path, target, &Inputs::new(file.files().to_vec()))?;
        job.progress.begin("convert", 3);
        for note in &file.header().notes {
            job.note(note);
        }
        job.dense_file(&file, output)?
    };
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    job.note(&format!("wrote {}: {what}", names.join(" and ")));
    Ok(())
}

/// The written files, and a description of their contents for people.
type Converted = (Vec<PathBuf>, String);

impl Job<'_> {
    /// Prints a line for people on stderr, unless `--quiet` was given.
    fn note(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
    }

    /// Reports what the output does not hold of the input.
    fn note_lost(&self, lost: &[String]) {
        if !lost.is_empty() {
            self.note(&format!("{} cannot record {}", self.output.display(), lost.join("; ")));
        }
    }

    fn max_bytes(&self) -> u64 {
        self.options.max_bytes
    }

    /// Converts a file of dense voxels.
    fn dense_file(&self, file: &DenseFile, output: Output) -> Result<Converted> {
        let read = || {
            let grid = DenseGrid::read(file)?;
            self.progress.advance(1);
            self.edited(grid)
        };
        match output {
            Output::Dense(output, format) => self.encode(read()?, output, format),
            Output::OpenVdb(output, compression) => match self.packed_vdb(file, compression)? {
                Some(packed) => self.streamed_to_vdb(packed, output, compression),
                None => self.dense_to_vdb(read()?, output, compression),
            },
        }
    }

    /// All operations except the last, which changes the number type.
    fn edited(&self, mut grid: DenseGrid) -> Result<DenseGrid> {
        if let Some(bounds) = self.wanted.crop {
            grid = grid.cropped(bounds)?;
        }
        if let Some(least) = self.wanted.threshold {
            grid = grid.without_below(least)?;
        }
        if self.wanted.magnitude {
            grid = grid.magnitude()?;
        }
        self.resampled(grid)
    }

    fn resampled(&self, grid: DenseGrid) -> Result<DenseGrid> {
        match self.wanted.resample {
            Some(factor) => grid.resampled(factor, self.max_bytes()),
            None => Ok(grid),
        }
    }

    /// Writes the files of a dense format.
    fn encode(
        &self,
        mut grid: DenseGrid,
        output: DenseOutput,
        format: DenseTarget,
    ) -> Result<Converted> {
        let half = self.wanted.half.then_some(ValueType::F16);
        if self.wanted.to_type.is_some_and(|to| half.is_some_and(|half| half != to)) {
            return Err(Error::value("half", "means f16, but another type is requested"));
        }
        let to = half.or(self.wanted.to_type).unwrap_or(grid.value_type);
        if to == ValueType::F16 && grid.value_type != to && !format.has_half() {
            let why = format!("{} cannot hold half floats", self.output.display());
            return Err(Error::value(if half.is_some() { "half" } else { "type" }, why));
        }
        let remap = self.remap(|| grid.span(), grid.value_type, to);
        grid = grid.retyped(to, remap)?;
        // With a range, new values are requested; without one, values keep their meaning.
        if self.wanted.range.is_none() {
            grid.value_scale = remap.value_scale();
        }
        let what = described(grid.dims, grid.components, grid.value_type);
        self.progress.advance(1);
        let written = output.write(grid)?;
        self.note_lost(&written.lost);
        self.progress.advance(1);
        Ok((written.paths, what))
    }

    /// How values become numbers of type `to`; reported if it changes them.
    fn remap(&self, span: impl FnOnce() -> Span, from: ValueType, to: ValueType) -> Remap {
        let range = self.wanted.range;
        let is_float = |one: ValueType| one.limits().is_none();
        let holds_all = from == to || (is_float(to) && from.size() < to.size());
        if range.is_none() && holds_all {
            return Remap::Cast;
        }
        let span = span();
        let remap = Remap::choose(span, to, range);
        if let Remap::Affine { from: [low, high], to: [first, last] } = remap {
            let [slope, intercept] = remap.value_scale();
            self.note(&format!(
                "values {low} .. {high} become {} {first} .. {last}: value = number * {slope} + \
                 {intercept}",
                to.name()
            ));
        } else if is_float(to) {
            self.note(&format!("numbers are rounded from {} to {}", from.name(), to.name()));
        }
        if to == ValueType::F16 && remap == Remap::Cast {
            self.note_overflow(span);
        }
        remap
    }

    /// Reports values beyond 65504, the largest half float.
    fn note_overflow(&self, span: Span) {
        let [low, high] = span.range.unwrap_or([0.0; 2]);
        if low.abs().max(high.abs()) >= 65520.0 {
            let note = format!(
                "values {low} .. {high} exceed the range of half floats and become infinite"
            );
            self.note(&note);
        }
    }
}

/// A description of voxels for people.
fn described([x, y, z]: [usize; 3], components: usize, value_type: ValueType) -> String {
    let vector = if components > 1 { format!(" x {components}") } else { String::new() };
    format!("{x} x {y} x {z} voxels of {}{vector}", value_type.name())
}
