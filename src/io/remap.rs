//! Conversion of values to another number type: unchanged if they fit, else through an affine map
//! that can be reported. Knows neither grids nor formats.

use super::number::ValueType;
use crate::error::{Error, Result};

/// How values become numbers of another type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remap {
    /// Unchanged, rounded to what the type can hold.
    Cast,
    /// An affine map of the range `from` onto the range `to`, clamped at the ends and rounded for
    /// integers. NaN becomes the lower end in integers, and stays NaN in floating-point numbers.
    Affine {
        /// The range of the values.
        from: [f64; 2],
        /// The range of the stored numbers.
        to: [f64; 2],
    },
}

/// Properties of a set of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Smallest and largest finite value.
    pub range: Option<[f64; 2]>,
    /// Whether all values are integers.
    pub whole: bool,
}

impl Span {
    /// The span of no values.
    pub const EMPTY: Self = Self { range: None, whole: true };

    /// The span with one more value.
    #[must_use]
    pub fn with(self, value: f64) -> Self {
        let whole = self.whole && value == value.round() && value.is_finite();
        if !value.is_finite() {
            return Self { whole, ..self };
        }
        let [low, high] = self.range.unwrap_or([value; 2]);
        Self { range: Some([low.min(value), high.max(value)]), whole }
    }

    /// The span of both sets.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let ends = other.range.into_iter().flatten();
        let both = ends.fold(self, Self::with);
        Self { range: both.range, whole: self.whole && other.whole }
    }
}

impl Remap {
    /// Chooses how values of `span` become numbers of type `to`. A given `range` is mapped onto the
    /// integer type's whole range, or onto 0..1 for floating-point numbers. Without one, integers
    /// are stored unchanged if all fit, and else the span of the values is mapped; floating-point
    /// numbers are stored unchanged.
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
        // If all values are equal, they map to the lower end.
        let high = if high > low { high } else { low + 1.0 };
        Self::Affine { from: [low, high], to: limits }
    }

    /// The number that stands for `value`; `whole` rounds it to an integer.
    pub fn apply(self, value: f64, whole: bool) -> f64 {
        let Self::Affine { from: [low, high], to: [first, last] } = self else { return value };
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        // In this form both ends are exact.
        let number = first * (1.0 - share) + last * share;
        if whole { number.round() } else { number }
    }

    /// Slope and intercept of the inverse: a value is the stored number times the first plus the
    /// second.
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

/// Checks that a range is not empty.
///
/// # Errors
/// If it is empty or not finite.
pub fn checked_range(range: [f64; 2]) -> Result<[f64; 2]> {
    let [low, high] = range;
    if low < high && (high - low).is_finite() {
        return Ok(range);
    }
    Err(Error::value("range", format!("{low},{high} is not LO,HI with LO < HI")))
}
