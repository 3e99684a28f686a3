//! How a scene is computed: one settings type for both backends. Knows no scene and no backend.

/// Sizes, step counts and methods. Both backends read the same one.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Picture width and height in pixels.
    pub image_size: [u32; 2],
    /// Camera rays a pixel; 1 is a ray through its centre.
    pub samples: u32,
    /// Factor on radiance before a picture is encoded for screens.
    pub exposure: f64,
    /// Which kind of shadow map.
    pub map: MapKind,
    /// Texels along each edge of the map.
    pub map_size: u32,
    /// Steps along a light ray at most; fewer where the result is the same.
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
    /// How the camera march turns density and shadow into colour.
    pub shading: Shading,
    /// Lookups along a camera ray with [`Shading::Paper`].
    pub light_samples: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            image_size: [512, 512],
            samples: 1,
            exposure: 1.0,
            map: MapKind::Threshold,
            map_size: 512,
            steps: 512,
            view_steps: None,
            thresholds: [0.1, 0.5, 0.9],
            crossing: Crossing::Exact,
            lookup: Lookup::Default,
            filter: Filter::Bilinear,
            shading: Shading::Physical,
            light_samples: 128,
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
    /// The kinds of shadow map.
    MapKind, "map" {
        /// Depths at three opacities and the largest opacity, four numbers a texel.
        Threshold = "threshold",
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
