//! Which frames are rendered: by options, keyframes, and the files that there are.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;

use super::files::{check_files, common_name, gaps};
use crate::cli::arguments::parse;
use crate::error::{Error, Result};
use crate::io::{MOST_FRAMES, at_frame, files_of, is_numbered, is_scene_file, numbered_names};
use crate::scene::{NumberedName, SceneFile};

/// Options on sequences of pictures.
#[derive(Debug, Args)]
pub(super) struct FrameArguments {
    /// Further volume files: one frame each, after INPUT.
    #[arg(value_name = "INPUTS")]
    more: Vec<PathBuf>,
    /// Frames to render of a sequence (smoke.####.vdb, smoke.%04d.vdb, several inputs) or a scene
    /// with keyframes: A-B, every Sth as A-BxS, or one [all].
    #[arg(long, value_name = "A-B", value_parser = parse::<FrameRange>, allow_hyphen_values = true, help_heading = "Frames")]
    frames: Option<FrameRange>,
    /// Frames in which the camera goes once around, while the light stands still; of a single
    /// volume so many are rendered.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000), help_heading = "Frames")]
    turntable: Option<u32>,
    /// Keep frames that are there already, whole and made with the same settings.
    #[arg(long, help_heading = "Frames")]
    pub resume: bool,
    /// Render the Ith of N parts of the frames, for several processes or machines; what is chosen
    /// is chosen for all of them.
    #[arg(long, value_name = "I/N", value_parser = parse::<Shard>, help_heading = "Frames")]
    shard: Option<Shard>,
}

/// A range of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FrameRange {
    first: i64,
    last: i64,
    step: usize,
}

impl FromStr for FrameRange {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            let why = format!("'{text}' is not a range of frames such as 1-24, 1-24x2, or 7");
            Error::value("frames", why)
        };
        let (range, step) = text.split_once('x').unwrap_or((text, "1"));
        // A number may begin with a sign.
        let ends = match range.char_indices().skip(1).find(|(_, c)| *c == '-') {
            Some((at, _)) => [&range[..at], &range[at + 1..]],
            None => [range; 2],
        };
        let [first, last] = ends.map(|end| end.trim().parse().ok());
        match (first, last, step.parse().ok()) {
            (Some(first), Some(last), Some(step)) if first <= last && step > 0 => {
                Ok(Self { first, last, step })
            }
            (Some(first), Some(last), Some(_)) if first > last => {
                Err(Error::value("frames", format!("'{text}' ends before it begins")))
            }
            _ => Err(wrong()),
        }
    }
}

impl FrameRange {
    fn frames(self) -> impl Iterator<Item = i64> {
        (self.first..=self.last).step_by(self.step)
    }
}

/// A part of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shard {
    /// From 1.
    part: usize,
    parts: usize,
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let numbers = text.split_once('/').map(|(part, parts)| (part.parse(), parts.parse()));
        match numbers {
            Some((Ok(part), Ok(parts))) if (1..=parts).contains(&part) => Ok(Self { part, parts }),
            _ => {
                let why = format!("'{text}' is not a part such as 2/8: the second of eight");
                Err(Error::value("shard", why))
            }
        }
    }
}

/// The frames of a sequence.
pub(super) struct Wanted {
    /// All of them, rising.
    pub all: Vec<i64>,
    /// Those to be rendered now.
    pub mine: Vec<i64>,
    /// Those for which is chosen what all have in common: also others, if no file is missing.
    pub chosen_for: Vec<i64>,
    /// By frame, where the volume's files have no common numbered name.
    listed: Vec<PathBuf>,
    pub turns: Option<u32>,
    pub resume: bool,
    /// The input's name with a place for the frame's number.
    pub name: String,
    /// What there is to say of the frames.
    pub note: Option<String>,
}

impl FrameArguments {
    /// The frames of `file`, in which several inputs become one numbered name if they can; `None`
    /// for a single picture.
    ///
    /// # Errors
    /// If options contradict each other or the scene, or if files are missing.
    pub(super) fn wanted(&self, input: &str, file: &mut SceneFile) -> Result<Option<Wanted>> {
        let (mut numbers, listed) = self.inputs(input, file)?;
        let keyframes = file.keyframes()?;
        let numbered: Vec<NumberedName> = numbered_names(file).collect();
        if let (None, Some(first)) = (&numbers, numbered.first()) {
            numbers = Some(files_of(first)?);
        }
        let note = numbers.as_deref().filter(|_| self.frames.is_none()).and_then(gaps);
        let is_sequence = numbers.is_some() || keyframes.is_some() || self.turntable.is_some();
        if !is_sequence {
            return match (self.frames, self.resume, self.shard) {
                (None, false, None) => Ok(None),
                (frames, resume, _) => {
                    let what = match (frames, resume) {
                        (Some(_), _) => "frames",
                        (None, true) => "resume",
                        (None, false) => "shard",
                    };
                    let why = "needs frames that differ: a number in the input's name \
                               (smoke.####.vdb), several inputs, keyframes or --turntable";
                    Err(Error::value(what, why))
                }
            };
        }
        let turned = self.turntable.map(|count| 1..=i64::from(count));
        let range = keyframes.or(turned);
        let at_most = |frames: &mut dyn Iterator<Item = i64>| {
            let frames: Vec<i64> = frames.take(MOST_FRAMES + 1).collect();
            let why = || format!("there are more than {MOST_FRAMES}");
            if frames.len() > MOST_FRAMES { Err(Error::value("frames", why())) } else { Ok(frames) }
        };
        let all = match (self.frames, &numbers, &range) {
            (Some(frames), ..) => at_most(&mut frames.frames())?,
            (None, Some(numbers), _) => numbers.clone(),
            (None, None, range) => at_most(&mut range.clone().into_iter().flatten())?,
        };
        for name in &numbered {
            check_files(name, &all, numbers.as_deref())?;
        }
        let chosen_for = match (range, numbers) {
            // Frames are alike whichever of them are rendered.
            (_, Some(mut numbers)) => {
                numbers.retain(|frame| numbered.iter().all(|name| name.at(*frame).exists()));
                if numbers.is_empty() { all.clone() } else { numbers }
            }
            (Some(range), None) => {
                let (first, last) = (all[0].min(*range.start()), all[all.len() - 1]);
                at_most(&mut (first..=last.max(*range.end())))?
            }
            (None, None) => all.clone(),
        };
        if !listed.is_empty() && all.iter().any(|&frame| listed_at(&listed, frame).is_none()) {
            let why = format!("the inputs are frames 1 to {}", listed.len());
            return Err(Error::value("frames", why));
        }
        let shard = self.shard.unwrap_or(Shard { part: 1, parts: 1 });
        let mine = all.iter().copied().skip(shard.part - 1).step_by(shard.parts).collect();
        let name = numbered_name(input, file);
        let (turns, resume) = (self.turntable, self.resume);
        Ok(Some(Wanted { all, mine, chosen_for, listed, turns, resume, name, note }))
    }

