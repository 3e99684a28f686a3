//! Scene files that move: values at numbered frames, and the scene file of a single frame.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::file::{CameraTable, LightTable, SceneFile, SurfaceTable, VolumeTable, tables};
use super::numbered::NumberedName;
use crate::error::{Error, Result};

tables! {
    /// An entry of `[camera]`'s `keyframes`: what the keys of [`CameraTable`] are at `frame`.
    CameraKeyframe {
        frame: i64,
        position: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        fov_y_degrees: f64,
        height: f64,
        azimuth_degrees: f64,
        elevation_degrees: f64,
        distance: f64,
        zoom: f64,
    }
    /// An entry of `[light]`'s `keyframes`: what the keys of [`LightTable`] are at `frame`.
    LightKeyframe {
        frame: i64,
        direction: [f64; 3],
        position: [f64; 3],
        irradiance: [f64; 3],
        cone_degrees: f64,
        cone_softness: f64,
    }
    /// An entry of the `keyframes` of `[mesh]` and `[hair]`: what their keys are at `frame`.
    PlaceKeyframe {
        frame: i64,
        translate: [f64; 3],
        rotate_degrees: [f64; 3],
        scale: f64,
    }
    /// An entry of `[volume]`'s `keyframes`: what the keys of [`VolumeTable`] are at `frame`.
    VolumeKeyframe {
        frame: i64,
        translate: [f64; 3],
        rotate_degrees: [f64; 3],
        scale: f64,
        density_scale: f64,
        albedo: [f64; 3],
        phase_g: f64,
        tint: [f64; 3],
    }
}

/// A value of a key, which is interpolated number by number.
trait Value: Copy {
    fn number(&self, index: usize) -> f64;
    fn of(number: impl Fn(usize) -> f64) -> Self;
}

impl Value for f64 {
    fn number(&self, _: usize) -> f64 {
        *self
    }
    fn of(number: impl Fn(usize) -> f64) -> Self {
        number(0)
    }
}

impl Value for [f64; 3] {
    fn number(&self, index: usize) -> f64 {
        self[index]
    }
    fn of(number: impl Fn(usize) -> f64) -> Self {
        std::array::from_fn(number)
    }
}

/// Replaces keys of a table by their values at a frame, as far as keyframes have them.
macro_rules! set {
    ($table:expr, $keyframes:expr, $at:expr; $($key:ident)*) => {
        $({
            let known = $keyframes.iter().filter_map(|one| Some((one.frame? as f64, one.$key?)));
            if let Some(value) = value_at(&known.collect::<Vec<_>>(), $at) {
                $table.$key = Some(value);
            }
        })*
    };
}

/// The value at frame `at` of a key that is known at some frames, in order: its monotone cubic
/// interpolant (Fritsch and Butland 1984), which goes through all values, is smooth and never
/// leaves the range between two neighbours. Two values are joined by a line. Before the first and
/// after the last it stands still. `None` if it is known nowhere.
fn value_at<V: Value>(known: &[(f64, V)], at: f64) -> Option<V> {
    let (first, last) = (known.first()?, known.last()?);
    let after = known.partition_point(|(frame, _)| *frame <= at);
    if after == 0 {
        return Some(first.1);
    }
    if after == known.len() {
        return Some(last.1);
    }
    let index = after - 1;
    Some(V::of(|number| {
        let point = |i: usize| (known[i].0, known[i].1.number(number));
        let rise = |i: usize| {
            let ((x0, y0), (x1, y1)) = (point(i), point(i + 1));
            ((y1 - y0) / (x1 - x0), x1 - x0)
        };
        let slope =
            |i: usize| match (i.checked_sub(1).map(rise), (i + 1 < known.len()).then(|| rise(i))) {
                (Some((before, h0)), Some((behind, h1))) => {
                    if before * behind <= 0.0 {
                        0.0
                    } else {
                        3.0 * (h0 + h1) / ((2.0 * h1 + h0) / before + (h1 + 2.0 * h0) / behind)
                    }
                }
                (Some((only, _)), None) | (None, Some((only, _))) => only,
                (None, None) => 0.0,
            };
        let ((x0, y0), (_, y1)) = (point(index), point(index + 1));
        let (secant, width) = rise(index);
        let t = (at - x0) / width;
        // The line, and what bends it.
        let bend = (1.0 - t) * (slope(index) - secant) - t * (slope(index + 1) - secant);
        y0 + (y1 - y0) * t + width * t * (1.0 - t) * bend
    }))
}

