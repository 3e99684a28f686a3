//! Places a volume's voxels in the world: spacing, axes, given bounds.

use glam::{DMat3, DMat4, DVec3};

use crate::error::{Error, Result};
use crate::math::Aabb;

/// The axis of a file that points up in the world (`--up`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Axis {
    X,
    #[default]
    Y,
    Z,
    NegativeX,
    NegativeY,
    NegativeZ,
}

impl Axis {
    /// The name of the axis, such as `y` or `-z`.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::NegativeX => "-x",
            Self::NegativeY => "-y",
            Self::NegativeZ => "-z",
        }
    }

    /// The rotation that turns this axis of the file into the world's y axis.
    pub fn world_from_file(self) -> DMat3 {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        // The columns are the images of the file's x, y and z axes; each matrix is a rotation.
        let columns = match self {
            Self::X => [y, -x, z],
            Self::Y => [x, y, z],
            Self::Z => [x, -z, y],
            Self::NegativeX => [-y, x, z],
            Self::NegativeY => [-x, -y, z],
            Self::NegativeZ => [x, z, -y],
        };
        DMat3::from_cols(columns[0], columns[1], columns[2])
    }
}

impl std::str::FromStr for Axis {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Ok(match text {
            "x" | "+x" => Self::X,
            "y" | "+y" => Self::Y,
            "z" | "+z" => Self::Z,
            "-x" => Self::NegativeX,
            "-y" => Self::NegativeY,
            "-z" => Self::NegativeZ,
            _ => {
                return Err(Error::value(
                    "up",
                    format!("'{text}' is not one of x, y, z, -x, -y, -z"),
                ));
            }
        })
    }
}

/// The transform from the index range -0.5 .. n-0.5 of a dense volume of `dims` (x, y, z) to the
/// world box `bounds`, with the file's axis `up` along the world's y. The data's handedness is
/// kept.
///
/// # Errors
/// If `bounds` is empty along an axis or not finite.
pub fn world_from_index_in_bounds(dims: [usize; 3], bounds: &Aabb, up: Axis) -> Result<DMat4> {
    let size = bounds.size();
    if !(bounds.min.is_finite() && bounds.max.is_finite() && size.min_element() > 0.0) {
        let why = format!("{} .. {} is not a box with min < max", bounds.min, bounds.max);
        return Err(Error::value("bounds", why));
    }
    let turn = DMat4::from_mat3(up.world_from_file());
    let voxels = DVec3::from_array(dims.map(|n| n as f64));
    // Index space, centred and turned, then stretched onto the bounds axis by axis.
    let centred = turn * DMat4::from_translation(-(voxels * 0.5 - 0.5));
    let turned_size = turn.transform_vector3(voxels).abs();
    Ok(DMat4::from_translation(bounds.center()) * DMat4::from_scale(size / turned_size) * centred)
}
