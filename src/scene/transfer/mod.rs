//! Transfer functions, which give each density a colour and an opacity: presets over 0..1, points
//! from files (whose text is handed in: nothing is read here), and a choice made from a histogram.

mod automatic;
mod import;
mod presets;
mod resolve;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::image;
pub use automatic::automatic;
pub use import::from_file;
pub use presets::{PRESETS, over_hounsfield, preset};
pub use resolve::{Resolved, TransferSource, gradient, resolve};

/// The largest number of points that a function may have.
pub const MAX_POINTS: usize = 65_536;
/// Number of cells, over the function's range, of the table that passes read it from.
pub const TABLE_CELLS: u32 = 1024;

/// Colour and opacity over density, linear between points and constant beyond the outer ones.
///
/// Opacity is proportional to extinction, independent of step length: a density v has extinction =
/// density scale * opacity(v), in 1 / world length. This replaces the product of density scale and
/// density of a medium without a transfer function.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    /// At least one; values never fall, and no value stands more than twice.
    points: Vec<TransferPoint>,
}

/// One point of a transfer function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferPoint {
    /// The density, in the volume's own unit, or in 0..1 for a function that is still to be
    /// rescaled; finite in f32.
    pub value: f64,
    /// Scattering albedo, linear RGB, 0..1.
    pub color: DVec3,
    /// Factor on the volume's density scale, 0..1.
    pub opacity: f64,
}

impl TransferFunction {
    /// The function through `points`, whose values must not fall. Two points of the same value are
    /// a jump.
    ///
    /// # Errors
    /// If there are no points or more than [`MAX_POINTS`]. With the number of the point, counted
    /// from 1: if a number is not finite, if a value falls, stands three times or does not fit f32,
    /// or if a colour or opacity is outside of 0..1.
    pub fn new(points: Vec<TransferPoint>) -> Result<Self> {
        Self::named("transfer function", points)
    }

    /// [`Self::new`] with errors that name `what`.
    fn named(what: &str, points: Vec<TransferPoint>) -> Result<Self> {
        match fault(&points) {
            None => Ok(Self { points }),
            Some((None, why)) => Err(Error::value(what, why)),
            Some((Some(at), why)) => Err(Error::value(what, format!("point {}: {why}", at + 1))),
        }
    }

    /// A white function whose opacity rises from 0 at `low` to 1 at `high`.
    fn grey([low, high]: [f64; 2]) -> Self {
        let point = |value, opacity| TransferPoint { value, color: DVec3::ONE, opacity };
        Self { points: vec![point(low, 0.0), point(high, 1.0)] }
    }

    /// The points by rising value, at least one.
    pub fn points(&self) -> &[TransferPoint] {
        &self.points
    }

    /// Colour (linear RGB, 0..1) and opacity (0..1) of a density. Beyond the ends they are those of
    /// the nearer end; at a jump those of its second point; for NaN those of the first point.
    pub fn at(&self, value: f64) -> (DVec3, f64) {
        self.between(self.points.partition_point(|point| point.value <= value), value)
    }

    /// Like [`Self::at`], but at a jump those of its first point.
    fn before(&self, value: f64) -> (DVec3, f64) {
        self.between(self.points.partition_point(|point| point.value < value), value)
    }

    /// Interpolates on the line that ends at the point with index `right`.
    fn between(&self, right: usize, value: f64) -> (DVec3, f64) {
        let left = &self.points[right.saturating_sub(1)];
        let right = self.points.get(right).unwrap_or(left);
        let t = (value - left.value) / (right.value - left.value);
        // Covers the case that both are the same point and t is infinite or NaN.
        if !(t > 0.0 && left.value < right.value) {
            return (left.color, left.opacity);
        }
        // In this form t = 1 gives the right point exactly.
        (left.color * (1.0 - t) + right.color * t, left.opacity * (1.0 - t) + right.opacity * t)
    }

    /// The smallest and the largest value of the points.
    pub fn range(&self) -> [f64; 2] {
        [self.points[0].value, self.points[self.points.len() - 1].value]
    }

    /// The same function with its range moved to `low`..`high`. If all points share one value, they
    /// move to `low`.
    ///
    /// # Errors
    /// If `low`..`high` is empty or not finite in f32.
    pub fn rescaled(&self, [low, high]: [f64; 2]) -> Result<Self> {
        if !(holds(low) && holds(high) && low < high) {
            let why =
                format!("{low}..{high} is not a range: it must increase and be finite in f32");
            return Err(Error::value("transfer function range", why));
        }
        let [first, last] = self.range();
        let moved = |value: f64| {
            let t = if value > first { (value - first) / (last - first) } else { 0.0 };
            // Rounding must neither exceed the end nor miss it.
            if t < 1.0 { (low + t * (high - low)).min(high) } else { high }
        };
        let points = self.points.iter();
        let points = points.map(|point| TransferPoint { value: moved(point.value), ..*point });
        Ok(Self { points: tidy(points) })
    }
}