/// The frames of keyframes, which must be given and rise.
fn checked(what: &str, frames: impl Iterator<Item = Option<i64>>) -> Result<Vec<i64>> {
    let frames: Option<Vec<i64>> = frames.collect();
    let wrong = |why: &str| Err(Error::value(format!("{what}.keyframes"), why));
    match frames {
        None => wrong("each needs a frame"),
        Some(frames) if frames.is_sorted_by(|a, b| a < b) => Ok(frames),
        Some(_) => wrong("their frames must rise"),
    }
}

impl CameraTable {
    fn move_to(&mut self, frame: f64) {
        let keyframes = self.keyframes.take().unwrap_or_default();
        set!(self, keyframes, frame; position target up fov_y_degrees height azimuth_degrees
            elevation_degrees distance zoom);
    }
}

impl LightTable {
    fn move_to(&mut self, frame: f64) {
        let keyframes = self.keyframes.take().unwrap_or_default();
        set!(self, keyframes, frame; direction position irradiance cone_degrees cone_softness);
    }
}

impl SurfaceTable {
    fn move_to(&mut self, frame: f64) {
        let keyframes = self.keyframes.take().unwrap_or_default();
        set!(self, keyframes, frame; translate rotate_degrees scale);
    }
}

impl VolumeTable {
    fn move_to(&mut self, frame: f64) {
        let keyframes = self.keyframes.take().unwrap_or_default();
        set!(self, keyframes, frame; translate rotate_degrees scale density_scale albedo phase_g
            tint);
    }
}

impl SceneFile {
    /// The frames from the first to the last keyframe; `None` if nothing has keyframes.
    ///
    /// # Errors
    /// If a keyframe has no frame, or those of a table do not rise.
    pub fn keyframes(&self) -> Result<Option<RangeInclusive<i64>>> {
        let mut frames = Vec::new();
        for table in self.volume.iter() {
            let keyframes = table.keyframes.iter().flatten();
            frames.extend(checked("volume", keyframes.map(|one| one.frame))?);
        }
        for (what, table) in self.surfaces() {
            let keyframes = table.keyframes.iter().flatten();
            frames.extend(checked(what, keyframes.map(|one| one.frame))?);
        }
        for table in self.light.iter() {
            let keyframes = table.keyframes.iter().flatten();
            frames.extend(checked("light", keyframes.map(|one| one.frame))?);
        }
        let keyframes = self.camera.keyframes.iter().flatten();
        frames.extend(checked("camera", keyframes.map(|one| one.frame))?);
        let ends = frames.iter().min().zip(frames.iter().max());
        Ok(ends.map(|(first, last)| *first..=*last))
    }

    /// Whether the names of volume files hold the number of a frame.
    pub fn is_numbered(&self) -> bool {
        self.volume
            .iter()
            .any(|table| table.path.as_deref().is_some_and(|path| NumberedName::of(path).is_some()))
    }

