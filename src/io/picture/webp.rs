//! Writes pictures for screens as lossless WebP.

use image_webp::{ColorType, WebPEncoder};

use super::{PictureFormat, failed};
use crate::error::Result;
use crate::image::{Image, Tone};

/// The format's longest edge in pixels.
const LONGEST: u32 = 1 << 14;

/// Encodes the picture, with alpha only if some pixel is not opaque.
pub(super) fn encode(image: &Image, tone: Tone) -> Result<Vec<u8>> {
    let failed = failed(PictureFormat::WebP);
    let [width, height] = [image.width, image.height];
    if width.max(height) > LONGEST {
        return Err(failed(&format!("no edge can have more than {LONGEST} pixels")));
    }
    let mut pixels = image.to_srgb8(tone);
    let color = if image.is_opaque(8) {
        pixels = pixels.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        ColorType::Rgb8
    } else {
        ColorType::Rgba8
    };
    let mut bytes = Vec::new();
    let encoded = WebPEncoder::new(&mut bytes).encode(&pixels, width, height, color);
    encoded.map_err(|error| failed(&error))?;
    Ok(bytes)
}
