//! Volumes: voxel values, their position in the world, and statistics of the values. Knows no file
//! format and no light; values stay as they were stored.
//!
//! ```text
//! index space: voxel centres at integers        world space: right-handed, y up
//!   -0.5        0        1  ...  n-1    n-0.5
//!    |----------x--------x-- ... -x-------|     world = world_from_index * index
//!    border: clamped                   border
//! ```

mod bricks;
mod derived;
mod levels;
mod placement;
pub mod presets;
mod ranks;
mod sparse;
mod statistics;
mod voxels;

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use glam::{DMat4, DVec3};
use ndarray::Array3;

use crate::error::{Error, Result};
use crate::math::Aabb;
pub use bricks::{BRICK, Bricks, Range, brick_edge};
pub use levels::Levels;
use levels::Moved;
pub use placement::{Axis, world_from_index_in_bounds};
use ranks::Ranks;
pub use sparse::{BLOCK, BLOCK_EDGE, BLOCK_VALUES, Part, SparseVoxels, place_of};
pub use statistics::Statistics;
pub use voxels::{Held, Voxels};

/// The largest number of voxels along one axis.
pub const MAX_DIM: usize = 1 << 20;

/// Voxel values on a regular grid, and the grid's place in the world.
///
/// Between voxel centres the density is trilinear, within half a voxel of the border it is clamped,
/// and outside of [`Volume::domain`] it is zero.
#[derive(Clone, Debug)]
pub struct Volume {
    /// Its name in the source: a preset's name, a file's stem, or a grid's name.
    pub name: String,
    /// Densities in the source's own unit; finite and at least 0. Volumes that differ in their place
    /// alone share them.
    voxels: Arc<Voxels>,
    /// Transform from voxel index (x, y, z) to world position, for column vectors.
    world_from_index: DMat4,
    /// The part of index space that holds medium.
    domain: Aabb,
    /// The same before anything was clipped.
    whole: Aabb,
    /// How many stored values were negative, NaN or infinite and became 0.
    replaced: usize,
    /// The largest density.
    largest: f32,
    /// What was done to stored values.
    moved: Moved,
    /// What was asked to be done to them; `None` if the densities were replaced by others.
    levels: Option<Levels>,
    /// The largest density without a few outliers; computed at first use.
    typical: OnceLock<f32>,
    /// Computed at first use.
    bricks: OnceLock<Bricks>,
}

impl Volume {
    /// A volume from densities `values` of shape (z, y, x). Voxels have edges of `spacing` world
    /// lengths along x, y and z. The first voxel's centre is the world's origin, and y points up.
    /// Negative values count as 0.
    ///
    /// # Errors
    /// As [`Volume::new`].
    pub fn from_array(name: &str, values: Array3<f32>, spacing: [f64; 3]) -> Result<Self> {
        Self::new(name, values, DMat4::from_scale(spacing.into()))
    }

    /// A dense volume from values of shape (z, y, x). Negative, NaN and infinite values become 0
    /// and are counted ([`Volume::replaced`]).
    ///
    /// # Errors
    /// If an axis is empty or longer than [`MAX_DIM`], or if `world_from_index` is not affine or
    /// has no inverse.
    pub fn new(
        name: impl Into<String>,
        values: Array3<f32>,
        world_from_index: DMat4,
    ) -> Result<Self> {
        Self::with_levels(name, Voxels::Dense(values), world_from_index, Levels::AsStored)
    }

    /// A volume from dense or sparse values. If a `window` (low, high) is given, stored values
    /// low..high are first mapped to 0..1 and clamped, voxel by voxel before interpolation, so that
    /// negative values (Hounsfield units) keep their order.
    ///
    /// # Errors
    /// As [`Volume::new`], and if the window is empty or not finite.
    pub fn with_window(
        name: impl Into<String>,
        voxels: Voxels,
        world_from_index: DMat4,
        window: Option<[f32; 2]>,
    ) -> Result<Self> {
        Self::with_levels(name, voxels, world_from_index, window.into())
    }

