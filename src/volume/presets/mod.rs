//! The four volumes of the volumetric deep shadow map paper (its figure 2), computed procedurally,
//! with the same voxels on every machine. Values are 8-bit densities, 0..1 in steps of 1/255.
//! `volumes/*.toml` says how they are lit and viewed; this module does not.

mod bucky;
mod clouds;
mod crossed_rods;
mod fourier;
mod graded_box;
mod numpy_random;

use glam::DVec3;
use ndarray::Array3;

use super::{Axis, Volume, world_from_index_in_bounds};
use crate::error::{Error, Result};
use crate::math::Aabb;

/// A volume that the library computes itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// 64 x 64 x 64, more opaque towards the centre.
    Box,
    /// 32 x 32 x 32, the carbon molecule C60: atoms, bonds and a faint shell.
    Bucky,
    /// 64 x 64 x 64, two crossed rods in empty space.
    Rods,
    /// 512 x 512 x 32, a layer of clouds with gaps; z is up.
    Clouds,
}

impl Preset {
    /// All presets, in the paper's order.
    pub const ALL: [Self; 4] = [Self::Box, Self::Bucky, Self::Rods, Self::Clouds];

    /// The name on the command line and in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Bucky => "bucky",
            Self::Rods => "rods",
            Self::Clouds => "clouds",
        }
    }

    /// The volume, with a longest edge of 1 world length, centred at the world's origin, with the
    /// file axis `up` along the world's y.
    ///
    /// # Errors
    /// Never for these presets; but placing a volume can fail in general.
    pub fn volume(self, up: Axis) -> Result<Volume> {
        let voxels = self.voxels();
        let (z, y, x) = voxels.dim();
        let dims = [x, y, z];
        let longest = x.max(y).max(z) as f64;
        let turned = up.world_from_file() * DVec3::from_array(dims.map(|n| n as f64));
        let half = turned.abs() / longest * 0.5;
        let bounds = Aabb { min: -half, max: half };
        Volume::new(self.name(), voxels, world_from_index_in_bounds(dims, &bounds, up)?)
    }

    /// Densities, shape (z, y, x), 0..1.
    pub fn voxels(self) -> Array3<f32> {
        match self {
            Self::Box => graded_box::voxels(64),
            Self::Bucky => bucky::voxels(32),
            Self::Rods => crossed_rods::voxels(64),
            Self::Clouds => clouds::voxels(512, 32, 7),
        }
    }
}

impl std::str::FromStr for Preset {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == text).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::value("preset", format!("'{text}' is not one of {names}"))
        })
    }
}

/// `density` clamped to 0..1 and rounded to a multiple of 1/255, ties to even as numpy rounds.
fn eight_bits(density: f64) -> f32 {
    ((density.clamp(0.0, 1.0) * 255.0).round_ties_even() / 255.0) as f32
}

/// A cube of `n` voxels along each axis with `density(x, y, z)` at voxel centres in -1..1.
fn cube(n: usize, density: impl Fn([f64; 3]) -> f64) -> Array3<f32> {
    let centre = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    Array3::from_shape_fn((n, n, n), |(z, y, x)| {
        eight_bits(density([centre(x), centre(y), centre(z)]))
    })
}
