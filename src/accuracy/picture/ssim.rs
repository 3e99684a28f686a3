//! Structural similarity: Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error
//! Visibility to Structural Similarity", IEEE Transactions on Image Processing 13(4), 2004, with
//! their window (a Gaussian of 1.5 pixels, 11 x 11) and constants. Beyond its border a picture is
//! extended with the border's values, so that every pixel counts.

use super::plane::{Plane, gaussian};

/// (K L)^2 of the luminance and of the contrast term, for values in 0..1.
const STABILISERS: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// Mean structural similarity of two planes of equal size with values in 0..1; 1 for equal ones.
pub(super) fn ssim(a: &Plane, b: &Plane) -> f64 {
    let mut window = gaussian(1.5, 5);
    let sum: f64 = window.iter().sum();
    for w in &mut window {
        *w /= sum;
    }
    let mean = |f: fn(f64, f64) -> f64| {
        let values = a.values.iter().zip(&b.values).map(|(&a, &b)| f(a, b)).collect();
        Plane::new(a.width, values).filtered(&window, &window).values
    };
    let (means_a, means_b) = (mean(|a, _| a), mean(|_, b| b));
    let squares = (mean(|a, _| a * a), mean(|_, b| b * b));
    let products = mean(|a, b| a * b);
    let [luminance, contrast] = STABILISERS;
    let similarity = |i: usize| {
        let (ma, mb) = (means_a[i], means_b[i]);
        let (va, vb) = (squares.0[i] - ma * ma, squares.1[i] - mb * mb);
        let covariance = products[i] - ma * mb;
        (2.0 * ma * mb + luminance) * (2.0 * covariance + contrast)
            / ((ma * ma + mb * mb + luminance) * (va + vb + contrast))
    };
    let count = a.values.len();
    (0..count).map(similarity).sum::<f64>() / count.max(1) as f64
}