    /// A volume from dense or sparse stored values, which become densities as `levels` specifies.
    ///
    /// # Errors
    /// As [`Volume::with_window`].
    pub fn with_levels(
        name: impl Into<String>,
        mut voxels: Voxels,
        world_from_index: DMat4,
        levels: Levels,
    ) -> Result<Self> {
        let name = name.into();
        if let Voxels::Dense(values) = &mut voxels
            && !values.is_standard_layout()
        {
            *values = values.as_standard_layout().into_owned();
        }
        let moved = levels.apply(&mut voxels)?;
        let [nx, ny, nz] = voxels.dims();
        if [nx, ny, nz].iter().any(|&n| n == 0 || n > MAX_DIM) {
            let why = format!("dims {nx},{ny},{nz} must each be 1 to {MAX_DIM}");
            return Err(Error::value(name, why));
        }
        check_placement(&name, &world_from_index)?;
        let replaced = voxels.clean();
        let largest = voxels.largest();
        let top = DVec3::new(nx as f64, ny as f64, nz as f64) - 0.5;
        let domain = Aabb { min: DVec3::splat(-0.5), max: top };
        let (bricks, typical) = (OnceLock::new(), OnceLock::new());
        Ok(Self {
            name,
            voxels: Arc::new(voxels),
            world_from_index,
            domain,
            whole: domain,
            replaced,
            largest,
            moved,
            levels: Some(levels),
            typical,
            bricks,
        })
    }

    /// The same volume at another place.
    ///
    /// # Errors
    /// If `world_from_index` is not affine or has no inverse.
    pub fn placed(self, world_from_index: DMat4) -> Result<Self> {
        check_placement(&self.name, &world_from_index)?;
        Ok(Self { world_from_index, ..self })
    }

    /// The same volume with its values in blocks, where equal blocks are stored once. It takes less
    /// memory where much of it is empty, and is a little slower to sample.
    #[must_use]
    pub fn sparse(mut self) -> Self {
        if let Voxels::Dense(_) = &*self.voxels {
            self.voxels = Arc::new(Voxels::Sparse(self.voxels.to_sparse().into_owned()));
        }
        self
    }

    /// The same volume with medium only inside `domain` (index space), as for sparse grids, whose
    /// medium ends one voxel outside of their active bounding box. `domain` is clipped to the
    /// voxels' extent.
    #[must_use]
    pub fn with_domain(mut self, domain: Aabb) -> Self {
        self.domain.min = self.domain.min.max(domain.min);
        self.domain.max = self.domain.max.min(domain.max);
        self.whole = self.domain;
        self
    }

    /// The same volume, of which a part alone holds medium: from `low` to `high`, in shares of its
    /// domain along the axes of the index space, in place of what was clipped before. The whole is
    /// 0 to 1.
    ///
    /// # Errors
    /// If a share is not in 0..1, or if they do not rise along an axis.
    pub fn clipped(&self, [low, high]: [[f64; 3]; 2]) -> Result<Self> {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let within = |v: DVec3| v.cmpge(DVec3::ZERO).all() && v.cmple(DVec3::ONE).all();
        if !(within(low) && within(high) && low.cmplt(high).all()) {
            let why = format!("{low}, {high} are not corners of a box within 0..1");
            return Err(Error::value("volume.clip", why));
        }
        let at = |share: DVec3| self.whole.min + share * self.whole.size();
        let domain = Aabb { min: at(low), max: at(high) };
        Ok(Self { domain, ..self.clone() })
    }

    /// The same volume with the densities low..high of `window` mapped to 0..1, as by
    /// [`Volume::with_window`]; negative stored values are already 0 here.
    ///
    /// # Errors
    /// If the window is empty or not finite.
    pub fn windowed(self, window: [f32; 2]) -> Result<Self> {
        self.levelled(Levels::Window(window))
    }

    /// The same volume, with its densities treated as stored values that `levels` turns into
    /// others.
    ///
    /// # Errors
    /// If the values of `levels` do not rise or are not finite.
    pub fn levelled(mut self, levels: Levels) -> Result<Self> {
        self.moved = levels.apply(Arc::make_mut(&mut self.voxels))?;
        self.levels = None;
        self.largest = self.voxels.largest();
        (self.bricks, self.typical) = (OnceLock::new(), OnceLock::new());
        Ok(self)
    }

    /// The largest density.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// The largest density without a few outliers, such as hot pixels, which should not determine a
    /// picture.
    pub fn typical_largest(&self) -> f32 {
        *self.typical.get_or_init(|| Ranks::of(&self.voxels).typical_largest())
    }

    /// The offset that was added to stored values to make them densities ([`Levels::Moved`]), else
    /// 0.
    pub fn moved_by(&self) -> f32 {
        self.moved.by
    }

    /// The smallest and the largest stored value, without a few outliers, of a volume whose values
    /// were moved ([`Levels::Moved`]); else `None`.
    pub fn stored_range(&self) -> Option<[f32; 2]> {
        self.moved.stored
    }

    /// The smallest density.
    pub fn smallest(&self) -> f32 {
        self.voxels.range()[0]
    }

    /// The share of voxels, 0..1, whose densities lie in `low..=high`. Both limits are accurate to
    /// within a percent.
    pub fn share_between(&self, low: f32, high: f32) -> f64 {
        let all = self.dims().iter().map(|&n| n as f64).product::<f64>();
        Ranks::of(&self.voxels).between(low, high) as f64 / all
    }

