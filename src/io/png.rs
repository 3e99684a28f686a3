//! Pictures for screens.

use std::io::Cursor;

use image::ImageFormat;

use crate::error::{Error, Result};
use crate::image::Image;

/// A PNG of `image`: sRGB, 8 bits a channel, after `exposure`; with alpha only where some pixel is
/// not opaque.
///
/// # Errors
/// If the encoder fails.
pub fn encode(image: &Image, exposure: f32) -> Result<Vec<u8>> {
    let rgba = image.to_srgb8(exposure);
    if rgba.chunks_exact(4).all(|pixel| pixel[3] == 255) {
        let rgb = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        encode_rgb(image.width, image.height, rgb)
    } else {
        encoded(image::RgbaImage::from_raw(image.width, image.height, rgba))
    }
}

/// A PNG of 8-bit sRGB pixels, row by row.
///
/// # Errors
/// If `rgb` does not hold `3 * width * height` values or the encoder fails.
pub fn encode_rgb(width: u32, height: u32, rgb: Vec<u8>) -> Result<Vec<u8>> {
    encoded(image::RgbImage::from_raw(width, height, rgb))
}

fn encoded<P>(buffer: Option<image::ImageBuffer<P, Vec<u8>>>) -> Result<Vec<u8>>
where
    P: image::PixelWithColorType<Subpixel = u8>,
{
    let failed = |why: String| Error::value("png", why);
    let buffer = buffer.ok_or_else(|| failed("pixels do not fill the picture".to_owned()))?;
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, ImageFormat::Png).map_err(|error| failed(error.to_string()))?;
    Ok(bytes.into_inner())
}
