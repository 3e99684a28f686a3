//! Settings for building and reading shadow maps, with a separate part for each kind of map that
//! needs one.

use serde::{Deserialize, Serialize};

use super::{Crossing, Filter, Lookup, MapKind, Slices};

/// Settings of shadow maps.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct MapSettings {
    /// The kind of map; `None`, the default, is fragments.
    pub kind: Option<MapKind>,
    /// Texels along each edge, 1 to 8192; 512 by default. Scenes that are completed automatically
    /// get a size by their voxels and the picture instead.
    pub size: u32,
    /// Largest number of steps along a light ray, 1 to 1048576; 512 by default. Fewer are taken
    /// where the result is the same. In a medium so dense that light ends within a few steps, these
    /// are shortened.
    pub steps: u32,
    /// How the texels around a point are combined; [`Filter::Bilinear`] by default.
    pub filter: Filter,
    /// Settings of threshold maps.
    pub threshold: ThresholdSettings,
    /// Settings of fragment maps; visibility functions use the same tolerance.
    pub fragments: FragmentSettings,
}

/// What threshold maps keep and how they are read.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct ThresholdSettings {
    /// The opacities whose depths the map keeps, rising, above 0 and below 1 by at least 1e-6, and
    /// as far from each other; 0.1, 0.5 and 0.9 by default.
    pub levels: [f64; 3],
    /// Where in a step an opacity counts as crossed; [`Crossing::Exact`] by default.
    pub crossing: Crossing,
    /// How transmittance is read; [`Lookup::Default`] by default.
    pub lookup: Lookup,
}

/// What fragment maps keep and how they are built.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct FragmentSettings {
    /// How the volume is cut into slabs; [`Slices::Auto`] by default.
    pub slices: Slices,
    /// Largest error of transmittance that a map may have because it keeps fewer fragments, 0 to
    /// 0.5; 0.002 by default, and 0 keeps all of them.
    pub tolerance: f64,
    /// Raw lists are truncated where transmittance is this close to its final value, 0 to 0.5;
    /// 0.001 by default, and 0 never truncates.
    pub truncation: f64,
    /// Whether wide filters follow links between the fragments of neighbouring texels. By default
    /// (`None`) they do on a processor; a GPU searches several lists at once in half of the time.
    pub links: Option<bool>,
    /// Whether a strand's fragment is as opaque as the share of its texel that the strand covers;
    /// else it is what the texel's central ray meets. It is by default.
    pub coverage: bool,
    /// Largest number of bytes of nodes, and of what surfaces leave in texels, in memory while a map
    /// is built, at least 1 MiB; 1 GiB by default. Larger maps are built in tiles, which GPUs put
    /// together with up to half as much again.
    pub memory: u64,
}

impl MapSettings {
    /// Whether lookups follow links, by a backend whose wide filters do so `by_default` or not.
    pub fn follows_links(&self, by_default: bool) -> bool {
        self.filter.window().0 > 1 && self.fragments.links.unwrap_or(by_default)
    }
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
            links: None,
            coverage: true,
            memory: 1 << 30,
        }
    }
}
