//! The methods that are compared: variants of settings, with labels.

use crate::error::{Error, Result};
use crate::settings::{Crossing, Lookup, MapKind, Settings};

/// A way to build and read a shadow map.
#[derive(Clone, Debug)]
pub struct Method {
    /// `KIND` or `KIND@VARIANT`, as a user types it.
    pub label: String,
    /// The kind of map.
    pub kind: MapKind,
    variant: Variant,
}

/// The difference from a kind's usual settings.
#[derive(Clone, Copy, Debug)]
enum Variant {
    Usual,
    /// The lookup and the crossing of the threshold map's paper.
    Paper,
    /// The paper's cheaper crossing.
    Bucket,
    /// Every fragment is kept.
    Raw,
    Tolerance(f64),
}

/// Variants that are measured in addition to every kind with its default number.
const VARIANTS: [&str; 8] = [
    "threshold@paper",
    "threshold@bucket",
    "fragments@raw",
    "fragments@0.0005",
    "fragments@0.01",
    "visibility@0.01",
    "slices:32",
    "adaptive:16",
];

impl Method {
    /// Every kind with its default number, and the variants.
    pub fn all() -> Vec<Self> {
        let kinds = MapKind::all().map(Self::usual);
        let variants = VARIANTS.iter().filter_map(|label| Self::parse(label).ok());
        let mut methods: Vec<Self> = Vec::new();
        for method in kinds.chain(variants) {
            if methods.iter().all(|other| other.label != method.label) {
                methods.push(method);
            }
        }
        methods
    }

    fn usual(kind: MapKind) -> Self {
        Self { label: kind.to_string(), kind, variant: Variant::Usual }
    }

    /// The method for a label.
    ///
    /// # Errors
    /// If there is no such kind or variant.
    pub fn parse(label: &str) -> Result<Self> {
        let Some((kind, variant)) = label.split_once('@') else {
            return Ok(Self::usual(label.parse()?));
        };
        let kind: MapKind = kind.parse()?;
        let tolerance = || variant.parse().ok().filter(|t: &f64| (0.0..=0.5).contains(t));
        let variant = match (kind, variant) {
            (MapKind::Threshold, "paper") => Variant::Paper,
            (MapKind::Threshold, "bucket") => Variant::Bucket,
            (MapKind::Fragments, "raw") => Variant::Raw,
            (MapKind::Fragments | MapKind::Visibility, _) if tolerance().is_some() => {
                Variant::Tolerance(tolerance().unwrap_or_default())
            }
            _ => {
                let why = "variants are threshold@paper, threshold@bucket, fragments@raw, \
                           fragments@TOLERANCE and visibility@TOLERANCE (0 to 0.5)";
                return Err(Error::value("maps", format!("'{label}' is unknown: {why}")));
            }
        };
        Ok(Self { label: label.to_owned(), kind, variant })
    }

    /// The methods for labels that are separated by commas.
    ///
    /// # Errors
    /// If a label is unknown or occurs twice.
    pub fn list(text: &str) -> Result<Vec<Self>> {
        let methods = text.split(',').map(|label| Self::parse(label.trim()));
        let methods = methods.collect::<Result<Vec<_>>>()?;
        for (i, method) in methods.iter().enumerate() {
            if methods[..i].iter().any(|other| other.label == method.label) {
                let why = format!("'{}' appears twice", method.label);
                return Err(Error::value("maps", why));
            }
        }
        Ok(methods)
    }

    /// `settings` with the changes of this method.
    #[must_use]
    pub fn settings(&self, settings: &Settings) -> Settings {
        let mut settings = settings.with(|s| s.map.kind = Some(self.kind));
        match self.variant {
            Variant::Usual => {}
            Variant::Paper => {
                settings.map.threshold.lookup = Lookup::Paper;
                settings.map.threshold.crossing = Crossing::Smoothstep;
            }
            Variant::Bucket => settings.map.threshold.crossing = Crossing::Bucket,
            Variant::Raw => {
                (settings.map.fragments.tolerance, settings.map.fragments.truncation) = (0.0, 0.0);
            }
            Variant::Tolerance(tolerance) => settings.map.fragments.tolerance = tolerance,
        }
        settings
    }
}

/// Checks the filter: exponential shadow tests are not a transmittance that could be compared with
/// the truth.
///
/// # Errors
/// If `settings` use them.
pub fn check_filter(settings: &Settings) -> Result<()> {
    if settings.map.filter.window().1 {
        let name = settings.map.filter.name();
        let why = format!("'{name}' tests fragments: its transmittance cannot be measured");
        return Err(Error::value("filter", why));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_named_once_and_read_back() {
        let methods = Method::all();
        assert!(methods.len() >= VARIANTS.len() + 3);
        for method in &methods {
            let again = Method::parse(&method.label);
            assert!(again.is_ok_and(|again| again.kind == method.kind), "{}", method.label);
        }
        let labels: Vec<&str> = methods.iter().map(|method| method.label.as_str()).collect();
        assert!(Method::list(&labels.join(",")).is_ok());
        for wrong in ["", "threshold@raw", "fragments@2", "fragments@x", "slices:16@paper", "a,a"] {
            assert!(Method::list(wrong).is_err(), "{wrong}");
        }
        assert!(Method::list("threshold,threshold").is_err());
    }
}
