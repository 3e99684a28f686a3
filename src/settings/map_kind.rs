//! The kinds of shadow map, with the names used on the command line and in scene files.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// The kind of a shadow map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(into = "String", try_from = "String")]
#[non_exhaustive]
pub enum MapKind {
    /// Depths at three opacities and the largest opacity, four numbers per texel.
    Threshold,
    /// Lists of the slabs that a texel's ray crosses: exact, or within a given tolerance.
    #[default]
    Fragments,
    /// Lists of points of transmittance, connected by lines, within a given tolerance.
    Visibility,
    /// Transmittance in a grid over the volume, with this number of cells along its longest edge, 2
    /// to 1024.
    Grid(u16),
    /// A code with the same number of bytes for every texel.
    Coded(Coding),
}

/// How a texel's transmittance over depth is stored in a fixed number of bytes. The numbers are
/// those of coefficients, slices, layers or points per texel; [`Settings::check`] refuses numbers
/// outside of the stated ranges.
///
/// [`Settings::check`]: super::Settings::check
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Coding {
    /// Nine knots of opacity over depth in sixteen bytes.
    Nested,
    /// Depths at fixed shares of the texel's own largest opacity, 16 bits each, and that opacity.
    Relative,
    /// Transmittance at equal distances along the ray, 8 bits each: 2 to 1024.
    Slices(u16),
    /// Transmittance at equal distances along the ray, f32: 2 to 1024.
    FloatSlices(u16),
    /// Coefficients of a Fourier series of extinction: an odd number from 3 to 63.
    Fourier(u16),
    /// Power moments of extinction over depth: 4 or 6.
    Moments(u16),
    /// Complex trigonometric moments of extinction over depth: 2, 3 or 4.
    Trigonometric(u16),
    /// A fixed number of points of transmittance, reduced from those of all slabs: 3 to 256.
    Adaptive(u16),
    /// Layers that follow the depth where the medium begins: 1 to 255.
    Layers(u16),
    /// The layers nearest to the light: 1 to 64.
    Peeling(u16),
    /// Which of a number of slices are occupied, and the opacity of all: 8 to 1024 in steps of 8.
    Occupancy(u16),
    /// Depths where random light is stopped: 1 to 256.
    Stochastic(u16),
}

/// A name, the number that may follow it, and its meaning.
struct Entry {
    name: &'static str,
    count: Option<Count>,
    /// What a texel keeps, and who published it.
    what: &'static str,
    make: fn(u16) -> MapKind,
}

/// The number after a name.
struct Count {
    /// The default number.
    usual: u16,
    least: u16,
    most: u16,
    /// Distance between two allowed numbers.
    step: u16,
}

impl Count {
    fn allows(&self, n: u16) -> bool {
        (self.least..=self.most).contains(&n) && (n - self.least).is_multiple_of(self.step)
    }

    /// The rest of a message about a number that is not allowed after `name`.
    fn needed(&self, name: &str) -> String {
        let Self { least, most, step, .. } = self;
        let steps = if *step == 1 { String::new() } else { format!(" in steps of {step}") };
        format!("needs a number from {least} to {most}{steps} after {name}:")
    }
}

const fn count(usual: u16, [least, most]: [u16; 2], step: u16) -> Count {
    Count { usual, least, most, step }
}

const ENTRIES: &[Entry] = &[
    Entry {
        name: "threshold",
        count: None,
        what: "depths at three opacities and the largest opacity (Volumetric Deep Shadow Maps)",
        make: |_| MapKind::Threshold,
    },
    Entry {
        name: "fragments",
        count: None,
        what: "lists of slabs, optical depth linear between, within a tolerance",
        make: |_| MapKind::Fragments,
    },
    Entry {
        name: "visibility",
        count: None,
        what: "lists of points, transmittance linear between, within a tolerance (deep shadow maps, \
               Lokovic and Veach 2000)",
        make: |_| MapKind::Visibility,
    },
    Entry {
        name: "nested",
        count: None,
        what: "nine knots of opacity over depth, each a share of the way between two others, 16 bytes",
        make: |_| MapKind::Coded(Coding::Nested),
    },
    Entry {
        name: "relative",
        count: None,
        what: "depths at seven shares of the texel's largest opacity, and that opacity, 16 bits each",
        make: |_| MapKind::Coded(Coding::Relative),
    },
    Entry {
        name: "slices",
        count: Some(count(16, [2, 1024], 1)),
        what: "transmittance at N equal distances, 8 bits each (opacity shadow maps, Kim and Neumann \
               2001)",
        make: |n| MapKind::Coded(Coding::Slices(n)),
    },
    Entry {
        name: "slices-float",
        count: Some(count(16, [2, 1024], 1)),
        what: "transmittance at N equal distances, 32 bits each (opacity shadow maps, Kim and Neumann \
               2001)",
        make: |n| MapKind::Coded(Coding::FloatSlices(n)),
    },
    Entry {
        name: "fourier",
        count: Some(count(7, [3, 63], 2)),
        what: "N coefficients of a Fourier series of extinction (Fourier opacity mapping, Jansen and \
               Bavoil 2010)",
        make: |n| MapKind::Coded(Coding::Fourier(n)),
    },
    Entry {
        name: "moments",
        count: Some(count(4, [4, 6], 2)),
        what: "N power moments of extinction (moment shadow mapping, Peters and Klein 2015; \
               Muenstermann et al. 2018)",
        make: |n| MapKind::Coded(Coding::Moments(n)),
    },
    Entry {
        name: "trigonometric",
        count: Some(count(3, [2, 4], 1)),
        what: "N complex trigonometric moments of extinction (moment-based order-independent \
               transparency, Muenstermann et al. 2018)",
        make: |n| MapKind::Coded(Coding::Trigonometric(n)),
    },
    Entry {
        name: "adaptive",
        count: Some(count(8, [3, 256], 1)),
        what: "N points of transmittance, chosen from all of them (adaptive volumetric shadow \
               maps, Salvi et al. 2010)",
        make: |n| MapKind::Coded(Coding::Adaptive(n)),
    },
    Entry {
        name: "layers",
        count: Some(count(7, [1, 255], 1)),
        what: "the depth where the medium begins and opacity at the ends of N layers behind it (deep \
               opacity maps, Yuksel and Keyser 2008)",
        make: |n| MapKind::Coded(Coding::Layers(n)),
    },
    Entry {
        name: "peeling",
        count: Some(count(8, [1, 64], 1)),
        what: "the N layers nearest to the light (depth peeling, Everitt 2001)",
        make: |n| MapKind::Coded(Coding::Peeling(n)),
    },
    Entry {
        name: "occupancy",
        count: Some(count(128, [8, 1024], 8)),
        what: "which of N slices are occupied, and the opacity of all (occupancy maps, Sintorn and \
               Assarsson 2009)",
        make: |n| MapKind::Coded(Coding::Occupancy(n)),
    },
    Entry {
        name: "stochastic",
        count: Some(count(16, [1, 256], 1)),
        what: "depths where N random rays of light are stopped (stochastic transparency, Enderton \
               et al. 2010)",
        make: |n| MapKind::Coded(Coding::Stochastic(n)),
    },
    Entry {
        name: "grid",
        count: Some(count(64, [2, 1024], 1)),
        what: "transmittance at the points of a grid in the volume, N along its longest edge, 8 bits \
               each",
        make: MapKind::Grid,
    },
];

