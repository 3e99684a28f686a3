//! A volume: voxel values, where they lie in the world, and what the values look like as a whole.
//! Knows no file format and no light; values stay as they were stored.
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
use std::sync::OnceLock;

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

/// The longest a volume may be along one axis.
pub const MAX_DIM: usize = 1 << 20;

/// Voxel values on a regular grid and their place in the world.
///
/// Between voxel centres the density is trilinear, within half a voxel of the border it is clamped,
/// outside of [`Volume::domain`] it is zero.
#[derive(Clone, Debug)]
pub struct Volume {
    /// What the source calls it: a preset, a file's stem, a grid.
    pub name: String,
    /// Densities in the source's own unit; finite and at least 0.
    voxels: Voxels,
    /// From voxel index (x, y, z) to world position, column vectors.
    world_from_index: DMat4,
    /// The part of index space that holds medium.
    domain: Aabb,
    /// How many stored values were negative, NaN or infinite and render as 0.
    replaced: usize,
    /// The largest density.
    largest: f32,
    /// What was done to stored values.
    moved: Moved,
    /// The largest density but for a few voxels; made when first asked for.
    typical: OnceLock<f32>,
    /// Made when first asked for.
    bricks: OnceLock<Bricks>,
}

impl Volume {
    /// A volume of densities by (z, y, x), at least 0, whose voxels have edges of `spacing` world
    /// lengths along x, y and z; the first voxel's centre is the world's origin, and y points up.
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

    /// The same from values that are dense or sparse, with the stored values `low..high` mapped to
    /// 0..1 first, clamped on both sides, voxel by voxel before interpolation; so negative values
    /// (Hounsfield units) keep their order.
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

    /// The same, with stored values that become densities as `levels` says.
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
            voxels,
            world_from_index,
            domain,
            replaced,
            largest,
            moved,
            typical,
            bricks,
        })
    }

    /// The same volume elsewhere.
    ///
    /// # Errors
    /// If `world_from_index` has no inverse.
    pub fn placed(self, world_from_index: DMat4) -> Result<Self> {
        check_placement(&self.name, &world_from_index)?;
        Ok(Self { world_from_index, ..self })
    }

    /// The same volume with its values in blocks, of which equal ones share one: less memory where
    /// much of it is empty, and a little slower to sample.
    #[must_use]
    pub fn sparse(mut self) -> Self {
        if let Voxels::Dense(_) = &self.voxels {
            self.voxels = Voxels::Sparse(self.voxels.to_sparse().into_owned());
        }
        self
    }

    /// The same volume with medium only inside `domain` (index space), as for sparse grids whose
    /// medium ends one voxel outside their active bounding box. Cut to the voxels' own extent.
    #[must_use]
    pub fn with_domain(mut self, domain: Aabb) -> Self {
        self.domain.min = self.domain.min.max(domain.min);
        self.domain.max = self.domain.max.min(domain.max);
        self
    }

    /// The same volume with the densities `low..high` mapped to 0..1, as by
    /// [`Volume::with_window`]; negative values are already 0 here.
    ///
    /// # Errors
    /// If the window is empty or not finite.
    pub fn windowed(self, window: [f32; 2]) -> Result<Self> {
        self.levelled(Levels::Window(window))
    }

    /// The same volume with its densities taken for stored values that become others as `levels`
    /// says.
    ///
    /// # Errors
    /// If the values of `levels` do not rise or are not finite.
    pub fn levelled(mut self, levels: Levels) -> Result<Self> {
        self.moved = levels.apply(&mut self.voxels)?;
        self.largest = self.voxels.largest();
        (self.bricks, self.typical) = (OnceLock::new(), OnceLock::new());
        Ok(self)
    }

    /// The largest density.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// The largest density, but for a few voxels that stand apart from all others: a hot pixel is
    /// nothing that a picture should be made for.
    pub fn typical_largest(&self) -> f32 {
        *self.typical.get_or_init(|| Ranks::of(&self.voxels).typical_largest())
    }

    /// What was added to stored values to make densities of them ([`Levels::Moved`]), else 0.
    pub fn moved_by(&self) -> f32 {
        self.moved.by
    }

    /// The smallest and the largest stored value, but for a few that stand apart, of a volume that
    /// was moved ([`Levels::Moved`]).
    pub fn stored_range(&self) -> Option<[f32; 2]> {
        self.moved.stored
    }

    /// The smallest density.
    pub fn smallest(&self) -> f32 {
        self.voxels.range()[0]
    }

    /// Share of the voxels whose densities lie between two, both included, to within a percent of
    /// each.
    pub fn share_between(&self, low: f32, high: f32) -> f64 {
        let all = self.dims().iter().map(|&n| n as f64).product::<f64>();
        Ranks::of(&self.voxels).between(low, high) as f64 / all
    }

    /// The range of densities in each brick.
    pub fn bricks(&self) -> &Bricks {
        self.bricks.get_or_init(|| Bricks::of(&self.voxels))
    }

    /// Densities as they are held, finite and at least 0.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Densities, shape (z, y, x), standard layout, finite and at least 0: a copy where they are
    /// held sparse.
    pub fn values(&self) -> Cow<'_, Array3<f32>> {
        self.voxels.to_dense()
    }

    /// Voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.voxels.dims()
    }

    /// From voxel index (x, y, z) to world position, column vectors.
    pub fn world_from_index(&self) -> &DMat4 {
        &self.world_from_index
    }

    /// The part of index space that holds medium; -0.5 .. n-0.5 for a dense volume.
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

    /// Points in world space around what can be seen: the ends of rows of voxels, along each axis,
    /// above `share` of the largest value that is typical, half a voxel further out, in some 12,000
    /// rows at most; the domain's corners if nothing can be seen.
    pub fn visible_points(&self, share: f32) -> Vec<DVec3> {
        let points = self.seen_points(share);
        if points.is_empty() { self.world_corners().to_vec() } else { points }
    }

    /// The same; none if nothing can be seen.
    pub fn seen_points(&self, share: f32) -> Vec<DVec3> {
        let least = self.typical_largest() * share;
        let points = statistics::row_ends_above(&self.voxels, least, 64);
        let held = points.into_iter().map(|p| p.clamp(self.domain.min, self.domain.max));
        held.map(|p| self.world_from_index.transform_point3(p)).collect()
    }

    /// How many stored values were negative, NaN or infinite and render as 0.
    pub fn replaced(&self) -> usize {
        self.replaced
    }

    /// Range, mean and the level of the border, of all voxels.
    pub fn statistics(&self) -> Statistics {
        Statistics::of(&self.voxels)
    }

    /// Integrals of density over world length through all columns of voxels along the index axis
    /// that is closest to `direction` (world), columns without medium left out, rising. Of sparse
    /// volumes of more than some millions of columns, an even share of them.
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

    /// The integral of density over world length that `share` of the columns of voxels along an
    /// axis are below of, without those that hold nothing: the harmonic mean over the three index
    /// axes, in which the shortest ways count most. However the volume lies, and whatever the order
    /// of its axes, it is the same. `None` if nothing is there.
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
