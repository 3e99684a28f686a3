//! A limit on the bytes of a map.

use std::str::FromStr;

use crate::error::{Error, Result};

/// A limit on the bytes of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Budget {
    /// Bytes of the whole map.
    Total(f64),
    /// Bytes per texel.
    Texel(f64),
}

impl Budget {
    /// Whether a map of `bytes` bytes and `texels` texels is within the limit.
    pub(super) fn allows(self, bytes: f64, texels: f64) -> bool {
        match self {
            Self::Total(most) => bytes <= most,
            Self::Texel(most) => bytes <= most * texels,
        }
    }
}

impl FromStr for Budget {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let units = [("KiB", 10), ("MiB", 20), ("GiB", 30)];
        let (number, texel) = match text.strip_suffix("/texel") {
            Some(number) => (number, true),
            None => (text, false),
        };
        let unit = units.iter().find_map(|(name, bits)| Some((number.strip_suffix(name)?, bits)));
        let (number, factor) = match unit {
            Some((number, bits)) => (number, f64::from(1_u32 << bits)),
            None => (number, 1.0),
        };
        let bytes = number.trim().parse().ok().map(|n: f64| n * factor);
        match bytes.filter(|bytes| (1.0..1e15).contains(bytes)) {
            Some(bytes) if texel => Ok(Self::Texel(bytes)),
            Some(bytes) => Ok(Self::Total(bytes)),
            None => {
                let why =
                    format!("'{text}' is not a number of bytes such as 4000000, 4MiB or 16/texel");
                Err(Error::value("max-map-bytes", why))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_read_in_all_or_a_texel() {
        let read = |text: &str| text.parse::<Budget>().ok();
        assert_eq!(read("4000000"), Some(Budget::Total(4e6)));
        assert_eq!(read("1.5MiB"), Some(Budget::Total(1_572_864.0)));
        assert_eq!(read("16/texel"), Some(Budget::Texel(16.0)));
        assert_eq!(read("1KiB/texel"), Some(Budget::Texel(1024.0)));
        for wrong in ["", "MiB", "-4", "0", "4MB", "16/pixel", "nan", "inf"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
        assert!(
            Budget::Texel(16.0).allows(160.0, 10.0) && !Budget::Total(159.0).allows(160.0, 10.0)
        );
    }
}
