//! The kinds of shadow map, by the names that the command line and scene files know.

use std::fmt;
use std::str::FromStr;

use crate::error::Error;

/// Which kind of shadow map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MapKind {
    /// Depths at three opacities and the largest opacity, four numbers a texel.
    Threshold,
    /// Lists of the slabs that a texel's ray crosses: exact, or within a given tolerance.
    Fragments,
    /// As many bytes for every texel, in one of several codes.
    Coded(Coding),
}

/// How a texel's transmittance over depth is kept in a fixed number of bytes. The numbers are how
/// many coefficients, slices or nodes a texel has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Coding {
    /// Transmittance at equal distances along the ray, 8 bits each.
    Slices(u16),
}

/// A name, what may follow it, and what it means.
struct Entry {
    name: &'static str,
    /// The number taken where none is given, and the least and the most that is allowed.
    count: Option<[u16; 3]>,
    make: fn(u16) -> MapKind,
}

const ENTRIES: &[Entry] = &[
    Entry { name: "threshold", count: None, make: |_| MapKind::Threshold },
    Entry { name: "fragments", count: None, make: |_| MapKind::Fragments },
    Entry {
        name: "slices",
        count: Some([16, 2, 1024]),
        make: |n| MapKind::Coded(Coding::Slices(n)),
    },
];

impl MapKind {
    /// Every kind, with its usual number where it has one.
    pub fn all() -> impl Iterator<Item = Self> {
        ENTRIES.iter().map(|entry| (entry.make)(entry.count.map_or(0, |[usual, ..]| usual)))
    }

    fn count(self) -> Option<u16> {
        match self {
            Self::Threshold | Self::Fragments => None,
            Self::Coded(Coding::Slices(n)) => Some(n),
        }
    }
}

/// `NAME` or `NAME:N`, as [`MapKind::from_str`] reads it.
impl fmt::Display for MapKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.count();
        let same = |entry: &&Entry| (entry.make)(count.unwrap_or(0)) == *self;
        let name = ENTRIES.iter().find(same).map_or("", |entry| entry.name);
        match count {
            Some(n) => write!(f, "{name}:{n}"),
            None => f.write_str(name),
        }
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
            let names: Vec<_> = ENTRIES.iter().map(|entry| entry.name).collect();
            return Err(wrong(format!("is none of {}", names.join(", "))));
        };
        let Some([usual, least, most]) = entry.count else {
            return match given {
                Some(_) => Err(wrong(format!("takes no number after {name}"))),
                None => Ok((entry.make)(0)),
            };
        };
        let n = given.map_or(Some(usual), |given| given.parse().ok());
        match n.filter(|n| (least..=most).contains(n)) {
            Some(n) => Ok((entry.make)(n)),
            None => Err(wrong(format!("needs a number from {least} to {most} after {name}:"))),
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
        }
        assert_eq!("slices:7".parse::<MapKind>().ok(), Some(MapKind::Coded(Coding::Slices(7))));
        for wrong in ["", "slice", "slices:", "slices:1", "slices:x", "threshold:3", "slices:99999"]
        {
            assert!(wrong.parse::<MapKind>().is_err(), "{wrong}");
        }
    }
}
