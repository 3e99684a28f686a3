//! Options on the file that a picture is written to: its name, its format, and what it holds.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use clap::builder::PossibleValuesParser;
use clap::builder::TypedValueParser;

use super::arguments::parse;
use super::deep::DeepZ;
use super::job::default_output;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{Inputs, PendingFile, PictureFormat, PictureOptions};
use crate::scene::NumberedName;

/// The ending of deep images' names.
const DEEP_ENDING: &str = ".deep.exr";
/// The name of the deep format.
const DEEP: &str = "deep-exr";
/// The output's name that stands for standard output.
const STDOUT: &str = "-";

/// Where a picture goes, as options.
#[derive(Debug, Args)]
pub(super) struct FileOptions {
    /// File to write; its ending selects the format: .png, .jpg, .tiff, .webp (for screens), .exr,
    /// .hdr, .npy (linear radiance) or .deep.exr (the camera's deep image, for compositing). - is
    /// standard output. The input's name with .png in the current folder by default.
    #[arg(short, long, value_name = "OUT")]
    out: Option<PathBuf>,
    /// Format of the file, whatever its name ends in: png, jpg, tiff, webp, exr, hdr, npy, deep-exr.
    #[arg(long, value_name = "FORMAT", value_parser = parse::<FileFormat>, help_heading = "Picture")]
    format: Option<FileFormat>,
    /// Bits per channel: 8 or 16 in png and tiff [8]; 32 in tiff is linear radiance; 16 or 32 in
    /// exr [32].
    #[arg(long, value_name = "N", value_parser = bits(), help_heading = "Picture")]
    bits: Option<u32>,
    /// What depths in deep images are: distances along the camera's axis (planar) or along each
    /// pixel's ray (ray) [planar].
    #[arg(long, value_name = "WHAT", value_parser = parse::<DeepZ>, help_heading = "Picture")]
    deep_z: Option<DeepZ>,
}

fn bits() -> impl TypedValueParser<Value = u32> {
    PossibleValuesParser::new(["8", "16", "32"]).map(|text| text.parse().unwrap_or(8))
}

/// A format of flat or deep pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileFormat {
    Deep,
    Flat(PictureFormat),
}

impl FileFormat {
    fn of_path(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        // A name needs something in front of its ending.
        if name.len() > DEEP_ENDING.len() && name.ends_with(DEEP_ENDING) {
            return Some(Self::Deep);
        }
        PictureFormat::of_path(path).map(Self::Flat)
    }

    /// The ending of a file's name.
    fn ending(self) -> &'static str {
        match self {
            Self::Deep => "deep.exr",
            Self::Flat(format) => format.name(),
        }
    }
}

impl FromStr for FileFormat {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if [DEEP, "deep.exr"].iter().any(|name| text.eq_ignore_ascii_case(name)) {
            return Ok(Self::Deep);
        }
        text.parse().map(Self::Flat).map_err(|_| {
            let names = PictureFormat::names();
            Error::value("format", format!("'{text}' is not one of {names}, {DEEP}"))
        })
    }
}

/// Where a picture goes, decided.
#[derive(Clone)]
pub(super) struct Target {
    /// The file's name, or what stands for standard output.
    path: PathBuf,
    format: FileFormat,
    bits: Option<u32>,
    deep_z: DeepZ,
}