    /// The numbers of several inputs, and the inputs themselves if they have no common name.
    fn inputs(
        &self,
        input: &str,
        file: &mut SceneFile,
    ) -> Result<(Option<Vec<i64>>, Vec<PathBuf>)> {
        if self.more.is_empty() {
            return Ok((None, Vec::new()));
        }
        let first = match &file.volume[..] {
            [table]
                if !is_scene_file(Path::new(input))
                    && self.more.iter().all(|path| !is_scene_file(path)) =>
            {
                table.path.clone()
            }
            _ => None,
        };
        let Some(first) = first else {
            let why = "several inputs are the frames of one volume: files, no scenes or presets";
            return Err(Error::value("input", why));
        };
        let paths: Vec<PathBuf> = std::iter::once(first).chain(self.more.iter().cloned()).collect();
        for path in &paths {
            if !path.exists() {
                let why = "no such file; all inputs are files, the frames of one volume";
                return Err(Error::contents(path, why));
            }
            if path.extension() != paths[0].extension() {
                let why = format!("not a frame of the sequence of {}", paths[0].display());
                return Err(Error::contents(path, why));
            }
        }
        if let Some((name, mut numbers)) = common_name(&paths) {
            numbers.sort_unstable();
            file.volume.one_mut().path = Some(name);
            return Ok((Some(numbers), Vec::new()));
        }
        Ok((Some((1..=paths.len() as i64).collect()), paths))
    }
}

impl Wanted {
    /// The scene file of a frame.
    ///
    /// # Errors
    /// As [`SceneFile::at_frame`].
    pub(super) fn file_at(&self, file: &SceneFile, frame: i64) -> Result<SceneFile> {
        let mut file = at_frame(file, frame)?;
        if let Some(path) = listed_at(&self.listed, frame) {
            file.volume.one_mut().path = Some(path.clone());
        }
        Ok(file)
    }

    /// Whether the scene file alone tells the files of all frames.
    pub(super) fn is_in_file(&self) -> bool {
        self.listed.is_empty()
    }
}

fn listed_at(listed: &[PathBuf], frame: i64) -> Option<&PathBuf> {
    listed.get(usize::try_from(frame.checked_sub(1)?).ok()?)
}

/// The name after which pictures are called: that of a numbered volume which is the input, or else
/// the input's with a place for a number.
fn numbered_name(input: &str, file: &SceneFile) -> String {
    if let [table] = &file.volume[..]
        && is_numbered(table)
        && !is_scene_file(Path::new(input))
    {
        return table.path.clone().unwrap_or_default().display().to_string();
    }
    let stem = Path::new(input).file_stem().unwrap_or_default();
    format!("{}.####.input", stem.display())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn ranges_of_frames_are_parsed() {
        let frames = |text: &str| FrameRange::from_str(text).unwrap().frames().collect::<Vec<_>>();
        assert_eq!(frames("3-6"), [3, 4, 5, 6]);
        assert_eq!(frames("7"), [7]);
        assert_eq!(frames("-2-1"), [-2, -1, 0, 1]);
        assert_eq!(frames("-3--2"), [-3, -2]);
        assert_eq!(frames("1-10x4"), [1, 5, 9]);
        for text in ["", "5-3", "1-", "a", "1-4x0", "1-4x", "1..4", "1,2"] {
            let error = FrameRange::from_str(text).unwrap_err().to_string();
            assert!(error.starts_with("frames: "), "{error}");
        }
    }

    #[test]
    fn parts_of_frames_are_parsed() {
        assert_eq!(Shard::from_str("2/3").unwrap(), Shard { part: 2, parts: 3 });
        for text in ["0/3", "4/3", "1", "1/", "a/b", "1/0"] {
            assert!(Shard::from_str(text).is_err(), "{text}");
        }
    }
}
