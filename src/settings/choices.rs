//! Named methods to choose from.

/// Declares an enum whose variants have names on the command line and in scene files.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident, $what:literal { $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* #[serde(rename = $text)] $variant,)+ }

        impl $name {
            /// All of them, in order of declaration.
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
                    let why = format!("'{text}' is not one of {}", names.join(", "));
                    crate::error::Error::value($what, why)
                })
            }
        }
    };
}

named! {
    /// How the volume is cut into the slabs of a fragment map.
    Slices, "slices" {
        /// The best on all measured devices: `ray`.
        Auto = "auto",
        /// Equal slabs between each ray's entry and exit, in order; one thread per texel.
        Ray = "ray",
        /// Slabs between planes that all rays share, in order; one thread per texel.
        Planes = "planes",
        /// The same planes, drawn as geometry into unordered lists that are then sorted.
        Raster = "raster",
    }
}

named! {
    /// Where in a step a threshold counts as crossed.
    Crossing, "crossing" {
        /// Where optical depth inside the step reaches it.
        Exact = "exact",
        /// The paper's method: a smoothstep of opacity between the step's ends.
        Smoothstep = "smoothstep",
        /// The paper's cheaper method: the greatest sampled depth that is not past the threshold.
        Bucket = "bucket",
    }
}

named! {
    /// How transmittance is read from a threshold map.
    Lookup, "lookup" {
        /// The best known reconstruction from the same four numbers.
        Default = "default",
        /// The paper's method: steps at the first and last threshold, smoothsteps between.
        Paper = "paper",
    }
}

named! {
    /// How the texels around a point are combined. It is their transmittances that are combined,
    /// and not their depths: a depth of one texel means nothing in another. There is one exception.
    /// Where the surface of a dense medium runs through all four texels, `Bilinear` first moves
    /// their shadows in depth to one common front, so that slanted surfaces get no steps.
    Filter, "filter" {
        /// The texel that contains the point.
        Nearest = "nearest",
        /// Bilinear interpolation between the four nearest texels.
        Bilinear = "bilinear",
        /// The mean of 3 x 3 texels (percentage-closer filtering, Reeves et al. 1987).
        Pcf3 = "pcf3",
        /// The mean of 5 x 5 texels.
        Pcf5 = "pcf5",
        /// The mean of 7 x 7 texels.
        Pcf7 = "pcf7",
        /// The nearest texel, with an exponential shadow test for each fragment (Annen et al.
        /// 2008).
        Edsm = "edsm",
        /// The mean of 3 x 3 texels with exponential shadow tests.
        Edsm3 = "edsm3",
        /// The mean of 5 x 5 texels with exponential shadow tests.
        Edsm5 = "edsm5",
    }
}

impl Filter {
    /// Width of the window in texels (0 for bilinear), and whether shadow tests are exponential.
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
        /// Single scattering, with each step lit through the map.
        Physical = "physical",
        /// The paper's method: the sampled value in all channels, darkened by the ray's mean
        /// shadow.
        Paper = "paper",
    }
}
