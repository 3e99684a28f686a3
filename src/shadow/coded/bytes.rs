//! Numbers in the bytes of a texel, little endian. What lies beyond its end is 0 and not written.

/// The u16 number `i` as a share of the largest, 0..1.
pub(super) fn share_at(texel: &[u8], i: usize) -> f32 {
    let number = texel.as_chunks().0.get(i).map_or(0, |&bytes| u16::from_le_bytes(bytes));
    f32::from(number) / f32::from(u16::MAX)
}

/// The f32 number `i`.
pub(super) fn f32_at(texel: &[u8], i: usize) -> f32 {
    texel.as_chunks().0.get(i).map_or(0.0, |&bytes| f32::from_le_bytes(bytes))
}

/// The f32 number `i` as a transmittance: 0..1, and 0 where it is no number.
pub(super) fn transmittance_at(texel: &[u8], i: usize) -> f32 {
    let through = f32_at(texel, i);
    if through > 0.0 { through.min(1.0) } else { 0.0 }
}

/// Makes `share`, 0..1, the u16 number `i`.
pub(super) fn put_share(texel: &mut [u8], i: usize, share: f32) {
    if let Some(bytes) = texel.as_chunks_mut().0.get_mut(i) {
        *bytes = ((share * f32::from(u16::MAX)).round() as u16).to_le_bytes();
    }
}

/// Makes `number` the f32 number `i`.
pub(super) fn put_f32(texel: &mut [u8], i: usize, number: f32) {
    if let Some(bytes) = texel.as_chunks_mut().0.get_mut(i) {
        *bytes = number.to_le_bytes();
    }
}
