//! Writes pictures for screens as PNG. Knows nothing of how they were made.

use crate::error::{Error, Result};
use crate::image::Image;

/// Encodes `image` as PNG: sRGB, 8 bits per channel, after multiplication by `exposure`; with an
/// alpha channel only if some pixel is not opaque.
///
/// # Errors
/// If the encoder fails.
pub fn encode(image: &Image, exposure: f32) -> Result<Vec<u8>> {
    let rgba = image.to_srgb8(exposure);
    if rgba.chunks_exact(4).all(|pixel| pixel[3] == 255) {
        let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        encode_rgb(image.width, image.height, &rgb)
    } else {
        encoded(image.width, image.height, png::ColorType::Rgba, &rgba)
    }
}

/// Encodes 8-bit sRGB pixels, row by row, as PNG.
///
/// # Errors
/// If `rgb` does not hold `3 * width * height` values or the encoder fails.
pub fn encode_rgb(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>> {
    encoded(width, height, png::ColorType::Rgb, rgb)
}

fn encoded(width: u32, height: u32, colour: png::ColorType, pixels: &[u8]) -> Result<Vec<u8>> {
    let failed = |error: png::EncodingError| Error::value("png", error.to_string());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    // Files get a quarter to two fifths larger than with the default level, which would take some
    // percent of the time of a small volume's picture.
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}
