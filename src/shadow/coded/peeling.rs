//! The layers nearest to the light: depth peeling (Everitt 2001, "Interactive order-independent
//! transparency").
//!
//! Each pass of depth peeling finds one more layer, so there are a few of them. All that is behind
//! the last one counts as part of it, so that shadows end as dark as they are. A slab of a medium is
//! a layer in its middle.

use super::bytes::{put_share, share_at};
use super::{Codec, TexelRay, share, through};
use crate::kernel::threshold::optical_depth_of;

/// Numbers of a texel (u16, times 1 / 65535):
///
/// ```text
/// bytes 4 i .. 4 i + 2      place of layer i of `count`, 0 (the ray enters) to 1 (it leaves)
/// bytes 4 i + 2 .. 4 i + 4  opacity of the first i + 1 layers
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Peeling {
    pub count: usize,
}

impl Codec for Peeling {
    fn stride(&self) -> usize {
        4 * self.count
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let (mut next, mut sum) = (0, 0.0);
        for ([begin, end], optical_depth) in ray.slabs() {
            sum += optical_depth;
            if next < self.count {
                put_share(texel, 2 * next, (0.5 * (begin + end)) as f32);
                next += 1;
            }
            put_share(texel, 2 * next - 1, -(-sum).exp_m1() as f32);
        }
        // Those that are missing are behind everything and add nothing.
        let opacity = share_at(texel, (2 * next).saturating_sub(1));
        for i in next..self.count {
            put_share(texel, 2 * i, 1.0);
            put_share(texel, 2 * i + 1, if next > 0 { opacity } else { 0.0 });
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let place = share(extent, depth);
        if place <= 0.0 {
            return 1.0;
        }
        let passed = (0..self.count).take_while(|&i| share_at(texel, 2 * i) <= place).last();
        through(passed.map_or(0.0, |i| optical_depth_of(share_at(texel, 2 * i + 1))))
    }
}
