//! Depths at which random light is stopped: stochastic transparency (Enderton, Sintorn, Shirley and
//! Luebke 2010, section 5, stochastic shadow maps).
//!
//! Each sample of a texel is a photon. It is stopped by what it meets with the opacity of that, so
//! it gets to a depth with the transmittance there, and the share of samples that get farther is an
//! estimate of it. Samples are stratified (their section 4.2): sample i of N is one whose chance to
//! get no farther is between i / N and (i + 1) / N.

use super::bytes::{put_share, share_at};
use super::{Codec, TexelRay, share};
use crate::kernel::threshold::optical_depth_of;

/// The largest depth that is stored; the next one stands for light that is not stopped.
const DEEPEST: f32 = 1.0 - 1.0 / 65_535.0;

/// The u16 at index `i` of `count`, times 1 / 65535, is the place where a sample is stopped, 0 (the
/// ray enters) to 65534 / 65535 (it leaves); 1 if it is not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stochastic {
    pub count: usize,
}

/// A number that a ray's nodes seed.
fn seed(ray: &TexelRay<'_>) -> u64 {
    let mix = |sum: u64, bits: u32| (sum ^ u64::from(bits)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ray.nodes.iter().take(8).fold(0x5851_F42D_4C95_7F2D, |sum, node| {
        mix(mix(sum, node.depth.to_bits()), node.optical_depth.to_bits())
    })
}

impl Codec for Stochastic {
    fn stride(&self) -> usize {
        2 * self.count
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let (mut state, total) = (seed(ray) | 1, ray.total());
        for i in 0..self.count {
            // xorshift64*
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            let random = (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40) as f32 / 16_777_216.0;
            let lost = optical_depth_of((i as f32 + random) / self.count as f32);
            let stops = lost < total;
            put_share(texel, i, if stops { ray.share_at(lost).min(DEEPEST) } else { 1.0 });
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let place = share(extent, depth);
        if place <= 0.0 {
            return 1.0;
        }
        // What is stopped on the way out is stopped behind it too.
        let place = place.min(DEEPEST);
        let stopped = (0..self.count).filter(|&i| share_at(texel, i) <= place).count();
        1.0 - stopped as f32 / self.count as f32
    }
}
