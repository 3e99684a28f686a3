//! What a dense file says about its voxels, whatever its format. Knows no voxels.

use glam::{DMat4, IVec3};

use super::space::Space;
use crate::io::number::{Endian, ValueType};
use crate::io::vdb::{IndexBox, Statistics};
use crate::volume::Axis;

/// Order of the voxels in a file, by the index that varies fastest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// x, then y, then z.
    #[default]
    XFastest,
    /// z, then y, then x: NumPy's Fortran order of a (z, y, x) array.
    ZFastest,
}

/// What a file says about its voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseHeader {
    /// The name in the file, if it has one.
    pub name: Option<String>,
    /// Voxel counts along x, y, z.
    pub dims: [usize; 3],
    /// Numbers per voxel, stored next to each other; more than one are a vector or a colour.
    pub components: usize,
    /// Number type, as stored.
    pub value_type: ValueType,
    /// Byte order.
    pub endian: Endian,
    /// Order of the voxels.
    pub order: Order,
    /// Slope and intercept: a value is the stored number times the first plus the second.
    pub scale: [f64; 2],
    /// Transform from voxel index (x, y, z), with voxel centres at integers, to the file's own
    /// world.
    pub world_from_index: DMat4,
    /// The coordinate system of that world, if the file says so. A patient's is always LPS here,
    /// whatever the file uses.
    pub space: Option<Space>,
    /// The axis that points up, if the file says so.
    pub up: Option<Axis>,
    /// The larger grid of indices of which the voxels are a box, if the file says so.
    pub lattice: Option<Lattice>,
    /// The value outside of the voxels, one number per component, if the file says so.
    pub background: Option<Vec<f64>>,
    /// OpenVDB's class, if the file says so.
    pub class: Option<String>,
    /// Further properties if the voxels come from a sparse grid.
    pub sparse: Option<SparsePart>,
    /// CRC-32 that the voxels' bytes must have, if the file says so.
    pub crc32: Option<u32>,
    /// Name of the voxels' compression.
    pub compression: &'static str,
    /// All other metadata as (key, value), in the order of the file.
    pub metadata: Vec<(String, String)>,
    /// Assumptions that were made where the file is ambiguous, as text, with the option that
    /// overrides each.
    pub notes: Vec<String>,
}

/// A grid of indices that is larger than a box of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Transform from these indices to the file's own world.
    pub world_from_index: DMat4,
    /// Index of the box's first voxel.
    pub origin: IVec3,
}

/// Properties of a sparse grid that was made dense. The box extends one voxel beyond the active
/// voxels on every side.
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
    /// Statistics of the active values.
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

    /// Bytes of all voxels in the file's number type.
    pub(in crate::io) fn bytes(&self) -> u128 {
        let [x, y, z] = self.dims.map(|n| n as u128);
        x * y * z * self.components as u128 * self.value_type.size() as u128
    }

    /// Bytes of all voxels as densities, which are f32.
    pub fn memory_bytes(&self) -> u128 {
        self.dims.iter().map(|&n| n as u128).product::<u128>() * size_of::<f32>() as u128
    }
}
