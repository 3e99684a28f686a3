//! Turns arguments into a job: the scene, how to compute it, and the backend.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::arguments::{PictureArguments, SceneArguments, SourceArguments};
use super::backend::{BackendChoice, Opening};
use super::progress::Bars;
use super::say;
use crate::backend::{Backend, Expected};
use crate::error::{Error, ErrorKind, Result};
use crate::image::{Exposure, ToneMap};
use crate::io::dense::DEFAULT_MAX_BYTES;
use crate::io::{Inputs, load_ingredients, source_files};
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Choice, Surroundings, complete};
use crate::scene::file::VolumeTable;
use crate::scene::{Scene, SceneFile, descriptor};
use crate::settings::{MapKind, Settings};
use crate::volume::presets::Preset;

/// Texels along each edge of maps that are made without a picture.
const MAP_SIZE: u32 = 512;

/// A request, before anything large is read.
pub(super) struct Request<'a> {
    source: &'a SourceArguments,
    choice: BackendChoice,
    file: SceneFile,
    surroundings: Surroundings,
    /// Whether a picture is requested.
    picture: bool,
    /// All files from which the request is read.
    pub inputs: Inputs,
}

/// A scene that is ready to be computed.
pub(super) struct Job {
    pub scene: Scene,
    pub settings: Settings,
    /// What was given, and the windows that were chosen for its volumes.
    file: SceneFile,
    windows: Vec<Option<[f32; 2]>>,
    pub exposure: Exposure,
    /// `None` if it is to be chosen.
    pub tone_map: Option<ToneMap>,
    pub backend: &'static dyn Backend,
    pub progress: Box<dyn Progress>,
    quiet: bool,
}

impl<'a> Request<'a> {
    /// The job for the arguments.
    pub(super) fn new(
        arguments: &'a SceneArguments,
        picture: Option<&PictureArguments>,
    ) -> Result<Self> {
        let request = Self::open(&arguments.source, arguments.backend, |file| {
            arguments.overlay(file);
            match picture {
                Some(picture) => picture.overlay(file),
                None => _ = file.shadow.size.get_or_insert(MAP_SIZE),
            }
        })?;
        Ok(Self { picture: picture.is_some(), ..request })
    }

    /// The request for `source`. `overlay` changes its scene file, and `choice` selects the
    /// backend.
    pub(super) fn open(
        source: &'a SourceArguments,
        choice: BackendChoice,
        overlay: impl FnOnce(&mut SceneFile),
    ) -> Result<Self> {
        let (mut file, surroundings) = described(&source.input)?;
        source.overlay(&mut file);
        overlay(&mut file);
        // The scene file itself, or a preset's name, which is not a file.
        let mut inputs = Inputs::new([PathBuf::from(&source.input)]);
        for table in file.volume.iter() {
            inputs.extend(source_files(table)?);
        }
        Ok(Self { source, choice, file, surroundings, picture: false, inputs })
    }

    /// Loads the requested volumes, chooses the missing values, and reports the choices.
    pub(super) fn load(self) -> Result<Job> {
        let Self { source, choice, file, surroundings, picture, .. } = self;
        let opening = Opening::begin(choice, expected(&file).filter(|_| picture));
        // Absolute parameters in a scene file refer to stored values.
        let scan = surroundings == Surroundings::Studio;
        let (mut ingredients, mut notes) = (Vec::new(), Vec::new());
        let mut held = 0;
        for table in file.volume.iter() {
            let most = table.max_bytes.unwrap_or(DEFAULT_MAX_BYTES);
            let left = VolumeTable { max_bytes: Some(most.saturating_sub(held)), ..table.clone() };
            let (own, said) = load_ingredients(&left, scan).map_err(|error| beside(error, held))?;
            held += own.bytes();
            if held > most {
                let what = format!("{} volumes together", ingredients.len() + 1);
                let (needed, limit) = (format!("{held} bytes"), format!("{most} bytes"));
                return Err(ErrorKind::Limit { what, needed, limit }.into());
            }
            ingredients.push(own);
            notes.extend(said);
        }
        let windows = ingredients.iter().map(|own| own.window).collect();
        let (mut scene, settings, choices) = complete(&file, ingredients, surroundings)?;
        if source.transparent {
            scene.background = None;
        }
        let tell: fn(&str) = if source.quiet { |_| () } else { say };
        let backend = opening.finish(settings.map.kind, tell)?;
        let progress: Box<dyn Progress> =
            if source.quiet { Box::new(Silent) } else { Box::new(Bars::default()) };
        let (exposure, tone_map) = (file.image.exposure()?, file.image.tone_map()?);
        let quiet = source.quiet;
        let job =
            Job { scene, settings, file, windows, exposure, tone_map, backend, progress, quiet };
        for note in &notes {
            job.note(note);
        }
        let shown =
            |choice: &Choice| !(source.transparent && choice.what.starts_with("background"));
        for Choice { what, value } in choices.into_iter().filter(shown) {
            job.note(&format!("{what} {value} (chosen)"));
        }
        Ok(job)
    }
}

