//! What the arguments mean: the scene, how to compute it, and what does so.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::arguments::{PictureArguments, SceneArguments, SourceArguments};
use super::backend::BackendChoice;
use super::progress::Bars;
use super::{backend, say};
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::io::{Inputs, load_ingredients, source_files};
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Choice, Surroundings, complete};
use crate::scene::{Scene, SceneFile, descriptor};
use crate::settings::Settings;
use crate::volume::presets::Preset;

/// What is asked for, before anything large is read.
pub(super) struct Request<'a> {
    source: &'a SourceArguments,
    choice: BackendChoice,
    file: SceneFile,
    surroundings: Surroundings,
    /// All files that it is read from.
    pub inputs: Inputs,
}

/// A scene ready to be computed.
pub(super) struct Job {
    pub scene: Scene,
    pub settings: Settings,
    pub backend: Box<dyn Backend>,
    pub progress: Box<dyn Progress>,
    quiet: bool,
}

impl<'a> Request<'a> {
    /// What the arguments ask for.
    pub(super) fn new(
        arguments: &'a SceneArguments,
        picture: Option<&PictureArguments>,
    ) -> Result<Self> {
        Self::open(&arguments.source, arguments.backend, |file| {
            arguments.overlay(file);
            if let Some(picture) = picture {
                picture.overlay(file);
            }
        })
    }

    /// What `source` names, with what `overlay` puts over its scene file, to be computed by `choice`.
    pub(super) fn open(
        source: &'a SourceArguments,
        choice: BackendChoice,
        overlay: impl FnOnce(&mut SceneFile),
    ) -> Result<Self> {
        let (mut file, surroundings) = described(&source.input)?;
        source.overlay(&mut file);
        overlay(&mut file);
        // The scene file itself, or a name that is no file.
        let mut inputs = Inputs::new([PathBuf::from(&source.input)]);
        for table in file.volume.iter() {
            inputs.extend(source_files(table)?);
        }
        Ok(Self { source, choice, file, surroundings, inputs })
    }

    /// Loads what is asked for, chooses what is left open, and says so.
    pub(super) fn load(self) -> Result<Job> {
        let Self { source, choice, file, surroundings, .. } = self;
        if let Some(threads) = source.threads {
            // Only a second pool in one process fails, and the program makes one.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
            pool.build_global().map_err(|error| Error::value("threads", error.to_string()))?;
        }
        // A scene file's absolute parameters speak of stored values.
        let scan = surroundings == Surroundings::Studio;
        let (mut ingredients, mut notes) = (Vec::new(), Vec::new());
        for table in file.volume.iter() {
            let (own, said) = load_ingredients(table, scan)?;
            ingredients.push(own);
            notes.extend(said);
        }
        let (mut scene, settings, choices) = complete(&file, ingredients, surroundings)?;
        if source.transparent {
            scene.background = None;
        }
        let backend = backend::open(choice, settings.map)?;
        let progress: Box<dyn Progress> =
            if source.quiet { Box::new(Silent) } else { Box::new(Bars::default()) };
        let job = Job { scene, settings, backend, progress, quiet: source.quiet };
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
    /// Puts a line for people on stderr, unless they asked for quiet.
    pub(super) fn note(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
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
    if path.extension().is_some_and(|ending| ending == "toml") {
        let text = fs::read_to_string(path).map_err(|error| Error::file(path, error))?;
        return Ok((SceneFile::parse(&text, path)?, Surroundings::Void));
    }
    if !path.exists() {
        let presets = Preset::ALL.map(Preset::name).join(", ");
        let why = format!("no such file, and none of the presets ({presets})");
        return Err(Error::contents(path, why));
    }
    let mut file = SceneFile::default();
    file.volume.first_mut().path = Some(path.to_owned());
    Ok((file, Surroundings::Studio))
}

/// The input's name with another ending, in the current folder.
pub(super) fn default_output(input: &str, ending: &str) -> PathBuf {
    let stem = Path::new(input).file_stem().unwrap_or_default();
    let mut name = stem.to_owned();
    name.push(".");
    name.push(ending);
    PathBuf::from(name)
}