    /// The scene file of frame `frame`: numbers in the names of volume files, and the values of
    /// keyframes, which are then gone. Angles are interpolated as numbers, and values stand still
    /// before the first and after the last keyframe.
    ///
    /// # Errors
    /// As [`SceneFile::keyframes`].
    pub fn at_frame(&self, frame: i64) -> Result<Self> {
        self.keyframes()?;
        let mut file = self.clone();
        for table in file.volume.iter_mut() {
            if let Some(path) = &mut table.path
                && let Some(name) = NumberedName::of(path)
            {
                *path = name.at(frame);
            }
            table.move_to(frame as f64);
        }
        file.surfaces_mut().for_each(|table| table.move_to(frame as f64));
        for table in file.light.iter_mut() {
            table.move_to(frame as f64);
        }
        file.camera.move_to(frame as f64);
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::Path;

    use super::*;

    #[test]
    fn values_go_through_their_keyframes_without_overshooting() {
        let known = [(1.0, 2.0), (3.0, 6.0), (4.0, 6.0), (9.0, -1.0)];
        for (frame, value) in known {
            assert_eq!(value_at(&known, frame), Some(value));
        }
        assert_eq!((value_at(&known, -5.0), value_at(&known, 50.0)), (Some(2.0), Some(-1.0)));
        let mut last = f64::MAX;
        for i in 0..=500 {
            let at = 4.0 + f64::from(i) / 100.0;
            let value: f64 = value_at(&known, at).unwrap();
            assert!(value <= last && (-1.0..=6.0).contains(&value), "{at}: {value}");
            last = value;
        }
        for at in [3.25, 3.5, 3.75] {
            assert_eq!(value_at(&known, at), Some(6.0));
        }
        // Smooth where pieces meet, with the slope of the weighted harmonic mean.
        let known = [(0.0, 0.0), (2.0, 2.0), (3.0, 6.0)];
        let slope = 3.0 * 3.0 / ((2.0 * 1.0 + 2.0) / 1.0 + (1.0 + 2.0 * 2.0) / 4.0);
        for at in [1.999_999, 2.000_001] {
            let step = (value_at::<f64>(&known, at).unwrap() - 2.0) / (at - 2.0);
            assert!((step - slope).abs() < 1e-4, "{step} for {slope}");
        }
    }

    #[test]
    fn two_keyframes_are_joined_by_a_line() {
        let known = [(1.0, [0.0, 1.0, 8.0]), (5.0, [4.0, 1.0, 0.0])];
        assert_eq!(value_at(&known, 2.0), Some([1.0, 1.0, 6.0]));
        assert_eq!(value_at(&known, 4.0), Some([3.0, 1.0, 2.0]));
        assert_eq!(value_at::<f64>(&[], 4.0), None);
    }

    #[test]
    fn a_frame_is_a_scene_file_without_keyframes() {
        let text = "[[volume]]\npath = 'smoke.####.vdb'\nkeyframes = [{ frame = 2, scale = 1.0 }, \
                    { frame = 4, scale = 3.0, translate = [0, 1, 0] }]\n\
                    [light]\nkeyframes = [{ frame = 1, direction = [0, -1, 0] }]\n\
                    [camera]\nkeyframes = [{ frame = 3, zoom = 2.0 }, { frame = 7, zoom = 1.0 }]";
        let file = SceneFile::parse(text, Path::new("shots/a.toml")).unwrap();
        assert_eq!(file.keyframes().unwrap(), Some(1..=7));
        assert!(file.is_numbered());
        let frame = file.at_frame(3).unwrap();
        assert_eq!(frame.keyframes().unwrap(), None);
        let volume = &frame.volume[0];
        assert_eq!(volume.path.as_deref(), Some(Path::new("shots/smoke.0003.vdb")));
        assert_eq!((volume.scale, volume.translate), (Some(2.0), Some([0.0, 1.0, 0.0])));
        assert_eq!(frame.light[0].direction, Some([0.0, -1.0, 0.0]));
        assert_eq!((frame.camera.zoom, frame.camera.position), (Some(2.0), None));
        let saved = file.to_text().unwrap();
        assert_eq!(SceneFile::parse(&saved, Path::new("b.toml")).unwrap(), file);
        assert_eq!(SceneFile::default().keyframes().unwrap(), None);
    }

    #[test]
    fn mistakes_in_keyframes_are_named() {
        for (text, named) in [
            ("[camera]\nkeyframes = [{ zoom = 1.0 }]", "camera.keyframes: each needs a frame"),
            ("[light]\nkeyframes = [{ frame = 2 }, { frame = 2 }]", "light.keyframes: their"),
            ("[volume]\nkeyframes = [{ frame = 2 }, { frame = 1 }]", "volume.keyframes: their"),
        ] {
            let file = SceneFile::parse(text, Path::new("a.toml")).unwrap();
            let error = file.at_frame(1).unwrap_err().to_string();
            assert!(error.contains(named), "{error}");
        }
        let text = "[camera]\nkeyframes = [{ frame = 1, fov = 3.0 }]";
        let error = SceneFile::parse(text, Path::new("a.toml")).unwrap_err().to_string();
        assert!(error.contains("fov"), "{error}");
    }
}
