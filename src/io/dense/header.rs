//! What a dense file says of its voxels, whatever its format. Knows no voxels.

use glam::{DMat4, IVec3};

use super::space::Space;
use crate::io::number::{Endian, ValueType};
use crate::io::vdb::{IndexBox, Statistics};
use crate::volume::Axis;

/// Which index runs fastest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// x, then y, then z.
    #[default]
    XFastest,
    /// z, then y, then x: NumPy's Fortran order of a (z, y, x) array.
    ZFastest,
}

/// What a file says of its voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseHeader {
    /// What the file calls them, if it does.
    pub name: Option<String>,
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// Numbers in a voxel, beside each other; more than one are a vector or a colour.
    pub components: usize,
    /// Number type, as stored.
    pub value_type: ValueType,
    /// Byte order.
    pub endian: Endian,
    /// Order of the voxels.
    pub order: Order,
    /// Slope and intercept: a value is the stored number times the first plus the second.
    pub scale: [f64; 2],
    /// From voxel index (x, y, z), centres at integers, to the file's own world.
    pub world_from_index: DMat4,
    /// What that world is, where the file says so. A patient's is LPS, whatever the file's own was.
    pub space: Option<Space>,
    /// The axis that points up, where the file says so.
    pub up: Option<Axis>,
    /// The larger grid of indices that the voxels are a box of, where the file says so.
    pub lattice: Option<Lattice>,
    /// The value around the voxels, a number for each component, where the file says so.
    pub background: Option<Vec<f64>>,
    /// OpenVDB's class, where the file says so.
    pub class: Option<String>,
    /// What a sparse grid says beyond its box.
    pub sparse: Option<SparsePart>,
    /// CRC-32 that the voxels' bytes have, where the file says so.
    pub crc32: Option<u32>,
    /// How the voxels are packed, in a word.
    pub compression: &'static str,
    /// Everything else that it says, in the order of the file.
    pub metadata: Vec<(String, String)>,
    /// What was taken for granted where the file leaves it open, in words, with the option that
    /// decides.
    pub notes: Vec<String>,
}

/// Indices that go on beyond a box of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// From these indices to the file's own world.
    pub world_from_index: DMat4,
    /// Index of the box's first voxel.
    pub origin: IVec3,
}

/// What is known of a sparse grid that was made dense: the box has one voxel of its surroundings on
/// every side of the active ones.
#[derive(Clone, Debug, PartialEq)]
pub struct SparsePart {
    /// The box around the active voxels, in the grid's own indices.
    pub active_bounds: IndexBox,
    /// Number of active voxels.
    pub active_voxels: u64,
    /// The value outside of the tree.
    pub background: f32,
    /// Whether the values are distances to a surface, negative inside.
    pub level_set: bool,
    /// Of the active values.
    pub statistics: Statistics,
}

impl DenseHeader {
    pub(in crate::io) fn new(dims: [usize; 3], value_type: ValueType) -> Self {
        Self {
            name: None,
            dims,
            components: 1,
            value_type,
            endian: Endian::Little,
            order: Order::XFastest,
            scale: [1.0, 0.0],
            world_from_index: DMat4::IDENTITY,
            space: None,
            up: None,
            lattice: None,
            background: None,
            class: None,
            sparse: None,
            crc32: None,
            compression: "none",
            metadata: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Bytes of all voxels as stored.
    pub(in crate::io) fn bytes(&self) -> u128 {
        let [x, y, z] = self.dims.map(|n| n as u128);
        x * y * z * self.components as u128 * self.value_type.size() as u128
    }

    /// Bytes of all voxels as densities.
    pub fn memory_bytes(&self) -> u128 {
        self.dims.iter().map(|&n| n as u128).product::<u128>() * size_of::<f32>() as u128
    }
}
