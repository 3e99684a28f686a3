//! How a scene is computed: one settings type for both backends. Knows no scene and no backend.

mod map_kind;

pub use map_kind::{Coding, MapKind};

/// Sizes, step counts and methods. Both backends read the same one.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Picture width and height in pixels.
    pub image_size: [u32; 2],
    /// Camera rays a pixel; 1 is a ray through its centre.
    pub samples: u32,
    /// Factor on radiance before a picture is encoded for screens.
    pub exposure: f64,
    /// Which kind of shadow map; `None` for the one that the backend builds fastest.
    pub map: Option<MapKind>,
    /// Texels along each edge of the map.
    pub map_size: u32,
    /// How much finer everything is than usual, above 0: steps and slabs are one over it as long, also those
    /// that `steps` and `view_steps` allow, and all tolerances one over its square, so that errors of steps
    /// and fits go to zero as it grows. What a map's resolution or its few numbers cost stays.
    pub quality: f64,
    /// Steps along a light ray at most; fewer where the result is the same. Where a medium is so dense that
    /// light ends within few of them, they are cut.
    pub steps: u32,
    /// Steps along a camera ray at most; `None` takes as many as the voxels ask for.
    pub view_steps: Option<u32>,
    /// Opacities that the threshold map keeps the depth of, rising, in 0..1.
    pub thresholds: [f64; 3],
    /// Where within a step a threshold is crossed.
    pub crossing: Crossing,
    /// How transmittance is read from a threshold map.
    pub lookup: Lookup,
    /// How the texels around a point are combined.
    pub filter: Filter,
    /// How the volume is cut into the slabs of a fragment map.
    pub slices: Slices,
    /// Largest error of transmittance that a fragment map may make by keeping fewer fragments; 0
    /// keeps all of them.
    pub tolerance: f64,
    /// A raw fragment list is cut where transmittance is this close to its final value; 0 never.
    pub truncation: f64,
    /// How much nearer to the light than they are surfaces are looked up, world lengths, at least 0: what keeps a
    /// surface that casts a shadow out of its own.
    pub bias: f64,
    /// Whether wide filters walk from texel to texel by links between neighbouring fragments.
    pub links: bool,
    /// Bytes that the lists of a fragment map may take while it is built; more are built in tiles.
    pub memory: u64,
    /// How the camera march turns density and shadow into colour.
    pub shading: Shading,
    /// Lookups along a camera ray with [`Shading::Paper`].
    pub light_samples: u32,
    /// Octaves that imitate multiple scattering, each a dimmer light that gets deeper into the medium and
    /// scatters more evenly; 0 for none. A look, no physics.
    pub octaves: u32,
}

impl Settings {
    /// What one over the square of [`Settings::quality`] makes of an error that is allowed.
    pub fn finer(&self, error: f64) -> f64 {
        error / (self.quality * self.quality)
    }

    /// The same with what makes no difference to a shadow map as it is by default.
    #[must_use]
    pub fn of_map(&self) -> Self {
        let usual = Self::default();
        Self {
            image_size: usual.image_size,
            samples: usual.samples,
            bias: usual.bias,
            exposure: usual.exposure,
            view_steps: usual.view_steps,
            shading: usual.shading,
            light_samples: usual.light_samples,
            octaves: usual.octaves,
            ..self.clone()
        }
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
            image_size: [512, 512],
            samples: 1,
            exposure: 1.0,
            map: None,
            map_size: 512,
            quality: 1.0,
            steps: 512,
            view_steps: None,
            thresholds: [0.1, 0.5, 0.9],
            crossing: Crossing::Exact,
            lookup: Lookup::Default,
            filter: Filter::Bilinear,
            slices: Slices::Auto,
            tolerance: 0.002,
            truncation: 0.001,
            bias: 0.0,
            links: true,
            memory: 1 << 30,
            shading: Shading::Physical,
            light_samples: 128,
            octaves: 0,
        }
    }
}

/// Declares an enum whose variants have names on the command line and in scene files.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident, $what:literal { $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant,)+ }

        impl $name {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The name on the command line and in scene files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }
        }

        impl std::str::FromStr for $name {
            type Err = crate::error::Error;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                Self::ALL.iter().copied().find(|one| one.name() == text).ok_or_else(|| {
                    let names: Vec<_> = Self::ALL.iter().map(|one| one.name()).collect();
                    let why = format!("'{text}' is none of {}", names.join(", "));
                    crate::error::Error::value($what, why)
                })
            }
        }
    };
}

named! {
    /// How the volume is cut into the slabs of a fragment map.
    Slices, "slices" {
        /// The best on every device measured: `ray`.
        Auto = "auto",
        /// Equal slabs between each ray's entry and exit, in order, one thread a texel.
        Ray = "ray",
        /// Slabs between planes that all rays share, in order, one thread a texel.
        Planes = "planes",
        /// The same planes drawn as geometry into unordered lists, which are sorted.
        Raster = "raster",
    }
}

named! {
    /// Where within a step a threshold is taken to be crossed.
    Crossing, "crossing" {
        /// Where the exponential inside the step reaches it.
        Exact = "exact",
        /// The paper's: a smoothstep of opacity between the step's ends.
        Smoothstep = "smoothstep",
        /// The paper's cheaper way: the greatest depth not past the threshold.
        Bucket = "bucket",
    }
}

named! {
    /// How transmittance is read from a threshold map.
    Lookup, "lookup" {
        /// The best reconstruction of the same four numbers.
        Default = "default",
        /// The paper's: steps at the first and last threshold, smoothsteps between.
        Paper = "paper",
    }
}

named! {
    /// How the texels around a point are combined; always transmittances, never depths.
    Filter, "filter" {
        /// The texel that holds the point.
        Nearest = "nearest",
        /// The four nearest, weighted.
        Bilinear = "bilinear",
        /// The mean of 3 x 3 (percentage-closer filtering, Reeves et al. 1987).
        Pcf3 = "pcf3",
        /// The mean of 5 x 5.
        Pcf5 = "pcf5",
        /// The mean of 7 x 7.
        Pcf7 = "pcf7",
        /// The nearest, each fragment's shadow test an exponential (Annen et al. 2008).
        Edsm = "edsm",
        /// The mean of 3 x 3 such.
        Edsm3 = "edsm3",
        /// The mean of 5 x 5 such.
        Edsm5 = "edsm5",
    }
}

impl Filter {
    /// Texels along each edge of the window, 0 for the bilinear one, and whether shadow tests are
    /// exponential.
    pub fn window(self) -> (u32, bool) {
        match self {
            Self::Nearest => (1, false),
            Self::Bilinear => (0, false),
            Self::Pcf3 => (3, false),
            Self::Pcf5 => (5, false),
            Self::Pcf7 => (7, false),
            Self::Edsm => (1, true),
            Self::Edsm3 => (3, true),
            Self::Edsm5 => (5, true),
        }
    }
}

named! {
    /// How the camera march turns density and shadow into colour.
    Shading, "shading" {
        /// Single scattering, each step lit through the map.
        Physical = "physical",
        /// The paper's: the sampled value in all channels, darkened by the ray's mean shadow.
        Paper = "paper",
    }
}
