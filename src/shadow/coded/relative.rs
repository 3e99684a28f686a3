//! Seven depths at shares of the texel's own opacity, and transmittance reconstructed from them.
//!
//! The idea is the threshold map's (Volumetric Deep Shadow Maps, "Implementation": depths where
//! opacity reaches fixed values, and the largest opacity A). Here every threshold is a share of A,
//! as in unset channels with the threshold map's default lookup, so each depth is reached in every
//! texel; and numbers take 16 bits instead of 32. The curve through the points is the default
//! lookup's: `kernel::threshold`.

use super::bytes::{put_share, share_at};
use super::{Codec, TexelRay, share, through};
use crate::kernel::threshold::{hermite, optical_depth_of, run_out, slope_between};

/// Numbers of a texel (u16, times 1 / 65535):
///
/// ```text
/// bytes  0..14  where opacity reaches share i of A, 0 (the ray enters) to 1 (it leaves)
/// bytes 14..16  A, the largest opacity; 0 marks an empty ray
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Relative;

const POINTS: usize = 7;

/// The shares of A whose depths are kept.
const SHARES: [f32; POINTS] = [0.05, 0.2, 0.4, 0.6, 0.78, 0.91, 0.98];

/// Least distance between two depths, in shares of the ray, so that depths which 16 bits do not
/// separate stay apart.
const NEAREST: f32 = 0.25 / 65535.0;

fn levels(opacity: f32) -> [f32; POINTS] {
    SHARES.map(|share| -(-share * opacity).ln_1p())
}

impl Codec for Relative {
    fn stride(&self) -> usize {
        2 * (POINTS + 1)
    }

    fn encode(&self, ray: &TexelRay<'_>, texel: &mut [u8]) {
        let opacity = -(-ray.total()).exp_m1();
        for (i, level) in levels(opacity).into_iter().enumerate() {
            put_share(texel, i, ray.share_at(level));
        }
        put_share(texel, POINTS, opacity);
    }

    fn transmittance(&self, texel: &[u8], extent: [f32; 2], depth: f32) -> f32 {
        let opacity = share_at(texel, POINTS);
        let place = share(extent, depth);
        if place == 0.0 || opacity == 0.0 {
            return 1.0;
        }
        let total = optical_depth_of(opacity);
        if place == 1.0 {
            return through(total);
        }
        let mut deepest = 0.0_f32;
        let z: [f32; POINTS] = std::array::from_fn(|i| {
            deepest = deepest.max(share_at(texel, i));
            deepest
        });
        through(optical_depth(&z, &levels(opacity), total, place))
    }
}

/// Optical depth at `place`: zero, an onset, cubics through the points (`z`, `tau`), an end, then
/// `total`.
fn optical_depth(z: &[f32; POINTS], tau: &[f32; POINTS], total: f32, place: f32) -> f32 {
    const LAST: usize = POINTS - 1;
    let gap = |i: usize| (z[i + 1] - z[i]).max(NEAREST);
    let secant = |i: usize| ((tau[i + 1] - tau[i]) / gap(i)).max(1e-12);
    let onset = || {
        let steep = secant(0);
        run_out(tau[0], steep, [0.6 * steep, 0.0], z[0])
    };
    let end = || {
        let (before, steep) = (secant(LAST - 2), secant(LAST - 1));
        let slope = (1.25 * (before * steep).sqrt()).max(0.5 * steep).min(3.0 * steep);
        run_out((total - tau[LAST]).max(0.0), steep, [slope, 0.0], 1.0 - z[LAST])
    };
    let slope = |i: usize| match i {
        0 => onset().y,
        LAST => end().y,
        _ => slope_between(secant(i - 1), secant(i)),
    };
    let after = z.partition_point(|&z| z <= place);
    let (from, length, values, slopes) = if after == 0 {
        let onset = onset();
        let length = onset.x.max(1e-30);
        (z[0] - length, length, [0.0, tau[0]], [onset.z, onset.y])
    } else if after < POINTS {
        let i = after - 1;
        (z[i], gap(i), [tau[i], tau[after]], [slope(i), slope(after)])
    } else {
        let end = end();
        (z[LAST], end.x.max(1e-30), [tau[LAST], total.max(tau[LAST])], [end.y, end.z])
    };
    let u = ((place - from) / length).clamp(0.0, 1.0);
    hermite(u, values, slopes.map(|slope| slope * length))
}
