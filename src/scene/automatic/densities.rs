//! Translates between densities, which a user specifies, and the numbers that a volume holds. Knows
//! no file.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::scene::transfer::TransferFunction;
use crate::volume::Volume;

/// The affine map from densities, which tables and transfer functions use, to the numbers that a
/// volume holds. With a window, densities are clamped to 0..1 only after the numbers have been
/// interpolated between voxels.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Densities {
    /// A number is the density times this factor, which is above 0, ...
    pub scale: f64,
    /// ... plus this offset.
    pub offset: f64,
    /// Densities outside of this range are clamped to it; `None` clamps nothing.
    pub cut: Option<[f64; 2]>,
}

impl Default for Densities {
    /// The identity: numbers are densities.
    fn default() -> Self {
        Self { scale: 1.0, offset: 0.0, cut: None }
    }
}

impl Densities {
    /// The map for densities that are stored values, whether or not `volume` has them moved by an
    /// offset ([`Volume::moved_by`]).
    pub fn of_stored(volume: &Volume) -> Self {
        Self { offset: volume.moved_by().into(), ..Self::default() }
    }

    /// The map for densities of 0..1 over a `window` of stored values, in a volume whose stored
    /// values were moved by `moved_by`.
    pub fn of_window(window: [f32; 2], moved_by: f32) -> Self {
        let [low, high] = window.map(f64::from);
        Self { scale: high - low, offset: low + f64::from(moved_by), cut: Some([0.0, 1.0]) }
    }

    /// The number that stands for a density.
    pub fn held_value(&self, density: f64) -> f64 {
        density * self.scale + self.offset
    }

    /// The density that a number stands for.
    pub fn density(&self, held: f64) -> f64 {
        let density = (held - self.offset) / self.scale;
        self.cut.map_or(density, |[low, high]| density.clamp(low, high))
    }

    /// Whether clamping changes none of the numbers that `volume` holds.
    pub fn cuts_nothing(&self, volume: &Volume) -> bool {
        self.cut.is_none_or(|[low, high]| {
            f64::from(volume.smallest()) >= self.held_value(low)
                && f64::from(volume.largest()) <= self.held_value(high)
        })
    }

    /// Rewrites a function of densities as a function of the volume's numbers.
    ///
    /// # Errors
    /// If the range to cut to is empty or not finite in f32, which does not happen for windows of
    /// numbers that f32 holds.
    pub fn held(&self, function: &TransferFunction) -> Result<TransferFunction> {
        let function = match self.cut {
            Some(cut) => function.cut(cut)?,
            None => function.clone(),
        };
        Ok(function.mapped(self.scale, self.offset))
    }
}
