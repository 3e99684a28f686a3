//! Writes pictures for screens as JPEG.

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::{PictureFormat, failed};
use crate::error::Result;
use crate::image::{Image, Tone};

/// The quality of the format's usual scale up to 100 at which its errors stop being visible.
const QUALITY: u8 = 95;

/// Encodes the picture in front of black, with colour at full resolution.
pub(super) fn encode(image: &Image, tone: Tone) -> Result<Vec<u8>> {
    let failed = failed(PictureFormat::Jpeg);
    let pixels = image.over_black().to_srgb8(tone);
    let size = [image.width, image.height].map(u16::try_from);
    let [Ok(width), Ok(height)] = size else {
        return Err(failed(&"no edge can have more than 65535 pixels"));
    };
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    let encoded = encoder.encode(&pixels, width, height, ColorType::Rgba);
    encoded.map_err(|error| failed(&error))?;
    Ok(bytes)
}
