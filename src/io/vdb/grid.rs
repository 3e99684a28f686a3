//! A loaded grid of any value type, for callers that need not know the type. Knows nothing of
//! files.

use glam::IVec3;
use half::f16;

use super::dense::Dense;
use super::grid_type::ValueType;
use super::index_box::IndexBox;
use super::statistics::Statistics;
use super::tree::Tree;
use super::value::{AnyValue, Value};
use crate::error::Result;
use crate::error::memory;
use crate::volume::Voxels;

/// A loaded grid: a tree of one of the value types. Numbers stored as half floats are widened to
/// the grid's own type; mask grids are trees of booleans.
#[derive(Clone)]
#[non_exhaustive]
#[allow(missing_docs)] // The variants are the file's own type names.
pub enum Grid {
    Float(Tree<f32>),
    Double(Tree<f64>),
    Half(Tree<f16>),
    Int32(Tree<i32>),
    Int64(Tree<i64>),
    Bool(Tree<bool>),
    Vec3s(Tree<[f32; 3]>),
    Vec3d(Tree<[f64; 3]>),
    Vec3i(Tree<[i32; 3]>),
}

/// Runs the expression on the grid's tree, whatever its type is.
macro_rules! with_tree {
    ($grid:expr, $tree:ident => $result:expr) => {
        match $grid {
            $crate::io::vdb::Grid::Float($tree) => $result,
            $crate::io::vdb::Grid::Double($tree) => $result,
            $crate::io::vdb::Grid::Half($tree) => $result,
            $crate::io::vdb::Grid::Int32($tree) => $result,
            $crate::io::vdb::Grid::Int64($tree) => $result,
            $crate::io::vdb::Grid::Bool($tree) => $result,
            $crate::io::vdb::Grid::Vec3s($tree) => $result,
            $crate::io::vdb::Grid::Vec3d($tree) => $result,
            $crate::io::vdb::Grid::Vec3i($tree) => $result,
        }
    };
}
pub(super) use with_tree;

impl Grid {
    /// The value of every voxel that the tree does not hold.
    pub fn background(&self) -> AnyValue {
        with_tree!(self, tree => tree.background().any())
    }

    /// The type of the values; `Bool` for mask grids too.
    pub fn value_type(&self) -> ValueType {
        match self {
            Self::Float(_) => ValueType::Float,
            Self::Double(_) => ValueType::Double,
            Self::Half(_) => ValueType::Half,
            Self::Int32(_) => ValueType::Int32,
            Self::Int64(_) => ValueType::Int64,
            Self::Bool(_) => ValueType::Bool,
            Self::Vec3s(_) => ValueType::Vec3s,
            Self::Vec3d(_) => ValueType::Vec3d,
            Self::Vec3i(_) => ValueType::Vec3i,
        }
    }

    /// The value at a voxel, and whether it is active.
    pub fn get(&self, index: IVec3) -> (AnyValue, bool) {
        with_tree!(self, tree => {
            let (value, active) = tree.get(index);
            (value.any(), active)
        })
    }

    /// Number of active voxels, saturating at `u64::MAX`.
    pub fn active_voxel_count(&self) -> u64 {
        with_tree!(self, tree => tree.active_voxel_count())
    }

    /// The smallest box around all active voxels; `None` if there are none.
    pub fn active_bounds(&self) -> Option<IndexBox> {
        with_tree!(self, tree => tree.active_bounds())
    }

    /// Statistics of the active values, one per component; empty without active voxels.
    pub fn statistics(&self) -> Vec<Statistics> {
        with_tree!(self, tree => tree.statistics())
    }

    /// Calls `each` with the active values as numbers for rendering, and with how many voxels share
    /// each value.
    pub fn for_each_active(&self, mut each: impl FnMut(f32, u64)) {
        with_tree!(self, tree => {
            for region in tree.active_values() {
                each(region.value.to_f32(), region.voxels());
            }
        });
    }

    /// Bytes of memory held.
    pub fn memory_bytes(&self) -> u64 {
        with_tree!(self, tree => tree.memory_bytes())
    }

