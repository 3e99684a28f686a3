//! Layers that follow the medium's front: deep opacity maps (Yuksel and Keyser 2008).
//!
//! Their first pass keeps the depth where the light first meets a medium. Their second pass keeps
//! the opacity of layers at growing distances behind that depth, so that the layers take the
//! medium's shape. Here the distances grow evenly (1, 3, 6, 10, ... parts) up to where the ray
//! leaves the volume, and optical depth is linear between two layers.

use super::bytes::{put_share, share_at};
use super::{Codec, TexelRay, share, through};
use crate::kernel::threshold::optical_depth_of;

/// Numbers of a texel (u16, times 1 / 65535):
///
/// ```text
/// bytes 0..2                the medium's front, 0 (the ray enters) to 1 (it leaves)
/// bytes 2 + 2 i .. 4 + 2 i  opacity at the end of layer i of `count`
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Layers {
    pub count: usize,
}

impl Layers {
    /// Where the first `i` layers end, as a share of the way from the front to the ray's exit.
    fn end(self, i: usize) -> f32 {
        (i * (i + 1)) as f32 / (self.count * (self.count + 1)) as f32
    }
}

impl Codec for Layers {
    fn stride(&self) -> usize {
        2 * (self.count + 1)
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let front = ray.slabs().next().map_or(1.0, |([front, _], _)| front as f32);
        put_share(texel, 0, front);
        let front = share_at(texel, 0);
        for i in 1..=self.count {
            let optical_depth = ray.optical_depth(front + (1.0 - front) * self.end(i));
            put_share(texel, i, -(-optical_depth).exp_m1());
        }
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let front = share_at(texel, 0);
        let behind = ((share(extent, depth) - front) / (1.0 - front)).min(1.0);
        // The depth is in front of the medium, or there is no medium.
        if behind.is_nan() || behind <= 0.0 {
            return 1.0;
        }
        let after = (1..self.count).take_while(|&i| self.end(i) <= behind).count() + 1;
        let at = |i: usize| if i == 0 { 0.0 } else { optical_depth_of(share_at(texel, i)) };
        let step = (behind - self.end(after - 1)) / (self.end(after) - self.end(after - 1));
        through(at(after - 1) + (at(after) - at(after - 1)) * step)
    }
}
