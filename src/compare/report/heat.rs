//! Pictures for the page: PNG as data URIs, and the colours of differences.

use crate::error::Result;
use crate::image::Image;
use crate::io::png;

/// The colour map "magma" (Smith and van der Walt 2015) at equal distances: lightness rises evenly,
/// also for colour-blind people.
const MAGMA: [[u8; 3]; 9] = [
    [0, 0, 4],
    [28, 16, 68],
    [79, 18, 123],
    [129, 37, 129],
    [181, 54, 122],
    [229, 80, 100],
    [251, 135, 97],
    [254, 194, 135],
    [252, 253, 191],
];
/// The smallest difference that is not black; the scale of colours is logarithmic from here to 1.
pub(super) const LEAST: f64 = 0.001;

/// The picture as on a screen, as a data URI.
pub(super) fn picture(image: &Image, exposure: f32) -> Result<String> {
    Ok(data_uri(&png::encode(image, exposure)?))
}

/// Differences in 0..1, `width` per row, as colours in a data URI.
pub(super) fn differences(width: u32, values: &[f32]) -> Result<String> {
    let rgb: Vec<u8> = values.iter().flat_map(|&value| colour(value.into())).collect();
    let height = values.len() / (width as usize).max(1);
    Ok(data_uri(&png::encode_rgb(width, height as u32, &rgb)?))
}

/// The colours from left to right, as a CSS gradient.
pub(super) fn gradient() -> String {
    let stops = MAGMA.map(|[r, g, b]| format!("rgb({r},{g},{b})"));
    format!("linear-gradient(to right,{})", stops.join(","))
}

fn colour(value: f64) -> [u8; 3] {
    let share = (1.0 - value.max(LEAST).log10() / LEAST.log10()).clamp(0.0, 1.0);
    let place = share * (MAGMA.len() - 1) as f64;
    let before = (place as usize).min(MAGMA.len() - 2);
    let (a, b) = (MAGMA[before], MAGMA[before + 1]);
    let mix = |a: u8, b: u8| f64::from(a) + (f64::from(b) - f64::from(a)) * (place - before as f64);
    [0, 1, 2].map(|c| mix(a[c], b[c]).round() as u8)
}

fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(png))
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let coded = ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|t| base64(t.as_bytes()));
        assert_eq!(coded, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]);
    }

    #[test]
    fn colours_run_from_black_to_light() {
        assert_eq!(colour(0.0), MAGMA[0]);
        assert_eq!(colour(LEAST), MAGMA[0]);
        assert_eq!(colour(1.0), MAGMA[8]);
    }
}
