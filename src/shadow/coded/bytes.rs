//! Reads and writes little-endian numbers in the bytes of a texel. Beyond its end numbers read as 0
//! and are not written.

/// The u16 at index `i`, divided by the largest u16: 0..1.
pub(super) fn share_at(texel: &[u8], i: usize) -> f32 {
    let number = texel.as_chunks().0.get(i).map_or(0, |&bytes| u16::from_le_bytes(bytes));
    f32::from(number) / f32::from(u16::MAX)
}

/// The f32 at index `i`.
pub(super) fn f32_at(texel: &[u8], i: usize) -> f32 {
    texel.as_chunks().0.get(i).map_or(0.0, |&bytes| f32::from_le_bytes(bytes))
}

/// The f32 at index `i` as a transmittance, clamped to 0..1; NaN reads as 0.
pub(super) fn transmittance_at(texel: &[u8], i: usize) -> f32 {
    let through = f32_at(texel, i);
    if through > 0.0 { through.min(1.0) } else { 0.0 }
}

/// Writes `share`, 0..1, as the u16 at index `i`.
pub(super) fn put_share(texel: &mut [u8], i: usize, share: f32) {
    if let Some(bytes) = texel.as_chunks_mut().0.get_mut(i) {
        *bytes = ((share * f32::from(u16::MAX)).round() as u16).to_le_bytes();
    }
}

/// Writes `number` as the f32 at index `i`.
pub(super) fn put_f32(texel: &mut [u8], i: usize, number: f32) {
    if let Some(bytes) = texel.as_chunks_mut().0.get_mut(i) {
        *bytes = number.to_le_bytes();
    }
}
