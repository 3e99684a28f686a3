//! Converts the voxels of a dense file to a sparse OpenVDB grid, one layer of leaves at a time, so
//! that little more is in memory than the output. It produces the same bytes as the conversion
//! through all voxels.

use super::grid::DenseGrid;
use super::to_vdb::{EDGE, leaves_along, leaves_at};
use super::{DenseFile, Order};
use crate::error::Result;
use crate::error::memory;
use crate::io::number::{Endian, ValueType, cast};
use crate::io::remap::Remap;
use crate::io::vdb::{
    Compression, Grid, NewGrid, PackedBuilder, PackedTree, Tree, Value, VdbWriter,
};

/// Memory that must stay available besides a layer of leaves, in bytes.
const SPARE: u64 = 4 << 20;

/// A grid with packed voxels, in one of the types that dense numbers become.
pub enum PackedGrid {
    /// Numbers of `f32`.
    Float(PackedTree<f32>),
    /// Numbers of `f64`.
    Double(PackedTree<f64>),
    /// Numbers of `i32`.
    Int32(PackedTree<i32>),
    /// Numbers of `i64`.
    Int64(PackedTree<i64>),
}

impl PackedGrid {
    /// Writes the grid as the next one of a file; `like` has its transform, class and metadata.
    ///
    /// # Errors
    /// As [`VdbWriter::add_packed`].
    pub fn write(self, writer: &mut VdbWriter, like: NewGrid) -> Result<()> {
        match self {
            Self::Float(tree) => writer.add_packed(like, tree),
            Self::Double(tree) => writer.add_packed(like, tree),
            Self::Int32(tree) => writer.add_packed(like, tree),
            Self::Int64(tree) => writer.add_packed(like, tree),
        }
    }

    /// Number of active voxels.
    pub fn active_voxel_count(&self) -> u64 {
        match self {
            Self::Float(tree) => tree.active_voxel_count(),
            Self::Double(tree) => tree.active_voxel_count(),
            Self::Int32(tree) => tree.active_voxel_count(),
            Self::Int64(tree) => tree.active_voxel_count(),
        }
    }
}

impl DenseFile {
    /// The file's voxels as a grid with packed leaves, and everything else about them. `None` for
    /// files that cannot be read in layers, and for numbers that must be examined first.
    ///
    /// # Errors
    /// As [`DenseFile::voxels`], and if indices do not fit 32 bits.
    pub fn packed_vdb(&self, compression: Compression) -> Result<Option<(DenseGrid, PackedGrid)>> {
        let header = self.header();
        let plain = header.order == Order::XFastest
            && header.scale == [1.0, 0.0]
            && header.sparse.is_none()
            && header.components == 1
            && !matches!(header.value_type, ValueType::U64 | ValueType::F16);
        if !plain || !self.payload.comes_in_parts() {
            return Ok(None);
        }
        self.check_memory(header.bytes())?;
        let grid = DenseGrid::without_voxels(self);
        let packed = match grid.vdb_type() {
            ValueType::F32 => PackedGrid::Float(self.packed(&grid, compression)?),
            ValueType::F64 => PackedGrid::Double(self.packed(&grid, compression)?),
            ValueType::I32 => PackedGrid::Int32(self.packed(&grid, compression)?),
            ValueType::I64 => PackedGrid::Int64(self.packed(&grid, compression)?),
            _ => return Ok(None),
        };
        Ok(Some((grid, packed)))
    }

    fn packed<T: Value>(&self, grid: &DenseGrid, compression: Compression) -> Result<PackedTree<T>>
    where
        Grid: From<Tree<T>>,
    {
        let whole = grid.bounds()?;
        let layer = grid.dims[0] * grid.dims[1] * grid.voxel_bytes();
        let (from, to) = (grid.value_type, grid.vdb_type());
        // The background in the tree's number type.
        let empty = DenseGrid { bytes: Vec::new(), ..grid.clone() }.retyped(to, Remap::Cast)?;
        let background = empty.tree_background::<T>();
        let mut builder = PackedBuilder::new(background, compression);
        let mut slab = empty;
        (slab.dims[2], slab.origin) = (0, whole.min);
        let due = self.header.bytes() as usize;
        self.payload.read_parts(&self.path, due, layer, &mut |mut part| {
            if self.header.endian == Endian::Big {
                part.chunks_exact_mut(from.size()).for_each(<[u8]>::reverse);
            }
            let part = if from == to { part } else { cast(&part, from, to)? };
            if slab.bytes.is_empty() {
                memory::reserve(&mut slab.bytes, EDGE as usize * part.len(), "a layer of leaves")?;
            }
            slab.bytes.extend(part);
            slab.dims[2] += 1;
            let next = slab.origin.z + slab.dims[2] as i32;
            if next % EDGE == 0 || next > whole.max.z {
                let bounds = slab.bounds()?;
                // Leaves allocate small pieces, which cannot fail gracefully; packed ones take
                // little more.
                memory::check(2 * slab.bytes.len() as u64 + SPARE, "leaves")?;
                for x in leaves_along(&bounds, 0) {
                    builder.add(&leaves_at(&bounds, x), |origin, values| {
                        slab.fill_leaf(origin, &bounds, background, values)
                    });
                }
                slab.bytes.clear();
                (slab.dims[2], slab.origin.z) = (0, next);
            }
            Ok(())
        })?;
        builder.finish()
    }
}
