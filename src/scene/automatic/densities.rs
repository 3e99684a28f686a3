//! What the numbers of a volume stand for: the densities that a user speaks of. Knows no file.

use crate::error::Result;
use crate::scene::transfer::TransferFunction;
use crate::volume::Volume;

/// From densities, which tables and functions speak of, to the numbers that a volume holds: a
/// density is cut to a window's 0..1 between voxels, where the numbers have been interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Densities {
    /// A number is the density times this, above 0, ...
    pub scale: f64,
    /// ... plus this.
    pub offset: f64,
    /// Densities beyond these count as these.
    pub cut: Option<[f64; 2]>,
}

impl Default for Densities {
    /// Numbers are densities.
    fn default() -> Self {
        Self { scale: 1.0, offset: 0.0, cut: None }
    }
}

impl Densities {
    /// Stored values are densities, moved or not.
    pub fn of_stored(volume: &Volume) -> Self {
        Self { offset: volume.moved_by().into(), ..Self::default() }
    }

    /// The stored values of a window are densities of 0..1, in a volume whose stored values were
    /// moved by as much.
    pub fn of_window(window: [f32; 2], moved_by: f32) -> Self {
        let [low, high] = window.map(f64::from);
        Self { scale: high - low, offset: low + f64::from(moved_by), cut: Some([0.0, 1.0]) }
    }

    /// The number for a density.
    pub fn held_value(&self, density: f64) -> f64 {
        density * self.scale + self.offset
    }

    /// The density of a number.
    pub fn density(&self, held: f64) -> f64 {
        let density = (held - self.offset) / self.scale;
        self.cut.map_or(density, |[low, high]| density.clamp(low, high))
    }

    /// Whether no number of a volume is beyond the cut.
    pub fn cuts_nothing(&self, volume: &Volume) -> bool {
        self.cut.is_none_or(|[low, high]| {
            f64::from(volume.smallest()) >= self.held_value(low)
                && f64::from(volume.largest()) <= self.held_value(high)
        })
    }

    /// A function of densities as one of a volume's numbers.
    ///
    /// # Errors
    /// Never with a window of numbers that f32 holds.
    pub fn held(&self, function: &TransferFunction) -> Result<TransferFunction> {
        let function = match self.cut {
            Some(cut) => function.cut(cut)?,
            None => function.clone(),
        };
        Ok(function.mapped(self.scale, self.offset))
    }
}
