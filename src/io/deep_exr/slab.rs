//! Slabs of fog along a ray, as the channels Z, ZBack and A store them.

use super::header::{Channel, DeepHeader};
use super::row::DeepRow;

/// A piece of a ray, with its optical depth. Inside, optical depth is linear in depth; a slab that
/// ends where it begins is a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    /// Depth where it begins, in the image's unit (world lengths in files that this crate writes).
    pub front: f32,
    /// Depth where it ends; at least `front`.
    pub back: f32,
    /// Optical depth: transmittance is exp of minus this. Infinite for an opaque slab.
    pub optical_depth: f32,
}

/// An overlap of less than this share of the depth is a rounding error.
const ROUNDING: f32 = 1e-6;

impl Slab {
    /// The largest optical depth that f32 opacity stores accurately: to 3e-6 at 4.
    pub const MOST_OPTICAL_DEPTH: f32 = 4.0;

    /// A slab of opacity `alpha`, clamped to 0..1.
    pub fn with_alpha(front: f32, back: f32, alpha: f32) -> Self {
        let optical_depth = -f64::from(-alpha.clamp(0.0, 1.0)).ln_1p() as f32;
        Self { front, back, optical_depth }
    }

    /// The slab's opacity, 0..1.
    pub fn alpha(&self) -> f32 {
        -f64::from(-self.optical_depth).exp_m1() as f32
    }

    /// The channels of slabs: A, Z, ZBack.
    pub fn channels() -> Vec<Channel> {
        ["A", "Z", "ZBack"].map(Channel::float).into()
    }

    /// The slab, which must lie behind depth `last`; a rounding error of overlap is cut off.
    pub(super) fn behind(mut self, last: f32) -> Result<Self, String> {
        let Self { front, back, optical_depth } = self;
        if !(front.is_finite() && back.is_finite() && back >= front) {
            return Err(format!("a slab cannot extend from depth {front} to {back}"));
        }
        if optical_depth.is_nan() || optical_depth < 0.0 {
            return Err(format!(
                "a slab at depth {front} cannot have optical depth {optical_depth}"
            ));
        }
        if front < last {
            if last - front > ROUNDING * last.abs() {
                return Err(format!("a slab at depth {front} overlaps one that ends at {last}"));
            }
            (self.front, self.back) = (last, back.max(last));
        }
        Ok(self)
    }

    /// The same medium as several slabs, whose opacities preserve their optical depth.
    pub(super) fn parts(self) -> impl Iterator<Item = Self> {
        const MOST: f32 = 64.0;
        let Self { front, back, optical_depth } = self;
        let whole = front == back || optical_depth.is_infinite();
        let count = (optical_depth / Self::MOST_OPTICAL_DEPTH).ceil().clamp(1.0, MOST);
        let count = if whole { 1 } else { count as u32 };
        let depth = move |k: u32| match k {
            0 => front,
            k if k == count => back,
            k => front + (back - front) * (k as f32 / count as f32),
        };
        (0..count).map(move |k| Self {
            front: depth(k),
            back: depth(k + 1),
            optical_depth: optical_depth / count as f32,
        })
    }
}

/// Indices of a header's slab channels.
#[derive(Clone, Copy, Debug)]
pub struct SlabChannels {
    z: usize,
    z_back: Option<usize>,
    alpha: Option<usize>,
}

impl SlabChannels {
    /// The slab channels of `header`; `None` without Z. Without A samples are opaque; without ZBack
    /// they are surfaces.
    pub fn of(header: &DeepHeader) -> Option<Self> {
        let [z, z_back, alpha] = ["Z", "ZBack", "A"].map(|name| header.channel(name));
        Some(Self { z: z?, z_back, alpha })
    }

    /// The slabs of pixel `x` as they are stored; in a tidy file by rising depth and without
    /// overlap.
    pub fn slabs<'a>(&self, row: &'a DeepRow, x: usize) -> impl Iterator<Item = Slab> + 'a {
        let Self { z, z_back, alpha } = *self;
        row.pixel(x).map(move |index| {
            let front = row.value(Some(z), index, 0.0);
            let back = row.value(z_back, index, front).max(front);
            Slab::with_alpha(front, back, row.value(alpha, index, 1.0))
        })
    }
}
