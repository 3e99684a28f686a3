//! Parses a grid's type string: the value type, the shape of its tree, and whether its numbers are
//! stored as half floats. Knows nothing of the bytes.

use glam::IVec3;

/// The type of a grid's values.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[allow(missing_docs)] // The variants are the file's own type names.
pub enum ValueType {
    Float,
    Double,
    Half,
    Int32,
    Int64,
    Bool,
    /// Voxels are true where they are active; they are stored without values.
    Mask,
    Vec3s,
    Vec3d,
    Vec3i,
    /// A type whose voxels are not supported (points, strings, ...), by its name in the file.
    Unsupported(String),
}

impl ValueType {
    fn from_name(name: &str) -> Self {
        match name {
            "float" => Self::Float,
            "double" => Self::Double,
            "half" => Self::Half,
            "int32" => Self::Int32,
            "int64" => Self::Int64,
            "bool" => Self::Bool,
            "mask" => Self::Mask,
            "vec3s" => Self::Vec3s,
            "vec3d" => Self::Vec3d,
            "vec3i" => Self::Vec3i,
            other => Self::Unsupported(other.to_owned()),
        }
    }

    /// Whether its numbers may be stored as half floats.
    fn is_floating(&self) -> bool {
        matches!(self, Self::Float | Self::Double | Self::Vec3s | Self::Vec3d)
    }

    /// The type's name in the file.
    pub fn name(&self) -> &str {
        match self {
            Self::Float => "float",
            Self::Double => "double",
            Self::Half => "half",
            Self::Int32 => "int32",
            Self::Int64 => "int64",
            Self::Bool => "bool",
            Self::Mask => "mask",
            Self::Vec3s => "vec3s",
            Self::Vec3d => "vec3d",
            Self::Vec3i => "vec3i",
            Self::Unsupported(name) => name,
        }
    }
}

/// The base-2 logarithms of the edges of a tree's nodes, in children (for leaves: in voxels).
///
/// Nearly every file has 5, 4, 3: a leaf holds 8^3 voxels, a lower branch 16^3 leaves, an upper
/// branch 32^3 lower branches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TreeShape {
    pub(super) upper: u32,
    pub(super) lower: u32,
    pub(super) leaf: u32,
}

impl TreeShape {
    /// Supported edges of nodes, as base-2 logarithms. The smallest has one mask word; the largest
    /// keeps a node's values below 7 MB.
    const LOGARITHMS: std::ops::RangeInclusive<u32> = 2..=6;

    fn parse(text: &str) -> Option<Self> {
        let mut logarithms = text.split('_').map(|log| log.parse().ok());
        let mut next = || logarithms.next()?.filter(|log| Self::LOGARITHMS.contains(log));
        let shape = Self { upper: next()?, lower: next()?, leaf: next()? };
        logarithms.next().is_none().then_some(shape)
    }

    /// Log2 of the edge, in voxels, of a leaf and so of a lower branch's tiles.
    pub(super) fn leaf_log(self) -> u32 {
        self.leaf
    }

    /// Log2 of the edge, in voxels, of a lower branch and so of an upper branch's tiles.
    pub(super) fn lower_log(self) -> u32 {
        self.leaf + self.lower
    }

    /// Log2 of the edge, in voxels, of an upper branch and so of the root's tiles.
    pub(super) fn upper_log(self) -> u32 {
        self.leaf + self.lower + self.upper
    }

    /// Voxels of a leaf.
    pub(super) fn leaf_voxels(self) -> usize {
        1 << (3 * self.leaf)
    }

    /// 64-bit words of a leaf's mask.
    pub(super) fn leaf_words(self) -> usize {
        self.leaf_voxels() / 64
    }
}

/// Slot of the child or voxel at `at` within a node whose edge is 2^`log` slots of 2^`slot_log`
/// voxels; z is fastest.
pub(super) fn slot_of(at: IVec3, log: u32, slot_log: u32) -> usize {
    let mask = (1 << log) - 1;
    let part = |coordinate: i32| ((coordinate >> slot_log) & mask) as usize;
    (part(at.x) << (2 * log)) | (part(at.y) << log) | part(at.z)
}

/// Offset, in voxels from the node's origin, of the slot's lowest voxel; inverse of [`slot_of`].
pub(super) fn slot_offset(slot: usize, log: u32, slot_log: u32) -> IVec3 {
    let mask = (1 << log) - 1;
    let part = |shift: u32| (((slot >> shift) & mask) << slot_log) as i32;
    IVec3::new(part(2 * log), part(log), part(0))
}

/// A parsed type string.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GridType {
    pub(super) value: ValueType,
    /// `None` if the number of the tree's levels is not supported.
    pub(super) shape: Option<TreeShape>,
    pub(super) half: bool,
}

impl GridType {
    /// Parses a type string such as `Tree_float_5_4_3_HalfFloat`.
    pub(super) fn parse(text: &str) -> Self {
        let (tree, half) = match text.strip_suffix("_HalfFloat") {
            Some(tree) => (tree, true),
            None => (text, false),
        };
        let parts = tree.strip_prefix("Tree_").and_then(|rest| rest.split_once('_'));
        let (value, shape) = match parts {
            Some((value, shape)) => (ValueType::from_name(value), TreeShape::parse(shape)),
            None => (ValueType::Unsupported(text.to_owned()), None),
        };
        // OpenVDB marks grids of whole numbers too, and stores these as they are.
        let half = half && value.is_floating();
        Self { value, shape, half }
    }
}