impl MapKind {
    /// Every kind, with its default number if it takes one.
    pub fn all() -> impl Iterator<Item = Self> {
        ENTRIES.iter().map(|entry| (entry.make)(entry.count.as_ref().map_or(0, |n| n.usual)))
    }

    /// The names of all kinds, with `:N` after those that take a number.
    pub fn names() -> String {
        let name = |entry: &Entry| match entry.count {
            Some(_) => format!("{}:N", entry.name),
            None => entry.name.to_owned(),
        };
        ENTRIES.iter().map(name).collect::<Vec<_>>().join(", ")
    }

    /// What the map keeps, and who published it.
    pub fn description(self) -> &'static str {
        self.entry().map_or("", |entry| entry.what)
    }

    fn entry(self) -> Option<&'static Entry> {
        let count = self.count().unwrap_or(0);
        ENTRIES.iter().find(|entry| (entry.make)(count) == self)
    }

    /// What is wrong with the number of a kind that takes one; `None` if it is allowed.
    pub(super) fn fault(self) -> Option<String> {
        let (n, entry) = (self.count()?, self.entry()?);
        let count = entry.count.as_ref()?;
        (!count.allows(n)).then(|| format!("'{self}' {}", count.needed(entry.name)))
    }

    fn count(self) -> Option<u16> {
        match self {
            Self::Threshold
            | Self::Fragments
            | Self::Visibility
            | Self::Coded(Coding::Nested | Coding::Relative) => None,
            Self::Grid(n)
            | Self::Coded(
                Coding::Slices(n)
                | Coding::FloatSlices(n)
                | Coding::Fourier(n)
                | Coding::Moments(n)
                | Coding::Trigonometric(n)
                | Coding::Adaptive(n)
                | Coding::Layers(n)
                | Coding::Peeling(n)
                | Coding::Occupancy(n)
                | Coding::Stochastic(n),
            ) => Some(n),
        }
    }
}

/// `NAME` or `NAME:N`, as [`MapKind::from_str`] reads it.
impl fmt::Display for MapKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.entry().map_or("", |entry| entry.name);
        match self.count() {
            Some(n) => write!(f, "{name}:{n}"),
            None => f.write_str(name),
        }
    }
}

impl From<MapKind> for String {
    fn from(kind: MapKind) -> Self {
        kind.to_string()
    }
}

impl TryFrom<String> for MapKind {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl FromStr for MapKind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = |why: String| Error::value("map", format!("'{text}' {why}"));
        let (name, given) = match text.split_once(':') {
            Some((name, given)) => (name, Some(given)),
            None => (text, None),
        };
        let Some(entry) = ENTRIES.iter().find(|entry| entry.name == name) else {
            return Err(wrong(format!("is not one of {}", Self::names())));
        };
        let Some(count) = &entry.count else {
            return match given {
                Some(_) => Err(wrong(format!("takes no number after {name}"))),
                None => Ok((entry.make)(0)),
            };
        };
        let n: Option<u16> = given.map_or(Some(count.usual), |given| given.parse().ok());
        match n.filter(|&n| count.allows(n)) {
            Some(n) => Ok((entry.make)(n)),
            None => Err(wrong(count.needed(name))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for kind in MapKind::all() {
            assert_eq!(kind.to_string().parse::<MapKind>().ok(), Some(kind));
            assert!(!kind.description().is_empty(), "{kind}");
        }
        assert_eq!("slices:7".parse::<MapKind>().ok(), Some(MapKind::Coded(Coding::Slices(7))));
        for wrong in [
            "",
            "slice",
            "slices:",
            "slices:1",
            "slices:x",
            "threshold:3",
            "slices:99999",
            "moments:5",
            "fourier:4",
            "relative:7",
            "trigonometric:5",
        ] {
            assert!(wrong.parse::<MapKind>().is_err(), "{wrong}");
        }
    }
}
