//! Boxes of voxel indices. They know nothing of values.

use glam::IVec3;

/// The voxels from `min` to `max`, inclusive, along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexBox {
    /// Lowest index along each axis.
    pub min: IVec3,
    /// Highest index along each axis, inclusive; not below `min`.
    pub max: IVec3,
}

impl IndexBox {
    /// The cube with an edge of 2^`log` voxels whose lowest voxel is `origin`, a multiple of that
    /// edge.
    pub(super) fn cube(origin: IVec3, log: u32) -> Self {
        Self { min: origin, max: origin | IVec3::splat((1 << log) - 1) }
    }

    /// Number of voxels along x, y and z.
    pub fn dims(&self) -> [u64; 3] {
        let length = |min: i32, max: i32| (i64::from(max) - i64::from(min) + 1).max(0) as u64;
        [
            length(self.min.x, self.max.x),
            length(self.min.y, self.max.y),
            length(self.min.z, self.max.z),
        ]
    }

    /// Number of voxels in the box, saturating at `u64::MAX`.
    pub fn voxels(&self) -> u64 {
        let [x, y, z] = self.dims();
        x.saturating_mul(y).saturating_mul(z)
    }

    /// The box enlarged by `voxels` on every side, clamped to 32-bit indices.
    #[must_use]
    pub fn padded(&self, voxels: u32) -> Self {
        let voxels = voxels.min(i32::MAX as u32) as i32;
        let min = self.min.to_array().map(|index| index.saturating_sub(voxels));
        let max = self.max.to_array().map(|index| index.saturating_add(voxels));
        Self { min: min.into(), max: max.into() }
    }

    /// Whether the voxel is in the box.
    pub fn contains(&self, index: IVec3) -> bool {
        index.cmpge(self.min).all() && index.cmple(self.max).all()
    }

    /// The box of voxels that are in both; `None` if there are none.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let both = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        both.min.cmple(both.max).all().then_some(both)
    }

    /// The smallest box that contains both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}
