//! Turns arguments into a job: the scene, how to compute it, and the backend.

use std::mem::take;
use std::path::{Path, PathBuf};

use super::arguments::{PictureArguments, SceneArguments, SourceArguments};
use super::backend::{BackendChoice, Opening};
use super::progress::Bars;
use super::say;
use super::stage::{Side, look_at_patient};
use super::surfaces;
use crate::backend::{Backend, Expected};
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::image::{Exposure, ToneMap};
use crate::io::{
    Described, Inputs, SceneLoader, at_frame, is_numbered, source_files, surface_files,
};
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Choice, Loaded, Surroundings, complete};
use crate::scene::{Scene, SceneFile};
use crate::settings::{MapKind, Settings};

/// Texels along each edge of maps that are made without a picture.
const MAP_SIZE: u32 = 512;

/// A request, before anything large is read.
pub(super) struct Request<'a> {
    source: &'a SourceArguments,
    choice: BackendChoice,
    pub file: SceneFile,
    pub surroundings: Surroundings,
    /// What there is to say of it so far.
    said: Vec<String>,
    /// The side from which the camera shall look.
    side: Option<Side>,
    /// Whether a picture is requested.
    picture: bool,
    /// All files from which the request is read, without those of numbered names.
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
        let side = picture.and_then(|picture| picture.stage.view);
        Ok(Self { picture: picture.is_some(), side, ..request })
    }

    /// The request for `source`. `overlay` changes its scene file, and `choice` selects the
    /// backend.
    pub(super) fn open(
        source: &'a SourceArguments,
        choice: BackendChoice,
        overlay: impl FnOnce(&mut SceneFile),
    ) -> Result<Self> {
        // Anything may be raw.
        let is_raw = source.file.dims.is_some() || source.file.from.is_some();
        let Described { mut file, surroundings, notes } = Described::of(&source.input, is_raw)?;
        source.overlay(&mut file);
        overlay(&mut file);
        // The scene file itself, or a preset's name, which is not a file.
        let mut inputs = Inputs::new([PathBuf::from(&source.input)]);
        for table in file.volume.iter().filter(|table| !is_numbered(table)) {
            inputs.extend(source_files(table)?);
        }
        for path in file.surfaces().filter_map(|(_, table)| table.path.as_ref()) {
            inputs.extend(surface_files(path)?);
        }
        surfaces::check(source, &file)?;
        Ok(Self {
            source,
            choice,
            file,
            surroundings,
            said: notes,
            side: None,
            picture: false,
            inputs,
        })
    }

    /// Loads the requested volumes, chooses the missing values, and reports the choices. Of a scene
    /// with keyframes it is the first one.
    pub(super) fn load(mut self) -> Result<Job> {
        if let Some(table) = self.file.volume.iter().find(|table| is_numbered(table)) {
            let path = table.path.clone().unwrap_or_default();
            let why = "stands for a sequence; give one of its files";
            return Err(Error::contents(path, why));
        }
        if let Some(keyframes) = self.file.keyframes()? {
            self.file = at_frame(&self.file, *keyframes.start())?;
        }
        self.stand_up(&self.file.clone())?;
        let (crew, said) = self.crew();
        // Absolute parameters in a scene file refer to stored values.
        let scan = self.surroundings == Surroundings::Studio;
        let (loaded, notes) = SceneLoader::default().load(&self.file, scan)?;
        let crew = crew.ready(&self.file)?;
        for note in said.iter().chain(&notes) {
            crew.note(note);
        }
        let (job, choices) = crew.job(&self.file, loaded, self.surroundings)?;
        // What is seen does not matter where nothing is.
        let of_pictures = ["camera", "ground", "ambient", "background"];
        let shown = |choice: &Choice| {
            self.picture || !of_pictures.iter().any(|what| choice.what.starts_with(what))
        };
        crew.report(choices.into_iter().filter(shown).collect());
        Ok(job)
    }

    /// Lets patients stand, whose axes the files of `of` know, unless the scene says what is up or
    /// its values are absolute; and turns the camera to the side of them that was asked for.
    pub(super) fn stand_up(&mut self, of: &SceneFile) -> Result<()> {
        let (file, surroundings) = (take(&mut self.file), self.surroundings);
        let mut described = Described { file, surroundings, notes: take(&mut self.said) };
        let known = described.stand_up(of);
        (self.file, self.said) = (described.file, described.notes);
        let known = known?;
        match (self.side, known) {
            (Some(Side::Patient(_, from) | Side::Either(_, from)), Some(up)) => {
                look_at_patient(&mut self.file.camera, from, up);
                Ok(())
            }
            (None | Some(Side::Scene(_) | Side::Either(..)), _) => Ok(()),
            (Some(Side::Patient(name, _)), None) => {
                let why = format!(
                    "'{name}' needs a scan that knows its patient's axes (NIfTI, or NRRD and \
                     MetaImage that name them); front, back, left, right, top and bottom need none"
                );
                Err(Error::value("view", why))
            }
        }
    }

    /// Those who will work on the request, and what there is to say of it.
    pub(super) fn crew(&mut self) -> (Crew, Vec<String>) {
        let has_surfaces = self.file.has_surfaces();
        let expected = expected(&self.file).filter(|_| self.picture && !has_surfaces);
        // Drivers take longer to compile the passes that draw surfaces than processors to draw them,
        // so no GPU is opened for them unless that is asked for.
        let choice = match self.choice {
            BackendChoice::Auto if has_surfaces => BackendChoice::Cpu,
            choice => choice,
        };
        let opening = Some(Opening::begin(choice, expected));
        let (quiet, transparent) = (self.source.quiet, self.source.transparent);
        let crew = Crew { opening, backend: &CpuBackend, quiet, transparent };
        (crew, take(&mut self.said))
    }
}