    /// All voxels of `bounds` in their own type, little endian, x fastest. The components of a
    /// vector are adjacent; booleans are bytes of 0 and 1.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if they take more than `limit_bytes`.
    pub fn dense_bytes(&self, bounds: IndexBox, limit_bytes: u64) -> Result<Vec<u8>> {
        with_tree!(self, tree => {
            let dense = tree.densify(bounds, limit_bytes, |value| value)?;
            encoded(&dense)
        })
    }

    /// Whether each voxel of `bounds` is active, x fastest.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if they take more than `limit_bytes`.
    pub fn dense_activity(&self, bounds: IndexBox, limit_bytes: u64) -> Result<Vec<bool>> {
        with_tree!(self, tree => {
            let dense = tree.densify_active(bounds, limit_bytes, |_, active| active)?;
            Ok(dense.values.into_raw_vec_and_offset().0)
        })
    }

    /// One component of all voxels of `bounds`, active or not. `component` is below
    /// [`Grid::components`].
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if the array takes more than `limit_bytes`.
    pub fn densify_component(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        component: usize,
    ) -> Result<Dense<f32>> {
        let part = |value: f64| value as f32;
        with_tree!(self, tree => {
            tree.densify(bounds, limit_bytes, |value| part(value.component(component)))
        })
    }

    /// Numbers per value: 3 for vectors, else 1.
    pub fn components(&self) -> usize {
        fn of<T: Value>(_: &Tree<T>) -> usize {
            T::COMPONENTS
        }
        with_tree!(self, tree => of(tree))
    }

    /// All voxels of `bounds`, active or not, as numbers for rendering: vectors by their length,
    /// booleans as 0 and 1 (see [`Value::to_f32`]).
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if the array takes more than `limit_bytes`.
    pub fn densify(&self, bounds: IndexBox, limit_bytes: u64) -> Result<Dense<f32>> {
        with_tree!(self, tree => tree.densify(bounds, limit_bytes, Value::to_f32))
    }

    /// All voxels of `bounds`, active or not, as numbers for rendering, each converted by
    /// `convert`. They are dense if they are few or if blocks would save less than half of the
    /// memory, else sparse.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if they take more than `limit_bytes` in either form.
    pub fn voxels(
        &self,
        bounds: IndexBox,
        limit_bytes: u64,
        convert: impl Fn(f32) -> f32 + Sync,
    ) -> Result<Voxels> {
        let all = bounds.dims().iter().fold(4_u64, |all, &n| all.saturating_mul(n));
        let fits = all <= limit_bytes.min(isize::MAX as u64);
        with_tree!(self, tree => {
            let dense = || {
                let convert = |value: _| convert(Value::to_f32(value));
                Ok(Voxels::Dense(tree.densify(bounds, limit_bytes, convert)?.values))
            };
            if all <= FEW_BYTES.min(limit_bytes) {
                return dense();
            }
            let blocks = match tree.blocks(bounds, limit_bytes.min(all)) {
                Err(_) if fits => return dense(),
                blocks => blocks?,
            };
            if blocks.bytes() > all / 2 && fits {
                return dense();
            }
            Ok(Voxels::Sparse(blocks.fill(convert)?))
        })
    }
}

/// Up to this many bytes of voxels, sparse storage gains nothing.
const FEW_BYTES: u64 = 32 << 20;

fn encoded<T: Value>(dense: &Dense<T>) -> Result<Vec<u8>> {
    let mut bytes = memory::room(dense.values.len() * T::BYTES, "a dense grid")?;
    // The array is in standard layout, so x is fastest.
    T::encode(dense.values.as_slice().unwrap_or_default(), &mut bytes);
    Ok(bytes)
}

macro_rules! from_tree {
    ($($variant:ident: $type:ty),*) => {
        $(impl From<Tree<$type>> for Grid {
            fn from(tree: Tree<$type>) -> Self {
                Self::$variant(tree)
            }
        })*
    };
}

from_tree!(Float: f32, Double: f64, Half: f16, Int32: i32, Int64: i64, Bool: bool);
from_tree!(Vec3s: [f32; 3], Vec3d: [f64; 3], Vec3i: [i32; 3]);
