//! Converts dense voxels to a sparse OpenVDB grid. Knows nothing of files.

use glam::IVec3;

use super::grid::DenseGrid;
use crate::error::memory;
use crate::error::{Error, Result};
use crate::io::number::ValueType;
use crate::io::remap::Remap;
use crate::io::vdb::{Grid, IndexBox, Tree, TreeBuilder, Value};
use crate::parallel;

/// Edge of a leaf, in voxels.
pub(super) const EDGE: i32 = 8;

impl DenseGrid {
    /// The number type of the OpenVDB grid for these voxels. It holds each number exactly; unsigned
    /// 64-bit numbers must fit signed ones.
    pub fn vdb_type(&self) -> ValueType {
        use ValueType::{F16, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        match self.value_type {
            U8 | I8 | U16 | I16 | F16 | F32 => F32,
            F64 => F64,
            I32 => I32,
            U32 | U64 | I64 if self.components == 3 => F64,
            U32 | U64 | I64 => I64,
        }
    }

    /// Converts the voxels to a tree. Active are the voxels that are marked so. Without marks, it
    /// is those that are other numbers than the background (-0 is 0, and keeps its sign); without a
    /// background, all.
    ///
    /// # Errors
    /// If a voxel has neither 1 nor 3 numbers, or if a number does not fit.
    pub fn into_vdb(self) -> Result<Grid> {
        let to = self.vdb_type();
        let limits = to.limits().filter(|_| self.value_type == ValueType::U64);
        if let (Some([_, most]), Some([_, largest])) = (limits, self.span().range)
            && largest >= most
        {
            return Err(Error::value("type", format!("{largest} is beyond OpenVDB's int64")));
        }
        let grid = self.retyped(to, Remap::Cast)?;
        Ok(match (grid.components, to) {
            (1, ValueType::F32) => grid.tree::<f32>()?.into(),
            (1, ValueType::F64) => grid.tree::<f64>()?.into(),
            (1, ValueType::I32) => grid.tree::<i32>()?.into(),
            (1, ValueType::I64) => grid.tree::<i64>()?.into(),
            (3, ValueType::F32) => grid.tree::<[f32; 3]>()?.into(),
            (3, ValueType::F64) => grid.tree::<[f64; 3]>()?.into(),
            (3, ValueType::I32) => grid.tree::<[i32; 3]>()?.into(),
            (count, _) => {
                let why = format!("{count} numbers per voxel; OpenVDB holds 1 or 3 (`magnitude`)");
                return Err(Error::value("components", why));
            }
        })
    }

    fn tree<T: Value>(&self) -> Result<Tree<T>> {
        let bounds = self.bounds()?;
        let bytes = self.bytes.len() / T::BYTES * size_of::<T>();
        memory::check(bytes as u64, "a tree of all voxels")?;
        let background = self.tree_background();
        let mut builder = TreeBuilder::new(background);
        // One layer of leaves at a time.
        for x in leaves_along(&bounds, 0) {
            let leaf = |origin| {
                let mut values = vec![background; 512];
                let active = self.fill_leaf(origin, &bounds, background, &mut values);
                (origin, (values, active))
            };
            for (origin, block) in parallel::map(leaves_at(&bounds, x), leaf) {
                builder.put_block(origin, block);
            }
        }
        Ok(builder.finish())
    }

    /// The value outside of the box.
    pub(super) fn tree_background<T: Value>(&self) -> T {
        let mut background = [T::default()];
        if let Some(values) = &self.background {
            T::decode(&self.encoded(values), &mut background);
        }
        background[0]
    }

    /// Fills `values` with the 8^3 voxels from `origin` on, z fastest, and returns which of them
    /// are active; `bounds` are those of the box.
    pub(super) fn fill_leaf<T: Value>(
        &self,
        origin: IVec3,
        bounds: &IndexBox,
        background: T,
        values: &mut [T],
    ) -> [u64; 8] {
        values.fill(background);
        let mut active = [0_u64; 8];
        let cube = IndexBox { min: origin, max: origin | (EDGE - 1) };
        let Some(part) = cube.intersection(bounds) else { return active };
        let [nx, ny, _] = self.dims;
        let length = (part.max.x - part.min.x + 1) as usize;
        let mut row = [background; EDGE as usize];
        let row = &mut row[..length];
        for z in part.min.z..=part.max.z {
            for y in part.min.y..=part.max.y {
                let at = IVec3::new(part.min.x, y, z);
                let [x, y, z] = (at - bounds.min).to_array().map(|n| n as usize);
                let first = (z * ny + y) * nx + x;
                T::decode(&self.bytes[first * T::BYTES..(first + length) * T::BYTES], row);
                let within = (at - origin).to_array().map(|n| n as usize);
                for (step, &value) in row.iter().enumerate() {
                    let slot = (within[0] + step) << 6 | within[1] << 3 | within[2];
                    values[slot] = value;
                    let on = match &self.active {
                        Some(active) => active[first + step],
                        None => self.background.is_none() || differs(value, background),
                    };
                    active[slot / 64] |= u64::from(on) << (slot % 64);
                }
            }
        }
        active
    }
}

/// Whether a value is another number than the background; -0 is the number 0.
fn differs<T: Value>(value: T, background: T) -> bool {
    value != background && !value.same_bits(background)
}

/// Origins, along an axis, of the leaves that touch a box.
pub(super) fn leaves_along(bounds: &IndexBox, axis: usize) -> impl Iterator<Item = i32> + use<> {
    (bounds.min[axis] & !(EDGE - 1)..=bounds.max[axis]).step_by(EDGE as usize)
}

/// Origins of the leaves that touch a box, for those at `x` along the first axis.
pub(super) fn leaves_at(bounds: &IndexBox, x: i32) -> Vec<IVec3> {
    let along_z = |y| leaves_along(bounds, 2).map(move |z| IVec3::new(x, y, z));
    leaves_along(bounds, 1).flat_map(along_z).collect()
}
