//! The colour of glowing matter: black-body radiation.

use glam::DVec3;

use super::transfer::{TransferFunction, TransferPoint};
use crate::error::{Error, Result};

/// Number of points of a ramp.
const POINTS: u32 = 48;
/// The sampled spectrum: count, first wavelength and step, in nanometres; 380 to 780.
const WAVELENGTHS: (u32, f64, f64) = (81, 380.0, 5.0);
/// Planck's second radiation constant, in nanometre kelvin.
const SECOND_RADIATION: f64 = 1.438_776_877e7;

/// A black body's radiance as a function over `values`, whose ends have the temperatures `kelvin`.
/// Colours have their largest channel at 1; opacities are the radiance as a share of that at the
/// hotter end.
///
/// # Errors
/// If either range does not rise or is not finite, or if a temperature is not above 0.
pub(super) fn blackbody(
    [low, high]: [f64; 2],
    [coldest, hottest]: [f64; 2],
) -> Result<TransferFunction> {
    if !(coldest > 0.0 && coldest < hottest && hottest <= 1e6) {
        let why = format!("{coldest}, {hottest} are not in increasing order between 0 and 1e6");
        return Err(Error::value("volume.emission.kelvin", why));
    }
    let brightest = radiance(hottest).max_element();
    let point = |i: u32| {
        let share = f64::from(i) / f64::from(POINTS - 1);
        let own = radiance(coldest + share * (hottest - coldest));
        let largest = own.max_element().max(f64::MIN_POSITIVE);
        TransferPoint {
            value: low + share * (high - low),
            color: own / largest,
            opacity: (largest / brightest).min(1.0),
        }
    };
    TransferFunction::new((0..POINTS).map(point).collect())
}

/// Linear RGB (sRGB primaries) of a black body, in an arbitrary unit; colours outside of the gamut
/// are clipped.
fn radiance(kelvin: f64) -> DVec3 {
    let (count, first, step) = WAVELENGTHS;
    let mut xyz = DVec3::ZERO;
    for i in 0..count {
        let nanometres = first + f64::from(i) * step;
        let exponent = (SECOND_RADIATION / (nanometres * kelvin)).min(700.0);
        xyz += matching(nanometres) / ((nanometres / 560.0).powi(5) * exponent.exp_m1());
    }
    let rgb = DVec3::new(
        xyz.dot(DVec3::new(3.240_625, -1.537_208, -0.498_629)),
        xyz.dot(DVec3::new(-0.968_931, 1.875_756, 0.041_518)),
        xyz.dot(DVec3::new(0.055_710, -0.204_021, 1.056_996)),
    );
    rgb.max(DVec3::ZERO)
}

/// The CIE 1931 colour matching functions, as sums of Gaussians with different widths on their two
/// sides (Wyman, Sloan and Shirley 2013, multi-lobe fit).
fn matching(nanometres: f64) -> DVec3 {
    let lobe = |height: f64, middle: f64, [left, right]: [f64; 2]| {
        let width = if nanometres < middle { left } else { right };
        height * (-0.5 * ((nanometres - middle) / width).powi(2)).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, [37.9, 31.0])
            + lobe(0.362, 442.0, [16.0, 26.7])
            + lobe(-0.065, 501.1, [20.4, 26.2]),
        lobe(0.821, 568.8, [46.9, 40.5]) + lobe(0.286, 530.9, [16.3, 31.1]),
        lobe(1.217, 437.0, [11.8, 36.0]) + lobe(0.681, 459.0, [26.0, 13.8]),
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn daylight_is_white_and_embers_are_red() {
        let day = radiance(6504.0);
        let day = day / day.max_element();
        assert!(day.min_element() > 0.9, "{day}");
        let ember = radiance(1200.0);
        assert!(ember.x > 4.0 * ember.y && ember.y > ember.z, "{ember}");
        let ramp = blackbody([0.0, 2.0], [1000.0, 3000.0]).unwrap();
        assert!(ramp.at(2.0).1 > 0.999 && ramp.at(1.0).1 < 0.1 && ramp.at(0.0).1 < 1e-3);
        assert!(blackbody([0.0, 1.0], [3000.0, 1000.0]).is_err());
    }
}
