//! What a map may be wrong by and what it may take, as options.

use std::str::FromStr;

use clap::Args;

use crate::cli::arguments::{above_0, parse};
use crate::error::{Error, Result};

/// Limits that a map is chosen to keep.
#[derive(Debug, Args)]
pub(in crate::cli) struct LimitArguments {
    /// RMS error of transmittance that the map may make, measured at random points of the volume:
    /// takes the smallest map found to keep it.
    #[arg(long, value_name = "E", value_parser = above_0, allow_negative_numbers = true, help_heading = "Shadow map")]
    pub max_error: Option<f64>,
    /// Bytes that the map may take in all (4000000, 512KiB, 4MiB) or a texel (16/texel): takes the
    /// most exact map found to keep it, or with --max-error the smallest.
    #[arg(long, value_name = "B", value_parser = parse::<Budget>, help_heading = "Shadow map")]
    pub max_map_bytes: Option<Budget>,
}

impl LimitArguments {
    /// Whether there is one.
    pub(in crate::cli) fn any(&self) -> bool {
        self.max_error.is_some() || self.max_map_bytes.is_some()
    }
}

/// How many bytes a map may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) enum Budget {
    Total(f64),
    Texel(f64),
}

impl Budget {
    /// Whether a map of `bytes` and `texels` keeps it.
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
                let why = format!("'{text}' is no number of bytes, as 4000000, 4MiB or 16/texel");
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
