//! Scenes on their way to be rendered: loaded, with everything chosen that they leave out.

use deepshadow::io::{
    ChosenShot, Described, MOST_FRAMES, SceneLoader, at_frame, choose_shot, frames_of,
    numbered_names,
};
use deepshadow::scene::automatic::{Choice, Surroundings, complete};
use deepshadow::scene::{self, SceneFile};
use deepshadow::settings::MapKind;
use deepshadow::{Error, Result, Settings};

use crate::backends::{Worker, named};
use crate::held::Taken;

/// Texels along each edge of maps that are made without a picture.
const MAP_SIZE: u32 = 512;

/// A scene that is ready to be loaded, without anything of Python's.
pub struct Request {
    pub described: Described,
    pub taken: Taken,
    /// Which frame, of a sequence.
    pub frame: Option<i64>,
}

/// A scene that is loaded.
pub struct Loaded {
    pub file: SceneFile,
    pub scene: scene::Scene,
    pub settings: Settings,
    pub windows: Vec<Option<[f32; 2]>>,
    pub choices: Vec<Choice>,
    pub notes: Vec<String>,
}

impl Loaded {
    /// The backend `name` for maps of `kind` of this scene.
    ///
    /// # Errors
    /// As [`named`].
    pub fn backend(&self, name: &str, kind: Option<MapKind>) -> Result<Worker> {
        named(name, kind.unwrap_or_default(), !self.scene.surfaces.is_empty())
    }

    /// The settings, for maps without a picture.
    pub fn map_settings(&self) -> Settings {
        let mut settings = self.settings.clone();
        if self.file.shadow.size.is_none() {
            settings.map.size = MAP_SIZE;
        }
        settings
    }
}

impl Request {
    /// Loads the volumes and surfaces, and chooses what was left out, as the program does.
    pub fn load(self) -> Result<Loaded> {
        let Self { mut described, taken, frame } = self;
        let _mounted = taken.mounted()?;
        described.file = of_frame(&described.file, frame)?;
        described.stand_up(&described.file.clone())?;
        let Described { file, surroundings, mut notes } = described;
        let scan = surroundings == Surroundings::Studio;
        let (loaded, said) = SceneLoader::default().load(&file, scan)?;
        notes.extend(said);
        let windows = loaded.volumes.iter().map(|own| own.window).collect();
        let (scene, settings, choices) = complete(&file, loaded, surroundings)?;
        Ok(Loaded { file, scene, settings, windows, choices, notes })
    }

    /// Chooses what the frames have in common.
    pub fn shot(self, frames: Option<Vec<i64>>, turns: Option<u32>) -> Result<Described> {
        let Self { mut described, taken, .. } = self;
        let _mounted = taken.mounted()?;
        let most = MOST_FRAMES as u32;
        let of_turn = turns.map(|turns| (1..=i64::from(turns.clamp(1, most))).collect());
        let frames = match frames {
            Some(mut frames) => {
                frames.sort_unstable();
                frames
            }
            None => match frames_of(&described.file)?.or(of_turn) {
                Some(frames) => frames,
                None => return Err(no_sequence()),
            },
        };
        let Some(&first) = frames.first() else {
            return Err(Error::value("frames", "there is none"));
        };
        let of_first = at_frame(&described.file, first)?;
        described.stand_up(&of_first)?;
        let file = described.file.clone();
        let ChosenShot { file, notes, .. } = choose_shot(
            &file,
            &frames,
            described.surroundings,
            turns,
            &mut SceneLoader::default(),
            &|frame| at_frame(&file, frame),
        )?;
        described.notes.extend(notes);
        Ok(Described { file, ..described })
    }
}

/// The scene file of a frame; of none, that of the first keyframe.
fn of_frame(file: &SceneFile, frame: Option<i64>) -> Result<SceneFile> {
    let numbered = numbered_names(file).next();
    let keyframes = file.keyframes()?;
    match (frame, numbered, keyframes) {
        (None, Some(name), _) => {
            let why = "stands for a sequence; say which frame, as in frame=1";
            Err(Error::contents(name.pattern(), why))
        }
        (None, None, None) => Ok(file.clone()),
        (Some(_), None, None) => Err(no_sequence()),
        (Some(frame), ..) => at_frame(file, frame),
        (None, None, Some(keyframes)) => at_frame(file, *keyframes.start()),
    }
}

fn no_sequence() -> Error {
    let why = "the scene has none: no number in a volume's name (smoke.####.vdb), no keyframes";
    Error::value("frame", why)
}