/// The backend that makes pictures, and what is told of it.
pub(super) struct Crew {
    /// The backend while it is being opened.
    opening: Option<Opening>,
    pub backend: &'static dyn Backend,
    pub quiet: bool,
    transparent: bool,
}

impl Crew {
    /// Waits for the backend that suits `file`.
    pub(super) fn ready(mut self, file: &SceneFile) -> Result<Self> {
        if let Some(opening) = self.opening.take() {
            let tell: fn(&str) = if self.quiet { |_| () } else { say };
            let kind = file.shadow.map.as_ref().map(|name| name.parse()).transpose()?;
            self.backend = opening.finish(kind, file.has_surfaces(), tell)?;
        }
        Ok(self)
    }

    /// The job for `file` with its volumes, and the choices made for it.
    pub(super) fn job(
        &self,
        file: &SceneFile,
        loaded: Loaded,
        surroundings: Surroundings,
    ) -> Result<(Job, Vec<Choice>)> {
        let windows = loaded.volumes.iter().map(|own| own.window).collect();
        let (mut scene, settings, choices) = complete(file, loaded, surroundings)?;
        if self.transparent {
            scene.background = None;
        }
        let progress: Box<dyn Progress> =
            if self.quiet { Box::new(Silent) } else { Box::new(Bars::default()) };
        let (exposure, tone_map) = (file.image.exposure()?, file.image.tone_map()?);
        let (backend, quiet, file) = (self.backend, self.quiet, file.clone());
        let job =
            Job { scene, settings, file, windows, exposure, tone_map, backend, progress, quiet };
        Ok((job, choices))
    }

    /// Tells of choices.
    pub(super) fn report(&self, choices: Vec<Choice>) {
        let shown = |choice: &Choice| !(self.transparent && choice.what.starts_with("background"));
        for Choice { what, value } in choices.into_iter().filter(shown) {
            self.note(&format!("{what} {value} (chosen)"));
        }
    }

    /// Prints a line for people on stderr, unless `--quiet` was given.
    pub(super) fn note(&self, line: &str) {
        if !self.quiet {
            say(line);
        }
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

/// The input's name with another ending, in the current folder.
pub(super) fn default_output(input: &str, ending: &str) -> PathBuf {
    let stem = Path::new(input).file_stem().unwrap_or_default();
    let mut name = stem.to_owned();
    name.push(".");
    name.push(ending);
    PathBuf::from(name)
}