impl Job {
    /// The scene file that repeats a picture under `settings`.
    ///
    /// # Errors
    /// If it cannot be written as text.
    pub(super) fn scene_file(&self, settings: &Settings) -> Result<String> {
        self.file.saved(&self.windows, &self.scene, settings)?.to_text()
    }

    /// Prints a line for people on stderr, unless `--quiet` was given.
    pub(super) fn note(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
    }
}

/// What is expected of a scene before its volumes are read: nothing, except for one volume under
/// parallel light with the usual settings.
fn expected(file: &SceneFile) -> Option<(Option<MapKind>, Expected)> {
    let [volume] = &file.volume[..] else { return None };
    let shadow = &file.shadow;
    let usual = shadow.lookup.is_none()
        && shadow.thresholds.is_none()
        && shadow.crossing.is_none()
        && shadow.filter.is_none()
        && shadow.shading.is_none()
        && shadow.octaves.is_none()
        && file.light.iter().all(|light| light.kind.is_none())
        && volume.color.is_none()
        && volume.emission.is_none();
    // A scan may get a window, which is a transfer function.
    let grid = volume.path.as_ref().is_none_or(|path| path.extension() == Some("vdb".as_ref()));
    let expected = match &volume.transfer {
        Some(function) if function.gradient.is_none() => Expected::Function,
        None if grid && volume.window.is_none() => Expected::Plain,
        _ => return None,
    };
    let kind = shadow.map.as_ref().map(|name| name.parse()).transpose().ok()?;
    usual.then_some((kind, expected))
}

/// Adds to an error of too much memory what other volumes have taken already.
fn beside(error: Error, held: u64) -> Error {
    match error.kind() {
        ErrorKind::Limit { what, needed, limit } if held > 0 => {
            let limit = format!("{limit}, in addition to {held} bytes of other volumes");
            ErrorKind::Limit { what: what.clone(), needed: needed.clone(), limit }.into()
        }
        _ => error,
    }
}

/// The scene file that `input` is or stands for.
fn described(input: &str) -> Result<(SceneFile, Surroundings)> {
    if let Ok(preset) = Preset::from_str(input)
        && !Path::new(input).is_file()
    {
        return Ok((descriptor(preset)?, Surroundings::Studio));
    }
    let path = Path::new(input);
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        let text = fs::read_to_string(path).map_err(|error| Error::file(path, error))?;
        return Ok((SceneFile::parse(&text, path)?, Surroundings::Void));
    }
    if !path.exists() {
        return Err(not_there(path));
    }
    let mut file = SceneFile::default();
    file.volume.one_mut().path = Some(path.to_owned());
    Ok((file, Surroundings::Studio))
}

/// The error for an input that is neither a file nor a preset.
pub(super) fn not_there(path: &Path) -> Error {
    let presets = Preset::ALL.map(Preset::name).join(", ");
    Error::contents(path, format!("no such file, and not one of the presets ({presets})"))
}

/// The input's name with another ending, in the current folder.
pub(super) fn default_output(input: &str, ending: &str) -> PathBuf {
    let stem = Path::new(input).file_stem().unwrap_or_default();
    let mut name = stem.to_owned();
    name.push(".");
    name.push(ending);
    PathBuf::from(name)
}
