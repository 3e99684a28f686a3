//! Writes pictures as NumPy arrays: shape (height, width, 4), row 0 on top, R, G, B (linear
//! radiance, premultiplied) and A as 32-bit floats.

use crate::error::Result;
use crate::image::Image;
use crate::io::dense::npy::encode_array;

pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let shape = [image.height as usize, image.width as usize, 4];
    encode_array(&shape, image.pixels.as_flattened().iter().copied())
}
