//! The difference of a picture from the true one, as numbers and as a picture of the differences.
//!
//! The comparison uses what a screen shows: sRGB-encoded values in 0..1 over black. They are not
//! rounded to 8 bits, so that errors far below that can still be distinguished.

mod colour;
mod flip;
mod plane;
mod ssim;

pub use flip::PIXELS_PER_DEGREE;

use crate::image::{Image, srgb_from_linear};
use flip::Seen;
use plane::Plane;

/// The difference of one picture from another.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// Peak signal-to-noise ratio of R, G, B in dB; infinite for equal pictures.
    pub psnr: f64,
    /// Mean structural similarity of luma; 1 for equal pictures.
    pub ssim: f64,
    /// Mean LDR-FLIP, 0 (equal) to 1.
    pub flip: f64,
    /// LDR-FLIP of each pixel, 0..1, row 0 on top.
    pub map: Vec<f32>,
}

/// The true picture, prepared for comparison with several others.
#[derive(Clone, Debug)]
pub struct TruePicture {
    width: u32,
    srgb: Vec<[f64; 3]>,
    luma: Plane,
    seen: Seen,
    exposure: f32,
}

impl TruePicture {
    /// Prepares `image`, multiplied by `exposure`.
    pub fn new(image: &Image, exposure: f32) -> Self {
        let srgb = encoded(image, exposure);
        let luma = luma(image.width, &srgb);
        let seen = Seen::of(image.width as usize, &srgb, PIXELS_PER_DEGREE);
        Self { width: image.width, srgb, luma, seen, exposure }
    }

    /// The difference of `image` from the true picture.
    ///
    /// # Panics
    /// If its size differs.
    pub fn difference(&self, image: &Image) -> Difference {
        let size = (image.width, image.pixels.len());
        assert_eq!(size, (self.width, self.srgb.len()), "pictures of one size");
        let srgb = encoded(image, self.exposure);
        let squares: f64 = srgb
            .iter()
            .zip(&self.srgb)
            .flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).powi(2)))
            .sum();
        let mean = squares / (3 * srgb.len()).max(1) as f64;
        let seen = Seen::of(image.width as usize, &srgb, PIXELS_PER_DEGREE);
        let map = self.seen.differences(&seen);
        Difference {
            psnr: -10.0 * mean.log10(),
            ssim: ssim::ssim(&self.luma, &luma(image.width, &srgb)),
            flip: map.iter().sum::<f64>() / map.len().max(1) as f64,
            map: map.into_iter().map(|x| x as f32).collect(),
        }
    }
}

fn encoded(image: &Image, exposure: f32) -> Vec<[f64; 3]> {
    let pixels = image.pixels.iter();
    pixels.map(|&[r, g, b, _]| [r, g, b].map(|c| srgb_from_linear(c * exposure).into())).collect()
}

/// Rec. 709 luma of encoded pixels.
fn luma(width: u32, srgb: &[[f64; 3]]) -> Plane {
    let values = srgb.iter().map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
    Plane::new(width as usize, values.collect())
}
