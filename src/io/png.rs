//! Writes pictures for screens as PNG. Knows nothing of how they were made.

use crate::error::{Error, Result};
use crate::image::{Image, Tone};

/// Encodes `image` as PNG: sRGB, 8 bits per channel, through `tone` (a number is an exposure); with
/// an alpha channel only if some pixel is not opaque.
///
/// # Errors
/// If the encoder fails.
pub fn encode(image: &Image, tone: impl Into<Tone>) -> Result<Vec<u8>> {
    let rgba = image.to_srgb8(tone);
    let size = [image.width, image.height];
    if image.is_opaque(8) {
        let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        encoded(size, png::ColorType::Rgb, png::BitDepth::Eight, &rgb)
    } else {
        encoded(size, png::ColorType::Rgba, png::BitDepth::Eight, &rgba)
    }
}

/// The same with 16 bits per channel.
///
/// # Errors
/// If the encoder fails.
pub fn encode16(image: &Image, tone: impl Into<Tone>) -> Result<Vec<u8>> {
    let rgba = image.to_srgb16(tone);
    let (colour, channels) =
        if image.is_opaque(16) { (png::ColorType::Rgb, 3) } else { (png::ColorType::Rgba, 4) };
    let kept = rgba.chunks_exact(4).flat_map(|pixel| &pixel[..channels]);
    let bytes: Vec<u8> = kept.flat_map(|value| value.to_be_bytes()).collect();
    encoded([image.width, image.height], colour, png::BitDepth::Sixteen, &bytes)
}

/// Encodes 8-bit sRGB pixels, row by row, as PNG.
///
/// # Errors
/// If `rgb` does not hold `3 * width * height` values or the encoder fails.
pub fn encode_rgb(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>> {
    encoded([width, height], png::ColorType::Rgb, png::BitDepth::Eight, rgb)
}

fn encoded(
    [width, height]: [u32; 2],
    colour: png::ColorType,
    depth: png::BitDepth,
    pixels: &[u8],
) -> Result<Vec<u8>> {
    let failed = |error: png::EncodingError| Error::value("png", error.to_string());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    // Files get a quarter to two fifths larger than with the default level, which would take some
    // percent of the time of a small volume's picture.
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}
