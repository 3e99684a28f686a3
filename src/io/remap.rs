//! How values become numbers of another type: as they are where they fit, else through an affine
//! map that can be told. Knows neither grids nor formats.

use super::number::ValueType;
use crate::error::{Error, Result};

/// How numbers become others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remap {
    /// As they are, rounded to what the type holds.
    Cast,
    /// The first range onto the second, cut at its ends, rounded for integers; NaN becomes the
    /// lower end, or stays where the type has it.
    Affine {
        /// Of the values.
        from: [f64; 2],
        /// Of the stored numbers.
        to: [f64; 2],
    },
}

/// What a set of values is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Smallest and largest finite value.
    pub range: Option<[f64; 2]>,
    /// Whether all values are whole numbers.
    pub whole: bool,
}

impl Span {
    /// Of no values.
    pub const EMPTY: Self = Self { range: None, whole: true };

    /// With one value more.
    #[must_use]
    pub fn with(self, value: f64) -> Self {
        let whole = self.whole && value == value.round() && value.is_finite();
        if !value.is_finite() {
            return Self { whole, ..self };
        }
        let [low, high] = self.range.unwrap_or([value; 2]);
        Self { range: Some([low.min(value), high.max(value)]), whole }
    }

    /// Of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let ends = other.range.into_iter().flatten();
        let both = ends.fold(self, Self::with);
        Self { range: both.range, whole: self.whole && other.whole }
    }
}

impl Remap {
    /// How values of `span` become numbers of type `to`: `range` is mapped onto the integer type's
    /// whole range, or onto 0..1. Without one, integers take whole numbers that fit as they are,
    /// and else the span of the values is mapped; floating-point numbers take everything as it is.
    pub fn choose(span: Span, to: ValueType, range: Option<[f64; 2]>) -> Self {
        let Some(limits) = to.limits() else {
            return range.map_or(Self::Cast, |from| Self::Affine { from, to: [0.0, 1.0] });
        };
        if let Some(from) = range {
            return Self::Affine { from, to: limits };
        }
        let [low, high] = span.range.unwrap_or([0.0; 2]);
        if span.whole && low >= limits[0] && high <= limits[1] {
            return Self::Cast;
        }
        // A single value lies at the lower end.
        let high = if high > low { high } else { low + 1.0 };
        Self::Affine { from: [low, high], to: limits }
    }

    /// The number that stands for `value`; `whole` for integers.
    pub fn apply(self, value: f64, whole: bool) -> f64 {
        let Self::Affine { from: [low, high], to: [first, last] } = self else { return value };
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        // Both ends are met exactly.
        let number = first * (1.0 - share) + last * share;
        if whole { number.round() } else { number }
    }

    /// Slope and intercept: the value is the stored number times the first plus the second.
    pub fn value_scale(self) -> [f64; 2] {
        match self {
            Self::Cast => [1.0, 0.0],
            Self::Affine { from: [low, high], to: [first, last] } => {
                let slope = (high - low) / (last - first);
                [slope, low - first * slope]
            }
        }
    }
}

/// A range that is not empty.
///
/// # Errors
/// If it is.
pub fn checked_range(range: [f64; 2]) -> Result<[f64; 2]> {
    let [low, high] = range;
    if low < high && (high - low).is_finite() {
        return Ok(range);
    }
    Err(Error::value("range", format!("{low},{high} is not LO,HI with LO < HI")))
}
