//! From stored values to densities: as they are, mapped to 0..1, or moved so that none is below 0.
//! Knows no transfer function, only the values that one speaks of.

use super::Voxels;
use super::ranks::Ranks;
use crate::error::{Error, Result};
use crate::parallel;

/// How stored values become densities, which are never below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Levels {
    /// As they are; what is below 0 or not finite counts as 0.
    #[default]
    AsStored,
    /// The window's ends become 0 and 1, and what is beyond them is cut, voxel by voxel.
    Window([f32; 2]),
    /// A number is added to all ([`super::Volume::moved_by`]), so that between voxels they are
    /// interpolated as they are stored: for functions that speak of the values between these two.
    /// Values that lie further from them than sixteen times the range are cut there, which keeps
    /// digits.
    Moved([f32; 2]),
}

impl From<Option<[f32; 2]>> for Levels {
    fn from(window: Option<[f32; 2]>) -> Self {
        window.map_or(Self::AsStored, Self::Window)
    }
}

/// What has been done to stored values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moved {
    /// Added to each.
    pub by: f32,
    /// The ends of the stored values but for a few that stand apart, where they were moved.
    pub stored: Option<[f32; 2]>,
}

/// How far beyond a function's range values still count, in widths of it.
const REACH: f32 = 16.0;

impl Levels {
    /// Turns stored values into densities, but for what is below 0 or not finite.
    ///
    /// # Errors
    /// If the two values do not rise or are not finite.
    pub(super) fn apply(self, voxels: &mut Voxels) -> Result<Moved> {
        match self {
            Self::AsStored => Ok(Moved::default()),
            Self::Window([low, high]) => {
                check(low, high)?;
                let scale = 1.0 / (high - low);
                // NaN stays NaN, and is replaced like everywhere else.
                voxels.replace(|v| ((v - low) * scale).clamp(0.0, 1.0));
                Ok(Moved::default())
            }
            Self::Moved([low, high]) => {
                check(low, high)?;
                let ranks = Ranks::of(voxels);
                let stored = ranks.typical_range();
                let beyond = REACH * (high - low);
                let [least, most] =
                    [low - beyond, high + beyond].map(|v| v.clamp(f32::MIN, f32::MAX));
                // Nothing is moved that need not be: numbers of eight bits stay such.
                let base = if least > 0.0 { least } else { ranks.least().clamp(least, 0.0) };
                voxels.replace(
                    |v| if v.is_finite() { v.clamp(least, most) - base } else { f32::NAN },
                );
                Ok(Moved { by: -base, stored: Some(stored) })
            }
        }
    }
}

fn check(low: f32, high: f32) -> Result<()> {
    if low < high && (high - low).is_finite() {
        return Ok(());
    }
    Err(Error::value("window", format!("{low},{high} is not LO,HI with LO < HI")))
}

impl Voxels {
    /// Stored values of all voxels that are held apart from each other.
    pub(super) fn distinct(&self) -> &[f32] {
        match self {
            Self::Dense(values) => values.as_slice().unwrap_or_default(),
            Self::Sparse(voxels) => voxels.values(),
        }
    }

    /// The smallest and the largest of all finite values.
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