impl TransferFunction {
    /// The same function between `low` and `high`, and constant beyond them; a single point if
    /// nothing is between.
    ///
    /// # Errors
    /// If `low`..`high` is empty or not finite in f32.
    pub fn cut(&self, [low, high]: [f64; 2]) -> Result<Self> {
        if !(holds(low) && holds(high) && low < high) {
            let why =
                format!("{low}..{high} is not a range: it must increase and be finite in f32");
            return Err(Error::value("transfer function range", why));
        }
        let point = |value, (color, opacity)| TransferPoint { value, color, opacity };
        let begin = point(low, self.at(low));
        let end = point(high, self.before(high));
        let inner = self.points.iter().filter(|point| point.value > low && point.value < high);
        Ok(Self { points: [begin].into_iter().chain(inner.copied()).chain([end]).collect() })
    }

    /// The same function over values that are multiplied by `scale` (above 0) and then moved by
    /// `offset`.
    #[must_use]
    pub fn mapped(&self, scale: f64, offset: f64) -> Self {
        let points = self.points.iter();
        let points =
            points.map(|point| TransferPoint { value: point.value * scale + offset, ..*point });
        Self { points: tidy(points) }
    }
}

/// Whether a stored value can be `value`, which must be finite in f32.
fn holds(value: f64) -> bool {
    value.abs() <= f64::from(f32::MAX)
}

/// `points` without those between two others of the same value, which have no effect.
fn tidy(points: impl Iterator<Item = TransferPoint>) -> Vec<TransferPoint> {
    let mut kept: Vec<TransferPoint> = Vec::new();
    for point in points {
        if let [.., a, b] = kept.as_slice()
            && a.value == point.value
            && b.value == point.value
        {
            kept.pop();
        }
        kept.push(point);
    }
    kept
}

/// What is wrong with `points`, with the index of the point from 0 if it is one point's fault.
fn fault(points: &[TransferPoint]) -> Option<(Option<usize>, String)> {
    if points.is_empty() {
        return Some((None, "it has no points".to_owned()));
    }
    if points.len() > MAX_POINTS {
        return Some((None, too_many(points.len())));
    }
    let wrong = |(at, point): (usize, &TransferPoint)| {
        let channels = ["red", "green", "blue"].into_iter().zip(point.color.to_array());
        let shares = channels.chain([("opacity", point.opacity)]);
        let mut outside = shares.filter(|(_, share)| !(0.0..=1.0).contains(share));
        let before = |count: usize| Some(points[at.checked_sub(count)?].value);
        let why = if !point.value.is_finite() {
            format!("value is {}, not a finite number", point.value)
        } else if !holds(point.value) {
            format!("value is {:e}, which does not fit in f32", point.value)
        } else if let Some((what, share)) = outside.next() {
            format!("{what} is {share}, not in 0..1")
        } else if let Some(before) = before(1).filter(|&before| before > point.value) {
            format!("value falls from {before} to {}", point.value)
        } else if before(2) == Some(point.value) {
            format!("value {} appears more than twice; a jump has two points", point.value)
        } else {
            return None;
        };
        Some((Some(at), why))
    };
    points.iter().enumerate().find_map(wrong)
}

fn too_many(count: usize) -> String {
    format!("it has {count} points, the limit is {MAX_POINTS}")
}

