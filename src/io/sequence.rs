//! Sequences: the frames that a scene file stands for, and what is chosen once for all of them.

use super::output::folder_of;
use super::{SceneLoader, files, is_numbered};
use crate::error::{Error, Result};
use crate::scene::automatic::{Choice, Shot, Surroundings};
use crate::scene::{NumberedName, SceneFile};

/// Most frames of a sequence.
pub const MOST_FRAMES: usize = 100_000;
/// Most frames from which is chosen what all have in common.
const MOST_SAMPLES: usize = 5;

/// The numbers of the frames of `file`, rising: those of the files that there are of its numbered
/// volumes, or from its first keyframe to the last; `None` if it is a single picture.
///
/// # Errors
/// If a folder cannot be read, if no file has such a name, or if there are more than
/// [`MOST_FRAMES`].
pub fn frames_of(file: &SceneFile) -> Result<Option<Vec<i64>>> {
    let numbered: Vec<NumberedName> = numbered_names(file).collect();
    let Some(first) = numbered.first() else {
        let Some(range) = file.keyframes()? else { return Ok(None) };
        let frames: Vec<i64> = range.take(MOST_FRAMES + 1).collect();
        return if frames.len() > MOST_FRAMES { Err(too_many()) } else { Ok(Some(frames)) };
    };
    let mut frames = files_of(first)?;
    frames.retain(|&frame| numbered[1..].iter().all(|name| files::exists(&name.at(frame))));
    Ok(Some(frames))
}

/// The names of the numbered volumes of `file`.
pub fn numbered_names(file: &SceneFile) -> impl Iterator<Item = NumberedName> {
    let numbered = file.volume.iter().filter(|table| is_numbered(table));
    numbered.filter_map(|table| NumberedName::of(table.path.as_deref()?))
}

/// The numbers of the files that have a name, rising.
///
/// # Errors
/// If the folder cannot be read, if no file has such a name, or if there are more than
/// [`MOST_FRAMES`].
pub fn files_of(name: &NumberedName) -> Result<Vec<i64>> {
    let folder = folder_of(name.pattern());
    let names = files::names_in(folder).map_err(|error| Error::file(folder, error))?;
    let mut numbers: Vec<i64> =
        names.iter().filter_map(|found| name.frame_of(found.to_str()?)).collect();
    if numbers.len() > MOST_FRAMES {
        return Err(too_many());
    }
    if numbers.is_empty() {
        // One that has the name with another number of digits.
        let near = names.iter().filter_map(|found| found.to_str());
        let why = match near.filter(|found| name.is_near(found)).min() {
            Some(other) => format!("no file has a name like this, but {other} is there"),
            None => "no file has a name like this, with a number in place of # or %d".to_owned(),
        };
        return Err(Error::contents(name.pattern(), why));
    }
    numbers.sort_unstable();
    Ok(numbers)
}

fn too_many() -> Error {
    Error::value("frames", format!("there are more than {MOST_FRAMES}"))
}

/// A few of the rising numbers `frames` that stand for all: the ends, and others between them.
pub fn some_of(frames: &[i64]) -> Vec<i64> {
    let last = frames.len().saturating_sub(1);
    let count = MOST_SAMPLES.min(frames.len());
    let at = |i: usize| frames[(i * last + (count - 1) / 2) / (count - 1).max(1)];
    (0..count).map(at).collect()
}

/// What was chosen for all frames of a sequence.
pub struct ChosenShot {
    /// The scene file with everything that its frames must have in common.
    pub file: SceneFile,
    /// What was chosen.
    pub choices: Vec<Choice>,
    /// What there is to say of the first frame's files, one line each.
    pub notes: Vec<String>,
}

/// Chooses what the rising numbers `frames` of `file` have in common, from a few of them. `file_at`
/// is the scene file of a frame ([`at_frame`](super::at_frame)); with `turns`, the camera goes once
/// around in so many frames.
///
/// # Errors
/// As [`SceneLoader::load`], [`Shot::look_at`] and [`Shot::chosen`], and if `turns` is not in
/// 2..[`MOST_FRAMES`].
pub fn choose_shot(
    file: &SceneFile,
    frames: &[i64],
    surroundings: Surroundings,
    turns: Option<u32>,
    loader: &mut SceneLoader,
    file_at: &dyn Fn(i64) -> Result<SceneFile>,
) -> Result<ChosenShot> {
    if let Some(turns) = turns.filter(|turns| !(2..=MOST_FRAMES as u32).contains(turns)) {
        return Err(Error::value("turns", format!("{turns} is not in 2..{MOST_FRAMES}")));
    }
    let scan = surroundings == Surroundings::Studio;
    let mut shot = Shot::new(file, frames, surroundings)?;
    let mut looked_at = None;
    let mut notes = Vec::new();
    for frame in some_of(frames) {
        let file = file_at(frame)?;
        let casters = (file.volume.clone(), file.mesh.clone(), file.hair.clone());
        let look = (casters, file.light.clone());
        // A camera alone makes no difference.
        if looked_at.as_ref() == Some(&look) {
            continue;
        }
        let (loaded, said) = loader.load(&file, scan)?;
        if looked_at.is_none() {
            notes = said;
        }
        shot.look_at(frame, &loaded)?;
        looked_at = Some(look);
    }
    let (file, choices) = shot.chosen(turns)?;
    Ok(ChosenShot { file, choices, notes })
}

#[cfg(test)]
mod tests {
    use super::some_of;

    #[test]
    fn a_few_frames_stand_for_all() {
        let of = |count: i64| some_of(&(1..=count).collect::<Vec<_>>());
        assert_eq!(of(9), [1, 3, 5, 7, 9]);
        assert_eq!(of(3), [1, 2, 3]);
        assert_eq!(of(100), [1, 26, 51, 75, 100]);
        assert_eq!(of(1), [1]);
        assert_eq!(of(0), [0; 0]);
    }
}
