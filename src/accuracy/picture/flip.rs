//! LDR-FLIP: Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem and Fairchild, "FLIP: A
//! Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
//! 2020. It estimates the differences that a person perceives when flipping between two pictures:
//! colour differences after a model of the eye's blur, increased where edges or points differ.
//! Constants are the paper's; numbers in parentheses are its sections.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::colour::{hunt_lab, linear_from_opponent, opponent_from_linear};
use super::plane::{Plane, gaussian};
use crate::image::linear_from_srgb;

/// Pixels per degree of vision: at 0.7 m from a screen that is 0.7 m wide with 3840 pixels.
pub const PIXELS_PER_DEGREE: f64 = 67.020_643_276_582_26;

/// The contrast sensitivities of the three opponent channels: a1, b1, a2, b2 (table 1).
const SENSITIVITIES: [[f64; 4]; 3] =
    [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
/// The largest b among them.
const WIDEST: f64 = 0.04;
/// Exponent that compresses colour differences, and where the two linear parts of the map meet
/// (4.1.3).
const COLOUR_POWER: f64 = 0.7;
const BEND: [f64; 2] = [0.4, 0.95];
/// Width of the detected features in degrees, and the exponent that compresses their differences
/// (4.2).
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_POWER: f64 = 0.5;

/// A picture as the eye perceives it; computed once for a picture that is compared with several.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// L, a, b with Hunt's adjustment, of the filtered picture.
    colours: Vec<[f64; 3]>,
    /// Strengths of edges and of points.
    features: Vec<[f64; 2]>,
}

impl Seen {
    /// The perceived picture of sRGB-encoded pixels in 0..1, `width` per row.
    pub(super) fn of(width: usize, srgb: &[[f64; 3]], pixels_per_degree: f64) -> Self {
        let opponent = |c: usize| {
            let pixels = srgb.iter();
            let values = pixels.map(|rgb| opponent_from_linear(rgb.map(linear_from_srgb))[c]);
            Plane::new(width, values.collect())
        };
        let channels = [0, 1, 2].map(opponent);
        let grey = channels[0].values.iter().map(|y| (y + 16.0) / 116.0).collect();
        let features = features(&Plane::new(width, grey), pixels_per_degree);
        let [y, cx, cz] =
            [0, 1, 2].map(|c| blurred(&channels[c], SENSITIVITIES[c], pixels_per_degree));
        let colours = (0..srgb.len()).map(|i| {
            let rgb = linear_from_opponent([y.values[i], cx.values[i], cz.values[i]]);
            hunt_lab(rgb.map(|c| c.clamp(0.0, 1.0)))
        });
        Self { colours: colours.collect(), features }
    }

    /// Differences from another picture of the same size, 0..1 per pixel.
    pub(super) fn differences(&self, other: &Self) -> Vec<f64> {
        let most = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(COLOUR_POWER);
        let colours = self.colours.iter().zip(&other.colours);
        let features = self.features.iter().zip(&other.features);
        let pairs = colours.zip(features);
        pairs
            .map(|((&a, &b), (fa, fb))| {
                let colour = bent(hyab(a, b).powf(COLOUR_POWER), most);
                let feature = (fa[0] - fb[0]).abs().max((fa[1] - fb[1]).abs());
                let feature = (FRAC_1_SQRT_2 * feature).powf(FEATURE_POWER).clamp(0.0, 1.0);
                colour.powf(1.0 - feature)
            })
            .collect()
    }
}

/// A channel with the eye's resolution: filtered by one or two Gaussians (4.1.1).
fn blurred(plane: &Plane, [a1, b1, a2, b2]: [f64; 4], pixels_per_degree: f64) -> Plane {
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    // a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees.
    let kernel = |b: f64| gaussian((b / (2.0 * PI * PI)).sqrt() * pixels_per_degree, radius);
    let weight = |a: f64, b: f64| a * (PI / b).sqrt();
    let parts = [(weight(a1, b1), kernel(b1)), (weight(a2, b2), kernel(b2))];
    let total: f64 =
        parts.iter().map(|(weight, kernel)| weight * kernel.iter().sum::<f64>().powi(2)).sum();
    let filtered = parts.iter().filter(|(weight, _)| *weight > 0.0).map(|(weight, kernel)| {
        let across: Vec<f64> = kernel.iter().map(|w| w * weight / total).collect();
        plane.filtered(&across, kernel)
    });
    filtered.reduce(|sum, part| sum.plus(&part)).unwrap_or_else(|| plane.clone())
}

/// Strengths of edges (first derivative of a Gaussian) and of points (second derivative) at every
/// pixel (4.2.1).
fn features(grey: &Plane, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as usize;
    let smooth = gaussian(deviation, radius);
    let sum: f64 = smooth.iter().sum();
    let down: Vec<f64> = smooth.iter().map(|w| w / sum).collect();
    let strength = |derivative: fn(f64, f64) -> f64| {
        let at = |i: usize| i as f64 - radius as f64;
        let taps = smooth.iter().enumerate();
        let mut across: Vec<f64> = taps.map(|(i, g)| derivative(at(i), deviation) * g).collect();
        // Positive weights are normalised to a sum of 1, negative ones to -1.
        let positive: f64 = across.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = across.iter().filter(|w| **w < 0.0).sum();
        for w in &mut across {
            *w /= if *w > 0.0 { positive } else { -negative };
        }
        let (x, y) = (grey.filtered(&across, &down), grey.filtered(&down, &across));
        x.values.into_iter().zip(y.values).map(|(x, y)| x.hypot(y)).collect::<Vec<f64>>()
    };
    let edges = strength(|x, _| -x);
    let points = strength(|x, deviation| (x / deviation).powi(2) - 1.0);
    edges.into_iter().zip(points).map(|(edge, point)| [edge, point]).collect()
}

/// The distance of two colours: the difference in lightness plus the Euclidean distance in the
/// other two channels (4.1.3).
fn hyab([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
    (l1 - l2).abs() + (a1 - a2).hypot(b1 - b2)
}

/// Maps compressed differences up to `most` to 0..1, with most of the range for small ones (4.1.3).
fn bent(difference: f64, most: f64) -> f64 {
    let [place, value] = BEND;
    let bend = place * most;
    if difference < bend {
        value / bend * difference
    } else {
        value + (difference - bend) / (most - bend) * (1.0 - value)
    }
}