impl FileOptions {
    /// Where the picture of `input` goes, which is seen in front of nothing if `transparent`.
    ///
    /// # Errors
    /// About the options that contradict each other or the name.
    pub(super) fn target(&self, input: &str, transparent: bool) -> Result<Target> {
        let png = FileFormat::Flat(PictureFormat::Png);
        let by_name = |path: &Path| {
            if path == Path::new(STDOUT) { Some(png) } else { FileFormat::of_path(path) }
        };
        let (path, format) = match (&self.out, self.format) {
            (Some(path), Some(format)) => (path.clone(), format),
            (Some(path), None) => {
                let endings = PictureFormat::ALL.map(|format| format!(".{}", format.name()));
                let why = || {
                    let (path, endings) = (path.display(), endings.join(", "));
                    format!("'{path}' ends in none of {endings}, {DEEP_ENDING}; --format names one")
                };
                (path.clone(), by_name(path).ok_or_else(|| Error::value("out", why()))?)
            }
            (None, format) => {
                let format = format.unwrap_or(png);
                (default_output(input, format.ending()), format)
            }
        };
        let target =
            Target { path, format, bits: self.bits, deep_z: self.deep_z.unwrap_or_default() };
        match format {
            FileFormat::Deep if self.bits.is_some() => {
                return Err(Error::value("bits", "does not apply to deep images"));
            }
            FileFormat::Flat(_) if self.deep_z.is_some() => {
                return Err(Error::value("deep-z", "applies to deep images only"));
            }
            FileFormat::Flat(flat) => {
                target.options(flat).checked_bits()?;
                if transparent && !flat.has_alpha() {
                    let name = flat.name();
                    let able = PictureFormat::ALL.into_iter().filter(|other| other.has_alpha());
                    let able = able.map(PictureFormat::name).collect::<Vec<_>>().join(", ");
                    let why = format!(
                        "{name} has no alpha; {able} have, and without this option there is a \
                         background"
                    );
                    return Err(Error::value("transparent", why));
                }
            }
            FileFormat::Deep => {}
        }
        if target.is_stdout() && std::io::stdout().is_terminal() {
            let why = "standard output is a terminal; send it to a file or a program";
            return Err(Error::value("out", why));
        }
        Ok(target)
    }
}

impl Target {
    fn is_stdout(&self) -> bool {
        self.path == Path::new(STDOUT)
    }

    /// The file's name; `None` for standard output.
    pub(super) fn path(&self) -> Option<&Path> {
        (!self.is_stdout()).then_some(&*self.path)
    }

    /// Whether there is room for several pictures: a name with a place for a frame's number, or
    /// standard output.
    pub(super) fn is_numbered(&self) -> bool {
        self.is_stdout() || NumberedName::of(&self.path).is_some()
    }

    /// The picture of a frame.
    pub(super) fn at(&self, frame: i64) -> Self {
        let path = NumberedName::of(&self.path).map(|name| name.at(frame));
        Self { path: path.unwrap_or_else(|| self.path.clone()), ..self.clone() }
    }

    /// What the file holds, apart from its pixels.
    pub(super) fn contents(&self) -> impl std::fmt::Debug {
        (self.format, self.bits, self.deep_z)
    }

    /// Checks that the file is none of `inputs`.
    ///
    /// # Errors
    /// If it is.
    pub(super) fn check(&self, inputs: &Inputs) -> Result<()> {
        self.path().map_or(Ok(()), |path| inputs.refuse(path))
    }

    /// Whether this is the file `path`, as far as names tell.
    pub(super) fn is(&self, path: &Path) -> bool {
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        !self.is_stdout() && whole(&self.path) == whole(path)
    }

    pub(super) fn is_deep(&self) -> bool {
        self.format == FileFormat::Deep
    }

    /// Whether the file holds linear radiance.
    pub(super) fn is_linear(&self) -> bool {
        match self.format {
            FileFormat::Flat(format) => {
                format.is_linear(self.bits.unwrap_or_else(|| format.bits()[0]))
            }
            FileFormat::Deep => true,
        }
    }

    /// What depths in a deep image are.
    pub(super) fn deep_z(&self) -> DeepZ {
        self.deep_z
    }

    /// The name for people.
    pub(super) fn name(&self) -> String {
        if self.is_stdout() {
            "to standard output".to_owned()
        } else {
            self.path.display().to_string()
        }
    }

    /// Prepares the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn open(&self, inputs: &Inputs) -> Result<PendingFile> {
        if self.is_stdout() {
            PendingFile::stdout()
        } else {
            PendingFile::create(&self.path, inputs)
        }
    }

    fn options(&self, format: PictureFormat) -> PictureOptions {
        PictureOptions::new(format).with(|options| options.bits = self.bits)
    }

    /// The bytes of a flat picture.
    ///
    /// # Errors
    /// If its encoder fails.
    pub(super) fn encode(
        &self,
        image: &Image,
        describe: impl FnOnce(&mut PictureOptions),
    ) -> Result<Vec<u8>> {
        match self.format {
            FileFormat::Flat(format) => self.options(format).with(describe).encode(image),
            FileFormat::Deep => Err(Error::value("format", "a deep image has no flat pixels")),
        }
    }
}