/// The inverse of the sRGB transfer curve, for channels in 0..1.
fn linear_from_srgb(channels: [f64; 3]) -> DVec3 {
    DVec3::from_array(channels.map(|c| image::linear_from_srgb(c).min(1.0)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn point(value: f64, red: f64, opacity: f64) -> TransferPoint {
        TransferPoint { value, color: DVec3::new(red, 0.5, 1.0), opacity }
    }

    #[test]
    fn it_is_linear_between_points_and_constant_beyond() {
        let points = vec![point(-2.0, 0.0, 0.2), point(2.0, 1.0, 0.6)];
        let function = TransferFunction::new(points.clone()).unwrap();
        assert_eq!((function.points(), function.range()), (points.as_slice(), [-2.0, 2.0]));
        for (value, red, opacity) in
            [(-2.0, 0.0, 0.2), (-1.0, 0.25, 0.3), (0.0, 0.5, 0.4), (2.0, 1.0, 0.6)]
        {
            let (color, found) = function.at(value);
            assert!((found - opacity).abs() < 1e-15, "{value}: {found}");
            assert!((color - DVec3::new(red, 0.5, 1.0)).length() < 1e-15, "{value}: {color}");
        }
        for (value, end) in
            [(f64::NEG_INFINITY, 0), (-9.0, 0), (f64::NAN, 0), (9.0, 1), (f64::INFINITY, 1)]
        {
            assert_eq!(function.at(value), (points[end].color, points[end].opacity), "{value}");
        }
    }

    #[test]
    fn two_points_of_one_value_are_a_jump_to_the_second() {
        let points = [(0.0, 0.0), (1.0, 0.25), (1.0, 0.75), (2.0, 1.0), (2.0, 0.5)];
        let points = points.map(|(value, opacity)| point(value, 0.0, opacity));
        let function = TransferFunction::new(points.to_vec()).unwrap();
        let opacity = |value| function.at(value).1;
        assert_eq!([opacity(1.0), opacity(1.5), opacity(2.0)], [0.75, 0.875, 0.5]);
        assert!((opacity(1.0 - 1e-12) - 0.25).abs() < 1e-9);
        assert_eq!([function.before(1.0).1, function.before(2.0).1], [0.25, 1.0]);
        assert_eq!([function.before(-1.0).1, function.before(3.0).1], [0.0, 0.5]);
    }

    #[test]
    fn wrong_points_are_named() {
        let good = point(1.0, 0.5, 0.5);
        let nan = f64::NAN;
        for (points, named) in [
            (vec![], "no points"),
            (vec![good; MAX_POINTS + 1], "65537 points, the limit is 65536"),
            (vec![good, point(nan, 0.5, 0.5)], "point 2: value is NaN"),
            (vec![point(f64::INFINITY, 0.5, 0.5)], "point 1: value is inf"),
            (vec![point(-1e39, 0.5, 0.5)], "point 1: value is -1e39, which does not fit in f32"),
            (vec![good, point(0.5, 0.5, 0.5)], "point 2: value falls from 1 to 0.5"),
            (vec![good, good, good], "point 3: value 1 appears more than twice"),
            (vec![good, point(2.0, 0.5, 1.5)], "point 2: opacity is 1.5, not in 0..1"),
            (vec![point(2.0, 0.5, nan)], "point 1: opacity is NaN"),
            (vec![point(2.0, -0.1, 0.5)], "point 1: red is -0.1, not in 0..1"),
            (vec![point(2.0, nan, 0.5)], "point 1: red is NaN"),
        ] {
            let error = TransferFunction::new(points).unwrap_err().to_string();
            assert!(error.contains(named) && !error.contains('\n'), "{named}: {error}");
        }
    }

    #[test]
    fn a_range_is_moved_as_a_whole() {
        let function =
            TransferFunction::new(vec![point(0.0, 0.0, 0.0), point(0.3, 0.1, 0.2), good_end()])
                .unwrap();
        let moved = function.rescaled([-1000.0, 3000.0]).unwrap();
        assert_eq!(moved.range(), [-1000.0, 3000.0]);
        assert!((moved.points()[1].value - 200.0).abs() < 1e-9);
        assert!((moved.at(900.0).1 - function.at(0.475).1).abs() < 1e-12);
        for range in
            [[0.0, 0.0], [1.0, 0.0], [0.0, f64::NAN], [f64::NEG_INFINITY, 0.0], [0.0, 1e40]]
        {
            let error = function.rescaled(range).unwrap_err().to_string();
            assert!(error.contains("is not a range"), "{error}");
        }
    }

    fn good_end() -> TransferPoint {
        point(1.0, 1.0, 1.0)
    }

    #[test]
    fn a_range_too_narrow_for_all_points_keeps_a_valid_function() {
        let points = (0..50).map(|i| point(f64::from(i), 0.5, f64::from(i) / 49.0)).collect();
        let narrow = [1e30, f64::from_bits(1e30_f64.to_bits() + 1)];
        let moved = TransferFunction::new(points).unwrap().rescaled(narrow).unwrap();
        assert_eq!((moved.range(), fault(moved.points())), (narrow, None));
        assert_eq!((moved.at(0.0).1, moved.at(2e30).1), (0.0, 1.0));
        let single = TransferFunction::new(vec![good_end(); 2]).unwrap();
        assert_eq!(single.rescaled([5.0, 6.0]).unwrap().range(), [5.0, 5.0]);
    }
}
