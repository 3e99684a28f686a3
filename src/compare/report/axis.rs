//! Logarithmic axes: their ends, and the numbers along them.

/// A logarithmic axis between two numbers above 0, drawn between two positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogAxis {
    ends: [f64; 2],
    places: [f64; 2],
}

impl LogAxis {
    /// An axis with room for all `values`; those that are not above 0 and finite are ignored.
    /// `places` are the positions of its ends.
    pub(super) fn around(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let [low, high] = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold([f64::INFINITY, 0.0_f64], |[low, high], v| [low.min(v), high.max(v)]);
        let ends =
            if low > high { [0.1, 10.0] } else { [round(low / 1.15, -1), round(high * 1.15, 1)] };
        Self { ends, places }
    }

    /// The position of `value`; values beyond the axis are drawn at its end.
    pub(super) fn place(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        let share = (value / low).ln() / (high / low).ln();
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.places[0] + share * (self.places[1] - self.places[0])
    }

    /// The numbers 1, 2, 5 times powers of ten along the axis; for a long axis only the powers of
    /// ten.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.ends;
        let decades = (high / low).log10();
        let factors: &[f64] = if decades > 3.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let first = low.log10().floor() as i32;
        let last = high.log10().ceil() as i32;
        let all = (first..=last).flat_map(|e| factors.iter().map(move |f| f * 10_f64.powi(e)));
        all.filter(|t| *t > low * (1.0 - 1e-9) && *t < high * (1.0 + 1e-9)).collect()
    }
}

/// The nearest number of the form 1, 2 or 5 times a power of ten that is not above (`way` -1) or
/// not below (1) `value`.
fn round(value: f64, way: i32) -> f64 {
    let base = 10_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|f| f * base);
    if way > 0 {
        steps.into_iter().find(|s| *s >= value * (1.0 - 1e-9)).unwrap_or(value)
    } else {
        steps.into_iter().rev().find(|s| *s <= value * (1.0 + 1e-9)).unwrap_or(value)
    }
}

/// A number along an axis, without exponent if that is short.
pub(super) fn tick_label(value: f64) -> String {
    if (1e-3..1e5).contains(&value) {
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_values_between_round_ends() {
        let axis = LogAxis::around([16.0, 0.0, 715.0, f64::NAN].into_iter(), [0.0, 100.0]);
        assert_eq!(axis.ticks(), [10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]);
        assert_eq!((axis.place(10.0), axis.place(1000.0), axis.place(0.0)), (0.0, 100.0, 0.0));
        assert!((axis.place(100.0) - 50.0).abs() < 1e-9);
        let labels: Vec<String> = [0.001, 0.02, 0.5, 5.0, 2000.0, 1e-4, 1e5].map(tick_label).into();
        assert_eq!(labels, ["0.001", "0.02", "0.5", "5", "2000", "1e-4", "1e5"]);
    }

    #[test]
    fn an_axis_of_nothing_still_is_one() {
        let axis = LogAxis::around(std::iter::empty(), [0.0, 1.0]);
        assert!(axis.ticks().len() > 1 && axis.place(1.0).is_finite());
    }
}
