//! Writes pictures as TIFF, packed with Deflate: 8 or 16 bits for screens with straight alpha, or
//! 32-bit floats with premultiplied alpha.

use std::io::{Cursor, Seek, Write};

use ::tiff::encoder::colortype::{ColorType, RGB8, RGB16, RGB32Float};
use ::tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffValue};
use ::tiff::tags::{ExtraSamples, Tag};

use super::{PictureFormat, failed};
use crate::error::Result;
use crate::image::{Image, Tone};

/// Encodes the picture with `bits` per channel, with alpha only if some pixel is not opaque.
pub(super) fn encode(image: &Image, tone: Tone, bits: u32) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let written = match bits {
        8 => write::<RGB8>(&mut bytes, image, &image.to_srgb8(tone)),
        16 => write::<RGB16>(&mut bytes, image, &image.to_srgb16(tone)),
        _ => write::<RGB32Float>(&mut bytes, image, image.pixels.as_flattened()),
    };
    written.map_err(|error| failed(PictureFormat::Tiff)(&error))?;
    Ok(bytes.into_inner())
}

/// Writes RGBA values, row by row, as colours of the type `C` and maybe one more channel.
fn write<C: ColorType<Inner: Copy>>(
    file: impl Write + Seek,
    image: &Image,
    rgba: &[C::Inner],
) -> ::tiff::TiffResult<()>
where
    [C::Inner]: TiffValue,
{
    let bits = u32::from(C::BITS_PER_SAMPLE[0]);
    let is_linear = bits == 32;
    let mut encoder =
        TiffEncoder::new(file)?.with_compression(Compression::Deflate(DeflateLevel::Fast));
    let is_opaque = image.is_opaque(bits);
    if is_opaque && !is_linear {
        // Differences between neighbours pack better. The crate cannot take them with alpha.
        encoder = encoder.with_predictor(Predictor::Horizontal);
    }
    let mut picture = encoder.new_image::<C>(image.width, image.height)?;
    picture
        .encoder()
        .write_tag(Tag::Software, concat!("deepshadow ", env!("CARGO_PKG_VERSION")))?;
    if is_opaque {
        let rgb: Vec<_> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        return picture.write_data(&rgb);
    }
    let alpha =
        if is_linear { ExtraSamples::AssociatedAlpha } else { ExtraSamples::UnassociatedAlpha };
    picture.extra_samples(&[alpha])?;
    picture.write_data(rgba)
}