    /// The range of densities in each brick. Computed at first use.
    pub fn bricks(&self) -> &Bricks {
        self.bricks.get_or_init(|| Bricks::of(&self.voxels))
    }

    /// The densities as they are stored, finite and at least 0.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Densities, shape (z, y, x), in standard layout, finite and at least 0; a copy if they are
    /// stored sparse.
    pub fn values(&self) -> Cow<'_, Array3<f32>> {
        self.voxels.to_dense()
    }

    /// Number of voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.voxels.dims()
    }

    /// Transform from voxel index (x, y, z) to world position, for column vectors.
    pub fn world_from_index(&self) -> &DMat4 {
        &self.world_from_index
    }

    /// The part of index space that holds medium; -0.5 .. n-0.5 along each axis for a dense volume.
    pub fn domain(&self) -> Aabb {
        self.domain
    }

    /// The box around the domain in world space.
    pub fn world_bounds(&self) -> Aabb {
        self.domain.transformed(&self.world_from_index)
    }

    /// The corners of the domain in world space, x fastest.
    pub fn world_corners(&self) -> [DVec3; 8] {
        self.domain.corners().map(|p| self.world_from_index.transform_point3(p))
    }

    /// World positions around the visible parts: along each axis, the ends of the rows of voxels
    /// above `share` of [`Volume::typical_largest`], half a voxel further out, in about 12,000 rows
    /// at most. If nothing is visible they are the domain's corners.
    pub fn visible_points(&self, share: f32) -> Vec<DVec3> {
        let points = self.seen_points(share);
        if points.is_empty() { self.world_corners().to_vec() } else { points }
    }

    /// Like [`Volume::visible_points`], but empty if nothing is visible.
    pub fn seen_points(&self, share: f32) -> Vec<DVec3> {
        let least = self.typical_largest() * share;
        let points = statistics::row_ends_above(&self.voxels, least, 64);
        let held = points.into_iter().map(|p| p.clamp(self.domain.min, self.domain.max));
        held.map(|p| self.world_from_index.transform_point3(p)).collect()
    }

    /// How many stored values were negative, NaN or infinite and became 0.
    pub fn replaced(&self) -> usize {
        self.replaced
    }

    /// Range, mean and border level of all voxels.
    pub fn statistics(&self) -> Statistics {
        Statistics::of(&self.voxels)
    }

    /// Integrals of density over world length along all columns of voxels, sorted by rising value;
    /// columns without medium are left out. The columns follow the index axis that is closest to
    /// the world direction `direction`. Of sparse volumes with more than some tens of millions of
    /// columns, an evenly spaced part is taken.
    pub fn column_integrals(&self, direction: DVec3) -> Vec<f64> {
        let steps = [DVec3::X, DVec3::Y, DVec3::Z]
            .map(|axis| self.world_from_index.transform_vector3(axis));
        let along = steps.map(|step| (step.normalize_or_zero().dot(direction)).abs());
        let axis = if along[0] >= along[1].max(along[2]) {
            0
        } else {
            1 + usize::from(along[2] > along[1])
        };
        let spacing = steps[axis].length();
        let sums = statistics::nonempty_column_sums(&self.voxels, axis);
        sums.into_iter().map(|sum| sum * spacing).collect()
    }

    /// A quantile of the integrals of density over world length along columns of voxels: a share
    /// `share`, 0..1, of the columns lies below it; empty columns do not count. It is the harmonic
    /// mean over the three index axes, in which the shortest columns count most, so it does not
    /// depend on the volume's orientation or the order of its axes. `None` if the volume is empty.
    pub fn column_quantile(&self, share: f64) -> Option<f64> {
        let mut inverse = 0.0;
        for (axis, along) in DVec3::AXES.into_iter().enumerate() {
            let length = self.world_from_index.transform_vector3(along).length();
            let sums = statistics::nonempty_column_sums(&self.voxels, axis);
            inverse += 1.0 / (sums.get((sums.len() as f64 * share) as usize)? * length);
        }
        Some(3.0 / inverse)
    }
}

fn check_placement(name: &str, world_from_index: &DMat4) -> Result<()> {
    if world_from_index.row(3) != glam::DVec4::W {
        let row = world_from_index.row(3);
        let why = format!("world_from_index is not affine: its last row is {row}");
        return Err(Error::value(name, why));
    }
    let determinant = world_from_index.determinant();
    if !determinant.is_normal() || !world_from_index.is_finite() {
        let why = format!("world_from_index has no inverse (determinant {determinant})");
        return Err(Error::value(name, why));
    }
    Ok(())
}
