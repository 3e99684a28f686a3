//! Turns arguments into a job: the scene, how to compute it, and the backend.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::arguments::{PictureArguments, SceneArguments, SourceArguments};
use super::backend::{BackendChoice, Opening};
use super::progress::Bars;
use super::say;
use super::stage::{Side, look_at_patient};
use super::surfaces;
use super::volumes::Volumes;
use crate::backend::{Backend, Expected};
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::image::{Exposure, ToneMap};
use crate::io::{Format, Inputs, source_files, superior_axis, surface_files};
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Choice, Loaded, Surroundings, complete};
use crate::scene::file::VolumeTable;
use crate::scene::{NumberedName, Scene, SceneFile};
use crate::settings::{MapKind, Settings};
use crate::volume::presets::Preset;

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
        let Described { mut file, surroundings, said } = described(source)?;
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
        Ok(Self { source, choice, file, surroundings, said, side: None, picture: false, inputs })
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
        let (loaded, notes) = Volumes::default().load(&self.file, scan)?;
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
        let mut known = None;
        for (index, table) in of.volume.iter().enumerate() {
            let Some(axis) = superior_axis(table)? else { continue };
            let own = &mut self.file.volume[index].up;
            if own.is_none() && self.surroundings == Surroundings::Studio {
                *own = Some(axis.name().to_owned());
                self.said.push(format!(
                    "up (`volume.up`) {}, where the patient's head is (chosen)",
                    axis.name()
                ));
            }
            let up = own.as_deref().map(str::parse).transpose()?.unwrap_or_default();
            known = known.or(Some(up));
        }
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
        (crew, std::mem::take(&mut self.said))
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

/// What an input says.
struct Described {
    file: SceneFile,
    surroundings: Surroundings,
    /// Lines for people.
    said: Vec<String>,
}

/// The scene file that the input of `source` is or stands for.
fn described(source: &SourceArguments) -> Result<Described> {
    let mut said = Vec::new();
    let input = &*source.input;
    // Anything may be raw.
    let is_raw = source.file.dims.is_some() || source.file.from.is_some();
    let path = Path::new(input);
    let mut file = SceneFile::default();
    if Preset::from_str(input).is_ok() && !path.is_file() {
        file.volume.one_mut().preset = Some(input.to_owned());
    } else if is_scene_file(path) {
        let text = fs::read_to_string(path).map_err(|error| Error::file(path, error))?;
        file = SceneFile::parse(&text, path)?;
    } else if let Some(format) = surface_format(path).filter(|_| !is_raw) {
        let named = Some(path.to_owned());
        match format {
            Format::Hair | Format::TressFx => file.hair.one_mut().path = named,
            _ => file.mesh.one_mut().path = named,
        }
    } else if path.exists() || NumberedName::of(path).is_some() {
        file.volume.one_mut().path = Some(path.to_owned());
    } else {
        return Err(not_there(path));
    }
    let surroundings = Surroundings::of(&file);
    let unsaid = [
        ("ambient light", file.ambient.radiance.is_none()),
        ("background", file.background.radiance.is_none()),
    ];
    let unsaid: Vec<&str> = unsaid.iter().filter_map(|(what, is)| is.then_some(*what)).collect();
    if surroundings == Surroundings::Void && !unsaid.is_empty() && !file.is_bare() {
        let unsaid = unsaid.join(" and no ");
        said.push(format!("no {unsaid}, as the scene file has absolute numbers (chosen)"));
    }
    for table in file.volume.iter_mut() {
        if let Some(values) = table.take_presets()? {
            said.push(format!("{values} (chosen by the preset)"));
        }
    }
    Ok(Described { file, surroundings, said })
}

/// The format of a file of hair or a mesh; `None` for all others.
fn surface_format(path: &Path) -> Option<Format> {
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    let format = is_file.then(|| Format::of_file(path).ok()).flatten();
    format.filter(|format| format.is_surface())
}

/// Whether a name is that of a scene file.
pub(super) fn is_scene_file(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// The scene file of a frame. A name that is that of a file keeps its `#`.
pub(super) fn at_frame(file: &SceneFile, frame: i64) -> Result<SceneFile> {
    let mut of_frame = file.at_frame(frame)?;
    for (own, table) in of_frame.volume.iter_mut().zip(file.volume.iter()) {
        if !is_numbered(table) {
            own.path.clone_from(&table.path);
        }
    }
    Ok(of_frame)
}

/// Whether a table's volume is a sequence of files.
pub(super) fn is_numbered(table: &VolumeTable) -> bool {
    table.path.as_deref().is_some_and(|path| NumberedName::of(path).is_some() && !path.exists())
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
