//! What is open: a scene file that panels and hands change, and where it came from.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use deepshadow::io::{Described, at_frame, files_of, is_numbered, is_scene_file, numbered_names};
use deepshadow::scene::automatic::Surroundings;
use deepshadow::scene::file::{CameraTable, LightTable};
use deepshadow::scene::{Camera, Light, LightKind, Projection, SceneFile};
use deepshadow::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::engine::{Seen, as_text};

/// How many documents were opened.
static OPENED: AtomicU64 = AtomicU64::new(0);

/// A scene that is open.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Document {
    /// Its number: another one each time that something is opened.
    pub id: u64,
    /// The name of its input, as it was given.
    pub input: String,
    /// The scene. Keys that are left out are chosen when it is completed.
    #[serde(with = "as_text")]
    pub file: SceneFile,
    /// The scene as it was opened.
    #[serde(with = "as_text")]
    pub opened: SceneFile,
    /// What surrounds it where that is left out.
    pub surroundings: Surroundings,
    /// What was chosen when it was opened, one line each.
    pub notes: Vec<String>,
    /// The frames of a sequence, if it is one.
    pub frames: Option<RangeInclusive<i64>>,
    /// The frame that is shown.
    pub frame: i64,
    /// Which of its volumes are sequences of files.
    numbered: Vec<bool>,
}

impl Document {
    /// Opens what `input` names, as the program's commands do.
    ///
    /// # Errors
    /// If there is no such file and no such preset, or if it is a scene file with a mistake.
    pub fn open(input: &str) -> Result<Self> {
        let mut described = Described::of(input, false)?;
        let mut frames = described.file.keyframes()?;
        if let Some(name) = numbered_names(&described.file).next() {
            let files = files_of(&name)?;
            frames = Some(files[0]..=files[files.len() - 1]);
        }
        let frame = frames.as_ref().map_or(0, |frames| *frames.start());
        let of = at_frame(&described.file, frame)?;
        described.stand_up(&of)?;
        let Described { file, surroundings, notes } = described;
        check_numbers(&file)?;
        let input = input.to_owned();
        let id = OPENED.fetch_add(1, Ordering::Relaxed);
        let numbered = file.volume.iter().map(is_numbered).collect();
        let opened = file.clone();
        Ok(Self { id, input, file, opened, surroundings, notes, frames, frame, numbered })
    }

    /// It with a number of its own, if it was opened elsewhere.
    #[must_use]
    pub fn numbered_anew(mut self) -> Self {
        self.id = OPENED.fetch_add(1, Ordering::Relaxed);
        self
    }

    /// The scene file at the frame that is shown.
    ///
    /// # Errors
    /// If keyframes contradict each other.
    pub fn now(&self) -> Result<SceneFile> {
        if self.frames.is_none() {
            return Ok(self.file.clone());
        }
        let mut now = self.file.at_frame(self.frame)?;
        let tables = now.volume.iter_mut().zip(self.file.volume.iter());
        for ((own, table), _) in tables.zip(&self.numbered).filter(|(_, numbered)| !**numbered) {
            // A name that is that of a file keeps its `#`.
            own.path.clone_from(&table.path);
        }
        Ok(now)
    }

    /// The name for people: that of the file, without its folder.
    pub fn title(&self) -> String {
        let path = Path::new(&self.input);
        path.file_name().map_or_else(|| self.input.clone(), |name| name.display().to_string())
    }

    /// The input's name with another ending, in the current folder.
    pub fn default_output(&self, ending: &str) -> PathBuf {
        let stem = Path::new(&self.input).file_stem().unwrap_or_default();
        let mut name = stem.to_owned();
        name.push(".");
        name.push(ending);
        let path = PathBuf::from(name);
        // A scene must not replace the one that was opened.
        if is_scene_file(&path) && path == Path::new(&self.input) {
            return PathBuf::from(format!("{}-explored.{ending}", stem.display()));
        }
        path
    }

    /// Writes where the camera is.
    pub fn place_camera(&mut self, camera: &Camera) {
        let table = &mut self.file.camera;
        (table.azimuth_degrees, table.elevation_degrees) = (None, None);
        (table.distance, table.zoom, table.fit, table.keyframes) = (None, None, None, None);
        table.position = Some(camera.position.to_array());
        table.target = Some(camera.target.to_array());
        table.up = Some(camera.up.to_array());
        match camera.projection {
            Projection::Perspective { fov_y_degrees } => table.fov_y_degrees = Some(fov_y_degrees),
            Projection::Orthographic { height } => table.height = Some(height),
            _ => {}
        }
    }

    /// Lets the camera be chosen again.
    pub fn frame_camera(&mut self) {
        let kind = self.file.camera.kind.take();
        self.file.camera = CameraTable { kind, ..Default::default() };
    }

    /// Makes sure that the scene file has a table for each of the scene's lights.
    pub fn light_tables(&mut self, lights: &[Light]) {
        if self.file.light.is_empty() {
            // One light was chosen.
            place_light(self.file.light.one_mut(), lights.first());
        }
    }

    /// Writes where a light is, as far as it has a table.
    pub fn place_light(&mut self, index: usize, light: &Light) {
        self.light_tables(std::slice::from_ref(light));
        if let Some(table) = self.file.light.get_mut(index) {
            table.keyframes = None;
            place_light(table, Some(light));
        }
    }

    /// Fixes what was chosen for `scene` and would be chosen anew for every frame of a sequence.
    pub fn fix(&mut self, scene: &Seen) {
        for (table, body) in self.file.volume.iter_mut().zip(&scene.bodies) {
            let keyed = table.keyframes.iter().flatten().any(|one| one.density_scale.is_some());
            if !keyed {
                table.density_scale.get_or_insert(body.density_scale);
            }
        }
        if let Some(ground) = scene.ground {
            self.file.ground.height.get_or_insert(ground.height);
        }
        if self.file.camera.keyframes.is_none() {
            self.place_camera(&scene.camera);
        }
    }
}

/// Writes where a light is and where it shines.
pub fn place_light(table: &mut LightTable, light: Option<&Light>) {
    match light.map(|light| light.kind) {
        Some(LightKind::Directional { direction }) => {
            table.direction = Some(direction.to_array());
        }
        Some(LightKind::Point { position }) => table.position = Some(position.to_array()),
        Some(LightKind::Spot { position, direction, .. }) => {
            table.position = Some(position.to_array());
            table.direction = Some(direction.to_array());
        }
        _ => {}
    }
}

/// Checks that all numbers of a scene file are numbers: what is not equals nothing, not even itself, so
/// it would count as changed all the time.
///
/// # Errors
/// With the key of one that is not.
pub fn check_numbers(file: &SceneFile) -> Result<()> {
    let table = toml::Table::try_from(file);
    let table = table.map_err(|error| Error::value("scene", error.to_string()))?;
    match not_a_number(&toml::Value::Table(table)) {
        Some(key) => Err(Error::value(key, "nan is not a number")),
        None => Ok(()),
    }
}

/// The key of a number that is none.
fn not_a_number(value: &toml::Value) -> Option<String> {
    match value {
        toml::Value::Float(number) => number.is_nan().then(String::new),
        toml::Value::Array(values) => values.iter().find_map(not_a_number),
        toml::Value::Table(table) => table.iter().find_map(|(key, value)| {
            let within = not_a_number(value)?;
            Some(if within.is_empty() { key.clone() } else { format!("{key}.{within}") })
        }),
        _ => None,
    }
}
