//! Transmittance at equal distances in 8 bits: opacity shadow maps (Kim and Neumann 2001), with
//! layers between each ray's entry and exit.

use super::{Codec, TexelRay, share, through};

/// Byte `i` of a texel is transmittance times 255 at the end of part `i` of `count` equal parts of
/// the ray. Between the ends transmittance is linear; at the ray's entry it is 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slices {
    pub count: usize,
}

/// Transmittance at a share of the extent: linear between the values of `at` at the ends of `count`
/// equal parts, and 1 at the ray's entry.
pub(super) fn between_slices(share: f32, count: usize, at: impl Fn(usize) -> f32) -> f32 {
    let place = share * count as f32;
    let after = (place as usize).min(count - 1);
    let before = if after == 0 { 1.0 } else { at(after - 1) };
    before + (at(after) - before) * (place - after as f32)
}

impl Codec for Slices {
    fn stride(&self) -> usize {
        self.count
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        for (i, byte) in texel.iter_mut().enumerate() {
            let depth = ray.optical_depth((i + 1) as f32 / self.count as f32);
            *byte = (through(depth) * 255.0).round() as u8;
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let at = |i: usize| texel.get(i).map_or(1.0, |&byte| f32::from(byte) / 255.0);
        between_slices(share(extent, depth), self.count, at)
    }
}
