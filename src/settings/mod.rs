//! How a scene is computed: one settings type for both backends. Knows no scene and no backend.

mod choices;
mod map;
mod map_kind;

pub use choices::{Crossing, Filter, Lookup, Shading, Slices};
pub use map::{FragmentSettings, MapSettings, ThresholdSettings};
pub use map_kind::{Coding, MapKind};

/// Sizes, step counts and methods. Both backends read the same one.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The picture.
    pub image: ImageSettings,
    /// The camera's march.
    pub view: ViewSettings,
    /// The shadow maps.
    pub map: MapSettings,
    /// How much finer everything is than usual, above 0: steps and slabs are one over it as long,
    /// also those that steps are limited to, and all tolerances one over its square, so that errors
    /// of steps and fits go to zero as it grows. What a map's resolution or its few numbers cost
    /// stays.
    pub quality: f64,
}

/// Pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSettings {
    /// Width and height in pixels, 1 to 16384.
    pub size: [u32; 2],
    /// Camera rays a pixel, 1 to 4096; 1 is a ray through its centre.
    pub samples: u32,
    /// Factor on radiance before a picture is encoded for screens, above 0.
    pub exposure: f64,
}

/// How the camera marches, and what it takes for light.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    /// Steps along a camera ray at most; `None` takes as many as the voxels ask for.
    pub steps: Option<u32>,
    /// How density and shadow become colour.
    pub shading: Shading,
    /// Lookups along a camera ray with [`Shading::Paper`], 1 to 65536.
    pub light_samples: u32,
    /// Octaves that imitate multiple scattering, each a dimmer light that gets deeper into the
    /// medium and scatters more evenly, at most 16; 0 for none. A look, no physics.
    pub octaves: u32,
    /// How much nearer to the light than they are surfaces are looked up, world lengths, at least
    /// 0: what keeps a surface that casts a shadow out of its own.
    pub bias: f64,
}

impl Settings {
    /// The same with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// What one over the square of [`Settings::quality`] makes of an error that is allowed.
    pub fn finer(&self, error: f64) -> f64 {
        error / (self.quality * self.quality)
    }

    /// What [`Settings::quality`] makes of a number of steps.
    pub fn more(&self, steps: u32) -> u32 {
        // Conversion saturates.
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
        Self { size: [512, 512], samples: 1, exposure: 1.0 }
    }
}

impl Default for ViewSettings {
    fn default() -> Self {
        let shading = Shading::Physical;
        Self { steps: None, shading, light_samples: 128, octaves: 0, bias: 0.0 }
    }
}
