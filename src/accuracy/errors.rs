//! Errors of transmittance, summarised in a few numbers.

/// Errors above this can be visible in a picture of 8 bits per channel.
pub const VISIBLE: f64 = 1.0 / 255.0;

/// Summary of errors: differences between a map's and the true transmittance, both in 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Errors {
    /// Number of points that were looked up.
    pub count: usize,
    /// Root mean square error.
    pub rms: f64,
    /// Mean error; above 0 where the map lets too much light through.
    pub bias: f64,
    /// The magnitude that 99.9 % of the errors do not exceed.
    pub p999: f64,
    /// The largest magnitude.
    pub max: f64,
    /// Share of errors larger than [`VISIBLE`], 0..1.
    pub visible: f64,
}

impl Errors {
    /// Summarises `errors` (looked up minus true); all numbers are 0 if there are none. If one
    /// error is NaN, `rms`, `bias` and `max` are NaN.
    pub fn of(errors: &[f64]) -> Self {
        let count = errors.len();
        if count == 0 {
            return Self::default();
        }
        let mean = |f: fn(f64) -> f64| errors.iter().map(|&e| f(e)).sum::<f64>() / count as f64;
        let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        let rank = ((count as f64 * 0.999).ceil() as usize).clamp(1, count) - 1;
        let (_, &mut p999, above) = sizes.select_nth_unstable_by(rank, f64::total_cmp);
        let max =
            above.iter().copied().fold(p999, |a, b| if a.total_cmp(&b).is_lt() { b } else { a });
        Self {
            count,
            rms: mean(|e| e * e).sqrt(),
            bias: mean(|e| e),
            p999,
            max,
            visible: mean(|e| f64::from(u8::from(e.abs() > VISIBLE))),
        }
    }
}

impl Errors {
    /// Combines the summaries of several channels or lights. Its `p999` is the largest of theirs.
    pub fn together(all: &[Self]) -> Self {
        let count: usize = all.iter().map(|errors| errors.count).sum();
        let mean = |f: fn(&Self) -> f64| {
            let sum: f64 = all.iter().map(|errors| errors.count as f64 * f(errors)).sum();
            sum / count.max(1) as f64
        };
        let most = |f: fn(&Self) -> f64| {
            all.iter().map(f).fold(0.0, |a: f64, b| if a.total_cmp(&b).is_lt() { b } else { a })
        };
        Self {
            count,
            rms: mean(|errors| errors.rms * errors.rms).sqrt(),
            bias: mean(|errors| errors.bias),
            p999: most(|errors| errors.p999),
            max: most(|errors| errors.max),
            visible: mean(|errors| errors.visible),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_errors_are_measured_as_such() {
        let mut errors = vec![0.001; 1996];
        errors.extend([-0.5, 0.25, 0.125, -0.0625]);
        let found = Errors::of(&errors);
        assert_eq!((found.count, found.max), (2000, 0.5));
        // 1998 of 2000 are at most 0.125.
        assert_eq!(found.p999, 0.125);
        assert_eq!(found.visible, 4.0 / 2000.0);
        assert!((found.bias - (1.996 - 0.1875) / 2000.0).abs() < 1e-15);
        let squares: f64 = 1996.0 * 1e-6 + 0.25 + 0.0625 + 0.015_625 + 0.003_906_25;
        assert!((found.rms - (squares / 2000.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn channels_together_are_their_errors_together() {
        let (a, b) = ([0.1, -0.3], [0.2, 0.0]);
        let both = Errors::together(&[Errors::of(&a), Errors::of(&b)]);
        let all = Errors::of(&[a, b].concat());
        assert!((both.rms - all.rms).abs() < 1e-15 && (both.bias - all.bias).abs() < 1e-15);
        assert_eq!((both.count, both.max, both.visible), (all.count, all.max, all.visible));
        assert_eq!(Errors::together(&[Errors::of(&a)]), Errors::of(&a));
    }

    #[test]
    fn no_errors_are_zero_and_nan_is_not_hidden() {
        assert_eq!(Errors::of(&[]), Errors::default());
        assert!(Errors::of(&[0.0, f64::NAN, 0.1]).max.is_nan());
    }
}
