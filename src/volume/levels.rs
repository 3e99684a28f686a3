//! Turns stored values into densities: unchanged, mapped to 0..1, or moved by an offset so that
//! none is below 0. Knows no transfer function, only the range of values that it covers.

use std::sync::Arc;

use super::ranks::Ranks;
use super::{Volume, Voxels};
use crate::error::{Error, Result};
use crate::parallel;

/// How stored values become densities, which are never below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Levels {
    /// Unchanged; values below 0 and values that are not finite count as 0.
    #[default]
    AsStored,
    /// The window's ends become 0 and 1. Values outside of it are clamped, voxel by voxel, before
    /// interpolation.
    Window([f32; 2]),
    /// An offset is added to all values ([`super::Volume::moved_by`]), so that values are
    /// interpolated between voxels as they are stored. This is for functions over the range from
    /// the first to the second value. Values further from it than sixteen times its width are
    /// clamped, which keeps the others' digits.
    Moved([f32; 2]),
}

impl From<Option<[f32; 2]>> for Levels {
    fn from(window: Option<[f32; 2]>) -> Self {
        window.map_or(Self::AsStored, Self::Window)
    }
}

/// What was done to stored values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moved {
    /// The offset added to each.
    pub by: f32,
    /// The range of the stored values without a few outliers, if they were moved.
    pub stored: Option<[f32; 2]>,
}

/// How far beyond a function's range values are kept, in widths of the range.
const REACH: f32 = 16.0;

impl Levels {
    /// Turns stored values into densities, except that values below 0 or not finite may remain.
    ///
    /// # Errors
    /// If the two values do not rise or are not finite.
    pub(super) fn apply(self, voxels: &mut Voxels) -> Result<Moved> {
        match self {
            Self::AsStored => Ok(Moved::default()),
            Self::Window([low, high]) => {
                check(low, high)?;
                let scale = 1.0 / (high - low);
                // NaN stays NaN and is replaced later, as everywhere.
                voxels.replace(|v| ((v - low) * scale).clamp(0.0, 1.0));
                Ok(Moved::default())
            }
            Self::Moved([low, high]) => {
                check(low, high)?;
                let ranks = Ranks::of(voxels);
                let stored = ranks.typical_range();
                let [least, most] = kept([low, high]);
                // Values are not moved unless needed: then 8-bit numbers stay 8-bit numbers.
                let base = if least > 0.0 { least } else { ranks.least().clamp(least, 0.0) };
                voxels.replace(
                    |v| if v.is_finite() { v.clamp(least, most) - base } else { f32::NAN },
                );
                Ok(Moved { by: -base, stored: Some(stored) })
            }
        }
    }
}

impl Volume {
    /// The volume that `levels` make of the stored values, if that can be told from this one, which
    /// was made of the same values by other levels: this one, or a copy. `None` if the stored values
    /// are needed. (A transfer function that is being edited asks for other levels all the time, of
    /// which nearly all do the same.)
    #[cfg_attr(not(feature = "io"), allow(dead_code))]
    pub(crate) fn as_levels(self: &Arc<Self>, levels: Levels) -> Option<Arc<Self>> {
        let known = self.levels?;
        if known == levels {
            return Some(self.clone());
        }
        let Levels::Moved(range) = levels else { return None };
        // The stored values' range, unless the known levels have clamped it.
        let by = self.moved.by;
        let smallest = self.smallest();
        let least = if by > 0.0 { -by } else { smallest };
        let most = self.largest - by;
        let inside = |range: [f32; 2]| {
            let [low, high] = kept(range);
            // A margin for rounding at the upper end.
            low < least && low <= 0.0 && most * (1.0 + 1e-5) < high
        };
        let unclamped = match known {
            Levels::AsStored => self.replaced == 0,
            Levels::Moved(known) => inside(known) && by >= 0.0 && (by == 0.0 || smallest == 0.0),
            Levels::Window(_) => false,
        };
        if !(unclamped && most >= 0.0 && inside(range)) {
            return None;
        }
        if known != Levels::AsStored {
            return Some(self.clone());
        }
        let mut moved = Self::clone(self);
        moved.moved.stored = Some(Ranks::of(&self.voxels).typical_range());
        moved.levels = Some(levels);
        Some(Arc::new(moved))
    }
}

/// The range of stored values that is kept for functions over `range`.
fn kept([low, high]: [f32; 2]) -> [f32; 2] {
    let beyond = REACH * (high - low);
    [low - beyond, high + beyond].map(|v| v.clamp(f32::MIN, f32::MAX))
}

fn check(low: f32, high: f32) -> Result<()> {
    if low < high && (high - low).is_finite() {
        return Ok(());
    }
    Err(Error::value("window", format!("{low},{high} is not LO,HI with LO < HI")))
}

impl Voxels {
    /// The stored values, each shared block once.
    pub(super) fn distinct(&self) -> &[f32] {
        match self {
            Self::Dense(values) => values.as_slice().unwrap_or_default(),
            Self::Sparse(voxels) => voxels.values(),
        }
    }

    /// The smallest and the largest finite value.
    pub fn range(&self) -> [f32; 2] {
        let ends = |part: &[f32]| {
            let finite = part.iter().copied().filter(|v| v.is_finite());
            finite.fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)])
        };
        let parts = parallel::map(self.distinct().chunks(1 << 16), ends);
        let none = [f32::INFINITY, f32::NEG_INFINITY];
        parts.into_iter().fold(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}
