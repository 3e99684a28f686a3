//! Writes pictures as NumPy arrays: shape (height, width, 4), row 0 on top, R, G, B (linear
//! radiance, premultiplied) and A as 32-bit floats.

use crate::error::{Result, memory};
use crate::image::Image;
use crate::io::dense::npy::head_of;

pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let mut bytes = head_of("<f4", &[image.height as usize, image.width as usize, 4]);
    let values = image.pixels.as_flattened();
    memory::check(4 * values.len() as u64, "a NumPy file")?;
    bytes.reserve_exact(4 * values.len());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    Ok(bytes)
}
