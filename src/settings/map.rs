//! How shadow maps are built and read. Each kind owns what it alone reads.

use super::{Crossing, Filter, Lookup, MapKind, Slices};

/// Shadow maps.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSettings {
    /// Which kind; `None` for the one that the backend builds fastest.
    pub kind: Option<MapKind>,
    /// Texels along each edge, 1 to 8192.
    pub size: u32,
    /// Steps along a light ray at most; fewer where the result is the same. Where a medium is so
    /// dense that light ends within few of them, they are cut.
    pub steps: u32,
    /// How the texels around a point are combined.
    pub filter: Filter,
    /// Of threshold maps.
    pub threshold: ThresholdSettings,
    /// Of fragment maps; visibility functions keep its tolerance too.
    pub fragments: FragmentSettings,
}

/// What threshold maps keep and how they are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ThresholdSettings {
    /// Opacities that the map keeps the depths of, rising, in 0..1.
    pub levels: [f64; 3],
    /// Where within a step one is crossed.
    pub crossing: Crossing,
    /// How transmittance is read.
    pub lookup: Lookup,
}

/// What fragment maps keep and how they are built.
#[derive(Clone, Debug, PartialEq)]
pub struct FragmentSettings {
    /// How the volume is cut into slabs.
    pub slices: Slices,
    /// Largest error of transmittance that a map may make by keeping fewer fragments, 0 to 0.5; 0
    /// keeps all of them.
    pub tolerance: f64,
    /// A raw list is cut where transmittance is this close to its final value, 0 to 0.5; 0 never.
    pub truncation: f64,
    /// Whether wide filters walk from texel to texel by links between neighbouring fragments.
    pub links: bool,
    /// Bytes that lists may take while a map is built; more are built in tiles.
    pub memory: u64,
}

impl Default for MapSettings {
    fn default() -> Self {
        Self {
            kind: None,
            size: 512,
            steps: 512,
            filter: Filter::Bilinear,
            threshold: ThresholdSettings::default(),
            fragments: FragmentSettings::default(),
        }
    }
}

impl Default for ThresholdSettings {
    fn default() -> Self {
        let (crossing, lookup) = (Crossing::Exact, Lookup::Default);
        Self { levels: [0.1, 0.5, 0.9], crossing, lookup }
    }
}

impl Default for FragmentSettings {
    fn default() -> Self {
        Self {
            slices: Slices::Auto,
            tolerance: 0.002,
            truncation: 0.001,
            links: true,
            memory: 1 << 30,
        }
    }
}
