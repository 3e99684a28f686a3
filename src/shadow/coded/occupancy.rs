//! Occupied slices and the whole opacity: occupancy maps (Sintorn and Assarsson 2009, "Hair self
//! shadowing and transparency depth ordering using occupancy maps").
//!
//! One bit says whether there is anything in a slice. All occupied slices are taken to be alike, so
//! up to a depth a ray has lost the share of its optical depth that the share of occupied slices in
//! front of it is. (The paper keeps the sum of opacities for that; here it is that of optical
//! depths, which is right whatever overlaps.)

use super::bytes::{put_share, share_at};
use super::{Codec, TexelRay, share, through};
use crate::kernel::threshold::optical_depth_of;

/// Numbers of a texel:
///
/// ```text
/// bytes 0..2      opacity of the whole ray, times 65535
/// bytes 2..       slice i of `count`, equally long between the ray's entry and exit: bit i % 8 of
///                 byte 2 + i / 8
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Occupancy {
    pub count: usize,
}

impl Occupancy {
    fn slice(self, share: f64) -> usize {
        ((share * self.count as f64) as usize).min(self.count - 1)
    }
}

/// Whether slice `i` is occupied.
fn is_set(slices: &[u8], i: usize) -> bool {
    slices.get(i / 8).is_some_and(|byte| byte >> (i % 8) & 1 == 1)
}

impl Codec for Occupancy {
    fn stride(&self) -> usize {
        2 + self.count.div_ceil(8)
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        put_share(texel, 0, -(-ray.total()).exp_m1());
        for ([begin, end], _) in ray.slabs() {
            // A slab that ends where a slice begins is not in that slice.
            let last = self.slice(end - f64::from(f32::EPSILON)).max(self.slice(begin));
            for i in self.slice(begin)..=last {
                if let Some(byte) = texel.get_mut(2 + i / 8) {
                    *byte |= 1 << (i % 8);
                }
            }
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let slices = texel.get(2..).unwrap_or_default();
        let place = share(extent, depth) * self.count as f32;
        let whole = place as usize;
        let occupied = |to: usize| (0..to).filter(|&i| is_set(slices, i)).count() as f32;
        let all = occupied(self.count);
        if all == 0.0 || place <= 0.0 {
            return 1.0;
        }
        let part = if is_set(slices, whole) { place - whole as f32 } else { 0.0 };
        let passed = (occupied(whole.min(self.count)) + part) / all;
        through(optical_depth_of(share_at(texel, 0)) * passed.min(1.0))
    }
}
