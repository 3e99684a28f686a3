//! What the name of an input stands for: a preset, a scene file, or a file of a volume, of hair or of
//! a mesh, as a scene file. Nothing large is read.

use std::io;
use std::path::Path;
use std::str::FromStr;

use super::files;
use super::format::Format;
use super::load::superior_axis;
use crate::error::{Error, Result};
use crate::scene::automatic::Surroundings;
use crate::scene::file::VolumeTable;
use crate::scene::{NumberedName, SceneFile};
use crate::volume::Axis;
use crate::volume::presets::Preset;

/// What an input stands for.
#[derive(Clone, Debug)]
pub struct Described {
    /// The scene file that it is, or that names it.
    pub file: SceneFile,
    /// What surrounds its volumes where that is left out.
    pub surroundings: Surroundings,
    /// What was chosen so far, one line each, for people.
    pub notes: Vec<String>,
}

impl Described {
    /// What `input` stands for: the name of a preset, else the name of a file, or one with `#` or
    /// `%04d` in place of a frame's number. If it `is_raw`, a file is a volume whatever its contents
    /// look like.
    ///
    /// # Errors
    /// If there is no such preset and no such file, or if it is a scene file with a mistake.
    pub fn of(input: &str, is_raw: bool) -> Result<Self> {
        let path = Path::new(input);
        let mut file = SceneFile::default();
        if Preset::from_str(input).is_ok() && !files::is_file(path) {
            file.volume.one_mut().preset = Some(input.to_owned());
        } else if is_scene_file(path) {
            let text = files::read_to_string(path).map_err(|error| Error::file(path, error))?;
            file = SceneFile::parse(&text, path)?;
        } else if let Some(format) = surface_format(path).filter(|_| !is_raw) {
            let named = Some(path.to_owned());
            match format {
                Format::Hair | Format::TressFx => file.hair.one_mut().path = named,
                _ => file.mesh.one_mut().path = named,
            }
        } else if files::exists(path) || NumberedName::of(path).is_some() {
            file.volume.one_mut().path = Some(path.to_owned());
        } else {
            return Err(not_there(path));
        }
        Self::of_file(file)
    }

    /// What a scene file stands for.
    ///
    /// # Errors
    /// If it names a preset that there is not.
    pub fn of_file(mut file: SceneFile) -> Result<Self> {
        let mut notes = Vec::new();
        let surroundings = Surroundings::of(&file);
        let unsaid = [
            ("ambient light", file.ambient.radiance.is_none()),
            ("background", file.background.radiance.is_none()),
        ];
        let unsaid: Vec<&str> =
            unsaid.iter().filter_map(|(what, is)| is.then_some(*what)).collect();
        let is_chosen = file.surroundings.is_none() && !file.is_bare();
        if surroundings == Surroundings::Void && !unsaid.is_empty() && is_chosen {
            let unsaid = unsaid.join(" and no ");
            notes.push(format!("no {unsaid}, as the scene file has absolute numbers (chosen)"));
        }
        for table in file.volume.iter_mut() {
            if let Some(values) = table.take_presets()? {
                notes.push(format!("{values} (chosen by the preset)"));
            }
        }
        Ok(Self { file, surroundings, notes })
    }

    /// Lets patients stand, whose axes the files of `of` know, unless the scene says what is up or
    /// its values are absolute. Returns the axis that is up in the first scan that knows its
    /// patient's axes.
    ///
    /// # Errors
    /// If the header of a volume cannot be read.
    pub fn stand_up(&mut self, of: &SceneFile) -> Result<Option<Axis>> {
        let mut known = None;
        for (index, table) in of.volume.iter().enumerate() {
            let Some(axis) = superior_axis(table)? else { continue };
            let own = &mut self.file.volume[index].up;
            if own.is_none() && self.surroundings == Surroundings::Studio {
                *own = Some(axis.name().to_owned());
                self.notes.push(format!(
                    "up (`volume.up`) {}, where the patient's head is (chosen)",
                    axis.name()
                ));
            }
            let up = own.as_deref().map(str::parse).transpose()?.unwrap_or_default();
            known = known.or(Some(up));
        }
        Ok(known)
    }
}

/// The format of a file of hair or a mesh; `None` for all others.
fn surface_format(path: &Path) -> Option<Format> {
    let format = files::is_file(path).then(|| Format::of_file(path).ok()).flatten();
    format.filter(|format| format.is_surface())
}

/// Whether a name is that of a scene file.
pub fn is_scene_file(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// The scene file of a frame. A name that is that of a file keeps its `#`.
///
/// # Errors
/// As [`SceneFile::at_frame`].
pub fn at_frame(file: &SceneFile, frame: i64) -> Result<SceneFile> {
    let mut of_frame = file.at_frame(frame)?;
    for (own, table) in of_frame.volume.iter_mut().zip(file.volume.iter()) {
        if !is_numbered(table) {
            own.path.clone_from(&table.path);
        }
    }
    Ok(of_frame)
}

/// Whether a table's volume is a sequence of files.
pub fn is_numbered(table: &VolumeTable) -> bool {
    let path = table.path.as_deref();
    path.is_some_and(|path| NumberedName::of(path).is_some() && !files::exists(path))
}

/// The error for an input that is neither a file nor a preset.
pub fn not_there(path: &Path) -> Error {
    let presets = Preset::ALL.map(Preset::name).join(", ");
    let why = format!("no such file, and not one of the presets ({presets})");
    Error::file(path, io::Error::new(io::ErrorKind::NotFound, why))
}
