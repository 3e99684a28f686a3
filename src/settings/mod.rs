//! How a scene is computed: one settings type for both backends. Knows no scene and no backend.

mod check;
mod choices;
mod map;
mod map_kind;

pub use choices::{Crossing, Filter, Lookup, Shading, Slices};
pub use map::{FragmentSettings, MapSettings, ThresholdSettings};
pub use map_kind::{Coding, MapKind};
use serde::{Deserialize, Serialize};

/// Sizes, step counts and methods. Both backends use the same type. A value outside of the range
/// that its field states is an error of whatever builds a map or makes a picture
/// ([`Settings::check`]).
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Settings {
    /// The picture.
    pub image: ImageSettings,
    /// The camera's march.
    pub view: ViewSettings,
    /// The shadow maps.
    pub map: MapSettings,
    /// How much finer than usual everything is computed, 0.125 to 64; 1 by default. Lengths of
    /// steps and slabs are divided by it, the limits on their number are multiplied by it, and all
    /// tolerances are divided by its square, so that errors of steps and fits go to zero as it
    /// grows. Errors by a map's resolution or by its few numbers remain.
    pub quality: f64,
}

/// Size and sampling of the picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct ImageSettings {
    /// Width and height in pixels, 1 to 16384 each; 512 by default.
    pub size: [u32; 2],
    /// Camera rays per pixel, 1 to 4096; 1 by default. A single ray goes through the pixel's
    /// centre.
    pub samples: u32,
    /// Largest error that is expected of pixels that are interpolated instead of marched, and of
    /// those that get one ray instead of [`samples`](Self::samples), 0 to 0.5: of radiance as a
    /// share of the picture's 99.9th percentile, of opacity as such. The CPU marches pixels of a
    /// lattice, and the others where second differences say that these do not suffice (Levoy 1990,
    /// "Volume rendering by adaptive refinement"). 0 marches every pixel with all rays; 0.002 by
    /// default.
    pub tolerance: f64,
    /// Factor on radiance before a picture is encoded for screens, above 0; 1 by default. `render`
    /// does not apply it; pass it to `Image::save`.
    pub exposure: f64,
}

/// How the camera marches, and how it is lit.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct ViewSettings {
    /// Largest number of steps along a camera ray, 1 to 1048576. `None`, the default, takes as many
    /// as the voxels require: up to 8192, and 512 with [`Shading::Paper`].
    pub steps: Option<u32>,
    /// How density and shadow become colour; [`Shading::Physical`] by default.
    pub shading: Shading,
    /// Lookups along a camera ray with [`Shading::Paper`], 1 to 65536; 128 by default.
    pub light_samples: u32,
    /// Octaves that imitate multiple scattering, 0 (none, the default) to 16. Each is a dimmer
    /// light that penetrates deeper into the medium and scatters more evenly. It affects the look
    /// and is not physical.
    pub octaves: u32,
    /// Surfaces are looked up this much nearer to the light than they are, in world lengths, at
    /// least 0; 0 by default. It prevents a surface that casts a shadow from shadowing itself.
    pub bias: f64,
}

impl Settings {
    /// A copy with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// Scales an allowed error by one over the square of [`Settings::quality`].
    pub fn finer(&self, error: f64) -> f64 {
        error / (self.quality * self.quality)
    }

    /// Scales a number of steps by [`Settings::quality`].
    pub fn more(&self, steps: u32) -> u32 {
        // The conversion saturates.
        (f64::from(steps) * self.quality).ceil().max(1.0) as u32
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            image: ImageSettings::default(),
            view: ViewSettings::default(),
            map: MapSettings::default(),
            quality: 1.0,
        }
    }
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self { size: [512, 512], samples: 1, tolerance: 0.002, exposure: 1.0 }
    }
}

impl Default for ViewSettings {
    fn default() -> Self {
        let shading = Shading::Physical;
        Self { steps: None, shading, light_samples: 128, octaves: 0, bias: 0.0 }
    }
}
